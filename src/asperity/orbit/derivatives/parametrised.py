"""Equations of motion and load as functions of named parameters.

`Program` is what a differentiable response is compiled for, `ResponseValues` what it returns.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Mapping
from functools import cache, cached_property
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.errors import InputError, require, symbol
from asperity.laws import Law
from asperity.loads import Harmonic, Modulation, Periodic
from asperity.parameters import RULES, Parameter, law_parameters, point_parameters
from asperity.parameters.arguments import typed
from asperity.slider import Motion, QuasiStatic
from asperity.slider.inertial import Inertial, RadiatingAsperities, StiffInertial
from asperity.slider.parameters import equation_parameters, slider_from
from asperity.slider.problem import Problem

#: Series of a `Periodic` load, as the names of their coefficients begin.
_SERIES = ("load", "shear", "pull")


@dataclasses.dataclass(frozen=True)
class ParametrisedProblem:
    """The named parameters of an operating point, and the equations of motion as their function.

    Hashable and without arrays: programs are compiled once for each.

    Attributes
    ----------
    law : type of Law
    motion : type of Motion
    damped : bool
        Whether radiation damping eta is a parameter.
    coefficients : tuple of int, optional
        Harmonics of load, shear force and pulling velocity of a `Periodic` load; None for a
        harmonic one.
    """

    law: type[Law]
    motion: type[Motion]
    damped: bool = False
    coefficients: tuple[int, int, int] | None = None

    @classmethod
    def of(cls, problem: Problem) -> ParametrisedProblem:
        """The parametrisation of a given problem."""
        system, load = problem
        damped = bool(jnp.any(jnp.asarray(system.damping) > 0))
        return cls(type(system.slider.law), type(system), damped, coefficients_of(load))

    @property
    def massive(self) -> bool:
        """Whether the equations have inertia."""
        return self.motion in (Inertial, StiffInertial)

    @property
    def elastic(self) -> bool:
        """Whether the equations need elastic asperities."""
        return self.motion in (Inertial, RadiatingAsperities)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters: of the law, K, W0, M, V, frequency, eta, and of the load."""
        eta = ("eta",) if self.damped else ()
        of_law = law_parameters(self.law)
        return (*of_law, "K", "W0", "M", "V", "frequency", *eta, *self.load_names)

    @cached_property
    def load_names(self) -> tuple[str, ...]:
        """Names of the parameters of the load."""
        return load_names(self.coefficients)

    @property
    def optional(self) -> tuple[str, ...]:
        """Names of parameters without influence, which a caller may leave out."""
        return () if self.massive else ("M",)

    @cached_property
    def table(self) -> dict[str, Parameter]:
        """Kind, rule and meaning of each parameter, in the order of `names`."""
        known = point_parameters(self.law)
        positive = (("M",) if self.massive else ()) + (("lambda",) if self.elastic else ())
        table = {n: known.get(n, Parameter(n, "dimensionless", "finite")) for n in self.names}
        # Mass and asperity compliance must be positive if the equations contain them.
        return table | {n: dataclasses.replace(table[n], rule="positive") for n in positive}

    def problem(self, parameters: Mapping[str, Any]) -> Problem:
        """Equations and load.

        Parameters
        ----------
        parameters : mapping of str to array, shape (points,)
            All of `names`, in SI and unchecked.
        """
        structure, numbers = _numbers_of(self)
        return jax.tree.unflatten(structure, [k * parameters[name] for name, k in numbers])

    def _built(self, parameters: Mapping[str, Any]) -> Problem:
        slider = slider_from(self.law, parameters)
        drive: tuple[Any, ...] = (slider, parameters["V"], 2 * jnp.pi * parameters["frequency"])
        if self.motion is not QuasiStatic:
            none = 0 * jnp.asarray(parameters["V"])
            drive = (*drive, parameters["eta"] if self.damped else none)
        return Problem(self.motion(*drive), self._load(parameters))

    def _load(self, parameters: Mapping[str, Any]) -> Modulation:
        if self.coefficients is None:
            return Harmonic(parameters["epsilon"])
        values = iter([parameters[name] for name in self.load_names])
        series = [tuple((next(values), next(values)) for _ in range(n)) for n in self.coefficients]
        return Periodic(*series)

    def values(self, problem: Problem) -> dict[str, Any]:
        """Parameters of a problem by name: the inverse of `problem`."""
        _, numbers = _numbers_of(self)
        leaves = jax.tree.leaves(problem)
        return {name: a / k for (name, k), a in zip(numbers, leaves, strict=True) if k}

    def influential(self, wanted: Collection[str] | None = None) -> tuple[str, ...]:
        """Those of `wanted`, or of all, that have an influence, in the order of `names`."""
        unit = dict.fromkeys(self.names, 1.0)
        known = {*equation_parameters(*self.problem(unit)), *self.load_names}
        return tuple(n for n in self.names if n in known and (wanted is None or n in wanted))

    def directions(self, names: tuple[str, ...], points: int) -> Problem:
        """Derivatives of a problem by each of `names`, NumPy arrays (names, points)."""
        structure, numbers = _numbers_of(self)
        columns = [k * np.array([n == name for n in names], float) for name, k in numbers]
        return jax.tree.unflatten(structure, [np.tile(c[:, None], points) for c in columns])

    def valid(self, parameters: Mapping[str, Array]) -> Array:
        """Mask of the points whose parameters all obey their rules, shape (points,)."""
        good = [jnp.isfinite(parameters[name]) for name in self.names]
        for name, parameter in self.table.items():
            if parameter.rule != "finite":
                good.append(RULES[parameter.rule].holds(parameters[name]))
        return jnp.stack(good).all(0)


