"""The fast methods within a compiled program: orbits without derivatives, then their response.

Orbits are fixed points of contractions: `asperity.algebra.contraction` has the rule of their
derivatives. The multipliers are functions of the Jacobian along the orbit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.contraction import Equations, contracted, implicit_solution
from asperity.algebra.mirrored_grid import grid
from asperity.algebra.small_systems import Matrix, apply, averaged, inverse_points, jacobian
from asperity.orbit.floquet import floquet_form, log_multipliers_along
from asperity.orbit.gradient.parametrised import Parameters, Program, ResponseValues, only_where
from asperity.orbit.methods.balance import BalanceEquations, balanced_orbit
from asperity.orbit.methods.fourier import (
    LARGEST_CONTRACTING_RATE,
    LoadCycle,
    States,
    advance,
    force_spectrum,
    fourier_orbit,
    load_cycle,
    orbit_error,
    rates_on,
    stretched,
    together,
)
from asperity.orbit.outcome import LARGEST_UNLOADING, SMALLEST_RATE, Outcome
from asperity.orbit.steady_sliding import steady_sliding_of
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem

#: Grid of quasi-static orbits, and the sharpest slip pulse that it resolves.
_NODES, _GRADING, _SHARPEST = 32, 0.3, 18.0
#: Nodes with damping alone, and with inertia, in which the slider swings several times a period.
_DAMPED_NODES, _INERTIAL_NODES = 32, 64
#: Estimated error that must be reached.
_ERROR = 1e-9
_TOLERANCE, _MOST_STEPS = 1e-10, 40
#: Tolerance with inertia or damping, where harmonics may be much smaller than the states'.
_BALANCED_TOLERANCE = 1e-11


class FastOrbits(NamedTuple):
    """Orbits of the fast method; undefined where `converged` is False.

    Attributes
    ----------
    unknowns : pytree
        Unknowns of the equations of the method.
    prepared : tuple
        Data of the linear systems of the derivatives.
    valid, converged : bool array, shape (points,)
        Whether the parameters obey their rules, and whether the orbit converged and is resolved.
    """

    unknowns: Any
    prepared: tuple
    valid: Array
    converged: Array


def has_fast_method(program: Program) -> bool:
    """Whether a fast method can solve it; not for multipliers with inertia or damping."""
    return _quasi_static(program) or not program.multipliers


def _quasi_static(program: Program) -> bool:
    return program.equations.motion is QuasiStatic


def _balance(program: Program) -> BalanceEquations:
    nodes = _INERTIAL_NODES if program.equations.massive else _DAMPED_NODES
    return BalanceEquations(nodes, _GRADING)


@partial(jit_large, static_argnames=("program",))
def fast_orbits(parameters: Parameters, *, program: Program) -> FastOrbits:
    """Orbits by Fourier collocation, checked for convergence and resolution."""
    problem = program.equations.problem(parameters)
    valid = program.equations.valid(parameters)
    rate, sharpness, unloading = steady_sliding_of(problem)
    # Points out of range are left to the search, which reports the reason.
    good = valid & (rate >= SMALLEST_RATE) & (rate < LARGEST_CONTRACTING_RATE)
    good &= (unloading <= LARGEST_UNLOADING) & (sharpness <= _SHARPEST)
    # Points that the method is not for take no steps.
    problem = problem._replace(load=jax.tree.map(lambda a: jnp.where(good, a, 0.0), problem.load))
    solve = _fourier_orbits if _quasi_static(program) else _balanced_orbits
    return solve(problem, program, valid, good)


def fast_values(parameters: Parameters, fast: FastOrbits, program: Program) -> ResponseValues:
    """Response of the orbits, with its derivatives to the parameters."""
    problem = program.equations.problem(only_where(fast.converged, parameters))
    evaluate = _fourier_values if _quasi_static(program) else _balanced_values
    mean, harmonics, logs = evaluate(problem, fast, program)
    outcome = jnp.where(fast.converged, int(Outcome.CONVERGED), int(Outcome.NO_ORBIT))
    return ResponseValues(mean, harmonics.T, logs.T, outcome)


def _fourier_orbits(problem: Problem, program: Program, valid: Array, good: Array) -> FastOrbits:
    system, load = problem
    orbit = fourier_orbit(
        *problem,
        valid.shape[0],
        nodes=_NODES,
        grading=_GRADING,
        tolerance=_TOLERANCE,
        max_steps=_MOST_STEPS,
    )
    cycle = load_cycle(load, _NODES, _GRADING)
    good &= orbit_error(system, cycle, orbit, program.harmonics) < _ERROR
    unknowns = FourierUnknowns(orbit.mean, orbit.zero_mean)
    if program.multipliers:
        J = FourierEquations(_NODES, _GRADING).jacobian(problem, unknowns)
        good &= floquet_form(stretched(cycle, J), cycle.integral, factor=True).converged
    # Other points get states with finite equations, so that no NaN reaches a good point.
    steady = system.steady()
    mean = tuple(jnp.where(good, a, s) for a, s in zip(orbit.mean, steady, strict=True))
    zero_mean = tuple(jnp.where(good, a, 0.0) for a in orbit.zero_mean)
    steps = jnp.where(good.any(), orbit.steps, 0)
    return FastOrbits(FourierUnknowns(mean, zero_mean), (steps,), valid, good)


def _fourier_values(
    problem: Problem, fast: FastOrbits, program: Program
) -> tuple[Array, Array, Array]:
    equations = FourierEquations(_NODES, _GRADING)
    unknowns = implicit_solution(equations, (problem, *fast.prepared), fast.unknowns)
    cycle = equations.cycle(problem)
    mean, harmonics = force_spectrum(
        problem.system, cycle, unknowns.mean, unknowns.zero_mean, program.harmonics
    )
    logs = jnp.zeros((0, *mean.shape), dtype=complex)
    if program.multipliers:
        J = stretched(cycle, equations.jacobian(problem, unknowns))
        logs = log_multipliers_along(J, cycle.integral)
    return mean, harmonics, logs


def _balanced_orbits(problem: Problem, program: Program, valid: Array, good: Array) -> FastOrbits:
    equations = _balance(program)
    orbit = balanced_orbit(
        problem,
        nodes=equations.nodes,
        grading=equations.grading,
        harmonics=program.harmonics,
        tolerance=_BALANCED_TOLERANCE,
        max_steps=_MOST_STEPS,
    )
    good &= orbit.error < _ERROR
    # As above.
    steady = equations.steady(problem)
    unknowns = jax.tree.map(lambda a, s: jnp.where(good, a, s), orbit.unknowns, steady)
    prepared = jax.tree.map(lambda a: jnp.where(good, a, 0.0), orbit.prepared)
    steps = jnp.where(good.any(), orbit.steps, 0)
    return FastOrbits(unknowns, (prepared, steps), valid, good)


def _balanced_values(
    problem: Problem, fast: FastOrbits, program: Program
) -> tuple[Array, Array, Array]:
    equations = _balance(program)
    unknowns = implicit_solution(equations, (problem, *fast.prepared), fast.unknowns)
    mean, harmonics = equations.force_spectrum(problem, unknowns, program.harmonics)
    return mean, harmonics, jnp.zeros((0, *mean.shape), dtype=complex)


#: Iterations of a linear system in addition to those that the orbit took.
_MORE_STEPS = 1


class FourierUnknowns(NamedTuple):
    """A Fourier orbit: mean states (points,) and zero-mean parts (nodes, points)."""

    mean: States
    zero_mean: States


@dataclass(frozen=True)
class FourierEquations(Equations):
    """Orbit equations on a grid; the parameters are (problem, steps that the orbit took).

    Parameters
    ----------
    nodes : int
    grading : float
    """

    nodes: int
    grading: float

    def cycle(self, problem: Problem) -> LoadCycle:
        """The load on the grid."""
        return load_cycle(problem.load, self.nodes, self.grading)

    def jacobian(self, problem: Problem, unknowns: FourierUnknowns) -> Matrix:
        """Derivatives of the rates on the grid to the states, [i][j] of shape (nodes, points)."""
        states = together(*unknowns)
        _, push = jax.linearize(rates_on(problem.system, self.cycle(problem)), *states)
        return jacobian(push, states)

    def prepare(
        self, parameters: tuple[Problem, Array], unknowns: FourierUnknowns
    ) -> tuple[tuple[Matrix, Matrix], Array]:
        """Jacobian and the inverse of its mean; steps."""
        problem, steps = parameters
        J = self.jacobian(problem, unknowns)
        inverse = inverse_points(averaged(J, self.cycle(problem).share))
        return (inverse, J), steps + _MORE_STEPS

    def residual(
        self,
        parameters: tuple[Problem, Array],
        unknowns: FourierUnknowns,
        at: tuple[Matrix, Matrix],
    ) -> FourierUnknowns:
        """The unknowns minus the result of one iteration step from them."""
        problem, _ = parameters
        cycle = self.cycle(problem)
        rates = rates_on(problem.system, cycle)(*together(*unknowns))

        def push(*change: Array) -> States:
            return apply(at[1], change)

        mean, zero_mean, _ = advance(cycle, at[0], unknowns.mean, rates, push)
        return jax.tree.map(jnp.subtract, unknowns, FourierUnknowns(mean, zero_mean))

    def solve(
        self, product: Any, right: FourierUnknowns, at: Any, steps: Array, *, transposed: bool
    ) -> FourierUnknowns:
        """As in `Equations`, by the contraction itself, in half the time.

        With the nodes last, products with the integral need no transposition, however many
        right-hand sides there are.
        """
        inverse, J = at
        tau, integral = grid(self.nodes)
        stretch = 1 + self.grading * np.cos(tau)
        J = [[entry.T for entry in row] for row in J]
        share, integral, n = stretch / self.nodes, (integral * stretch).T, range(len(J))

        def forwards(y: FourierUnknowns) -> FourierUnknowns:
            states = tuple(m[:, None] + z for m, z in zip(y.mean, y.zero_mean, strict=True))
            rates = apply(J, states)
            change = tuple(-c for c in apply(inverse, tuple(r @ share for r in rates)))
            follow = apply(J, tuple(c[:, None] for c in change))
            zero_mean = tuple((r + f) @ integral for r, f in zip(rates, follow, strict=True))
            return FourierUnknowns(together(y.mean, change), zero_mean)

        def backwards(y: FourierUnknowns) -> FourierUnknowns:
            zero_mean = tuple(z @ integral.T for z in y.zero_mean)
            change = [y.mean[j] + sum((J[i][j] * zero_mean[i]).sum(1) for i in n) for j in n]
            mean = [-sum(inverse[i][j] * change[i] for i in n) for j in n]
            rates = [r + m[:, None] * share for r, m in zip(zero_mean, mean, strict=True)]
            states = tuple(sum(J[i][j] * rates[i] for i in n) for j in n)
            means_too = tuple(m + s.sum(1) for m, s in zip(y.mean, states, strict=True))
            return FourierUnknowns(means_too, states)

        contract = backwards if transposed else forwards
        turned = jax.tree.map(jnp.transpose, right)
        return jax.tree.map(jnp.transpose, contracted(contract, turned, steps, points_first=True))
