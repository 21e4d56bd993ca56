"""What a differentiable response is compiled for, and the record of what it returns."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.orbit.gradient.parametrised import ParametrisedProblem


class ResponseValues(NamedTuple):
    """Response at some points; F/W0 = mean + sum Re(c_n e^{i n w t}).

    Attributes
    ----------
    mean_friction : array, shape (points,)
    harmonics : complex array, shape (points, count)
        c_1, c_2, ...
    log_multipliers : complex array, shape (points, states)
        ln|m| + i arg m, by falling modulus; of shape (points, 0) where not asked for.
    outcome : int array, shape (points,)
        `asperity.orbit.Outcome` of each point. Where it is not `Outcome.CONVERGED`, all numbers
        and their derivatives are NaN.
    """

    mean_friction: Array
    harmonics: Array
    log_multipliers: Array
    outcome: Array


class Program(NamedTuple):
    """What a program is compiled for: equations, outputs, and whether orbits are searched for."""

    equations: ParametrisedProblem
    harmonics: int
    multipliers: bool
    search: bool | Literal["direct"]

    @property
    def states(self) -> int:
        """Number of states of the equations of motion."""
        return len(self.equations.motion.mechanical) + len(self.equations.law.state_names)


Parameters = dict[str, Array]


def by_point(values: Array, like: Array) -> Array:
    """Values (points,) as an array that broadcasts against `like`, (points, ...)."""
    return values.reshape(values.shape + (1,) * (like.ndim - 1))


def chosen(condition: Array, yes: Any, no: Any) -> Any:
    """Point by point one of two pytrees, the points along the first axis."""
    return jax.tree.map(lambda a, b: jnp.where(by_point(condition, a), a, b), yes, no)


def only_where(condition: Array, parameters: Parameters) -> Parameters:
    """The parameters, constant at points where the condition does not hold.

    Equations without a solution there have NaN for derivatives. Second derivatives multiply these
    by the zero that a choice of the other method leaves, which is NaN too.
    """
    return {
        name: jnp.where(condition, a, jax.lax.stop_gradient(a)) for name, a in parameters.items()
    }
