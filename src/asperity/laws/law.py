"""The interface of a friction law: parameters, friction coefficient, rates of the states.

A law does not contain springs, masses or load programmes. Its methods are pure, element-wise
functions of arrays: every argument may be a number or a JAX array of any shape, and
shapes broadcast. `v` is always the velocity that enters the RATE term (m/s), `state` a tuple with
one array per state variable, `w` the normal load over its mean, W/W0.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, TypeAlias

import equinox as eqx
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity._jax import configure
from asperity.laws.inverse import invert_friction
from asperity.parameters import law_parameters
from asperity.parameters.parameter import Displayed, SummaryLine, parameter_line

configure()  # double precision, before any law makes an array

State: TypeAlias = tuple[Array, ...]


class Law(Displayed, eqx.Module):
    """A friction law. Subclass it, declare the parameters as fields, write the equations below.

    Class attributes
    ----------------
    name : str
        The name by which the command line and tables call the law.
    source : str
        The publication that states the law: keys of `asperity.materials.available_citations` with
        commas between them, or its reference as a text.
    state_names : tuple of str
        One name per state variable, in the order of the `state` tuple. States are dimensionless
        and logarithmic where the physical quantity is positive (ln of an age, not the age), so
        that no step of a solver can make them cross zero.
    equations : tuple of str
        The equations in LaTeX for documentation; may be ().
    exchangeable : tuple of tuple of str
        Sets of parameters that may be exchanged, with their states, without a change of the law,
        such as (("D0", "B"), ("D2", "B2")); () for none. A fit reports them by rising first
        parameter.
    rate_dependent : bool
        False for a law whose force does not depend on velocity; such a law has no dynamics.
    """

    name: ClassVar[str]
    source: ClassVar[str]
    state_names: ClassVar[tuple[str, ...]]
    equations: ClassVar[tuple[str, ...]] = ()
    exchangeable: ClassVar[tuple[tuple[str, ...], ...]] = ()
    rate_dependent: ClassVar[bool] = True

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Name and parameters."""
        known = law_parameters(type(self))
        values = ((p, getattr(self, p.path.rsplit(".", 1)[-1])) for p in known.values())
        return self.name, [parameter_line(p, value) for p, value in values]

    @abstractmethod
    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Interface force over the instantaneous normal load, F_i/W (dimensionless)."""

    @abstractmethod
    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """Time derivative of each state variable (1/s).

        Parameters
        ----------
        v : array
            Velocity of the slider dx/dt (m/s); may be negative for an instant when the asperities
            unload elastically.
        v_plastic : array
            Plastic (irreversible) sliding velocity (m/s): that of `velocity`, positive unless the
            law allows rest and reversal. Equal to `v` when the law has no elastic asperities.
        state : tuple of arrays
        w : array
            W/W0.

        Notes
        -----
        No rate of change of the load appears. A law whose published form contains dW/dt is written
        in a state variable that absorbs it (see `linker_dieterich`), which makes load
        steps exact.
        """

    @abstractmethod
    def steady_state(self, v: ArrayLike) -> State:
        """State variables in steady sliding at velocity `v` (m/s) under the constant load w = 1."""

    @property
    def elastic_length(self) -> ArrayLike:
        """Shear elastic length lambda of the asperities (m): their stiffness is W/lambda."""
        return 0.0

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """ln(v in m/s) at which the law carries the force `friction` = F_i/W: its inverse.

        For slip in the direction of the force, v > 0. A law with a closed form overrides this,
        in a form that stays finite for any argument however large; the default finds it by
        Newton's method on ln v, see `asperity.laws.inverse`.

        Returns
        -------
        array
            -inf where the force is too small for the law to slip.
        """
        return invert_friction(self, friction, state, w)

    def velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Slip velocity (m/s) at which the law carries the force `friction` = F_i/W.

        The exponential of `log_velocity`. A law that is defined at rest and in reversed motion
        overrides this method: its velocity has the sign of the force or is zero, and is finite for
        friction <= 0.
        """
        return jnp.exp(self.log_velocity(friction, state, w))

    def mu_ss(self, v: ArrayLike) -> Array:
        """Steady-sliding friction coefficient at velocity `v` (m/s) under constant load."""
        return self.friction(v, self.steady_state(v), jnp.ones_like(jnp.asarray(v, float)))