@cache
def _numbers_of(equations: ParametrisedProblem) -> tuple[Any, list[tuple[str, float]]]:
    """Structure of a problem, and each of its numbers as a parameter and its constant factor.

    Raises
    ------
    InputError
        If a user's law converts a parameter otherwise than by a constant factor.
    """
    # At 1 a power of a parameter would equal the parameter.
    some = {name: 2.0 + k for k, name in enumerate(equations.names)}
    factors: dict[int, tuple[str, float]] = {}
    with jax.ensure_compile_time_eval():  # also where a program that needs it is traced
        # Traced: a user's law need not have finite values for these numbers.
        built, push = jax.linearize(equations._built, some)
        for name in some:
            slopes = jax.tree.leaves(push({n: float(n == name) for n in some}))
            factors |= {i: (name, float(k)) for i, k in enumerate(slopes) if k}
    leaves, structure = jax.tree.flatten(built)
    # A number without a parameter is zero.
    numbers = [factors.get(i, ("V", 0.0)) for i in range(len(leaves))]
    for (name, k), leaf in zip(numbers, leaves, strict=True):
        rule, law = "keep its parameters times constants", equations.law.name
        got = f"another function of {symbol(name)} in a field of '{law}'"
        exact = math.isclose(k * some[name], leaf, rel_tol=1e-9)
        require(exact, "law", rule, got, "compute it in the equations of the law")
    return structure, numbers


def coefficients_of(load: Modulation) -> tuple[int, int, int] | None:
    """Numbers of harmonics of a `Periodic` load; None for a harmonic one."""
    if isinstance(load, Harmonic):
        return None
    if not isinstance(load, Periodic):
        rule, got = "be given by its Fourier coefficients for derivatives", type(load).__name__
        raise InputError("modulation", rule, got, "give its samples to asperity.loads.sampled")
    return len(load.load), len(load.shear), len(load.pull)


def load_names(coefficients: tuple[int, int, int] | None) -> tuple[str, ...]:
    """Names of the parameters of a load, in the order of its numbers."""
    if coefficients is None:
        return ("epsilon",)
    return tuple(
        f"{series}_{function}_{k}"
        for series, count in zip(_SERIES, coefficients, strict=True)
        for k in range(1, count + 1)
        for function in ("cos", "sin")
    )


def load_values(load: Modulation) -> dict[str, Any]:
    """Parameters of a load by name."""
    return dict(zip(load_names(coefficients_of(load)), jax.tree.leaves(load), strict=True))


class ResponseValues(NamedTuple):
    """Response at some points; F/W0 = mean + sum Re(c_n e^{i n w t}).

    Attributes
    ----------
    mean_friction : array, shape (points,)
    harmonics : complex array, shape (points, count)
        c_1, c_2, ...
    log_multipliers : complex array, shape (points, states)
        ln|m| + i arg m, by falling modulus; of shape (points, 0) if not requested.
    outcome : int array, shape (points,)
        `asperity.orbit.Outcome` of each point. Where it is not `Outcome.CONVERGED`, all numbers
        and their derivatives are NaN.
    """

    mean_friction: Array
    harmonics: Array
    log_multipliers: Array
    outcome: Array

    @classmethod
    @typed
    def of_columns(
        cls, columns: NDArray[Any] | Array, outcome: Any, harmonics: int
    ) -> ResponseValues:
        """The inverse of `columns`, of shape (..., columns), for a number of harmonics."""
        states = (columns.shape[-1] - 1) // 2 - harmonics
        ends = np.cumsum([1, harmonics, harmonics, states])
        xp = columns.__array_namespace__()
        mean, real, imaginary, growth, turn = xp.split(columns, ends, axis=-1)
        return cls(mean[..., 0], real + 1j * imaginary, growth + 1j * turn, outcome)

    @property
    def columns(self) -> Any:
        """Mean, real and imaginary parts of the harmonics, then of the multipliers, as columns."""
        parts = [a for z in (self.harmonics, self.log_multipliers) for a in (z.real, z.imag)]
        columns = [self.mean_friction[:, None], *parts]
        return self.mean_friction.__array_namespace__().concatenate(columns, axis=1)


class Program(NamedTuple):
    """Static data of a compiled program: equations, outputs, and whether it may use the search."""

    equations: ParametrisedProblem
    harmonics: int
    multipliers: bool
    search: bool | Literal["direct", "coarse"]

    @property
    def states(self) -> int:
        """Number of states of the equations of motion."""
        return len(self.equations.motion.mechanical) + len(self.equations.law.state_names)

    @property
    def columns(self) -> int:
        """Number of real columns of the response, as in `ResponseValues.columns`."""
        return 1 + 2 * self.harmonics + 2 * self.states * self.multipliers

    @property
    def without_search(self) -> Program:
        """The program without orbits of the search."""
        return self._replace(search=False)


Parameters = dict[str, Array]


def by_point(values: Array, like: Array) -> Array:
    """Values (points,) as an array that broadcasts against `like`, (points, ...)."""
    return values.reshape(values.shape + (1,) * (like.ndim - 1))


def chosen(condition: Array, yes: Any, no: Any) -> Any:
    """`yes` where the condition holds, else `no`; pytrees with points along the first axis."""
    return jax.tree.map(lambda a, b: jnp.where(by_point(condition, a), a, b), yes, no)


def only_where(condition: Array, parameters: Parameters) -> Parameters:
    """The parameters, constant at points where the condition does not hold.

    Equations without a solution there have NaN for derivatives. Second derivatives multiply these
    by the zero that a choice of the other method leaves, which is NaN too.
    """
    return {
        name: jnp.where(condition, a, jax.lax.stop_gradient(a)) for name, a in parameters.items()
    }
