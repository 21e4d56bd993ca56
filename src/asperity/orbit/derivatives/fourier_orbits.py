"""Fourier orbits within a compiled program: the orbits, then their response with derivatives.

Orbits are fixed points of contractions: `asperity.algebra.contraction` has the rule of their
derivatives. The multipliers are functions of the Jacobian along the orbit.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.contraction import contracted, implicit_solution
from asperity.algebra.fourier_grid import grid
from asperity.algebra.small_systems import Matrix, apply, averaged, inverse_points
from asperity.orbit.derivatives.parametrised import Parameters, Program, ResponseValues, only_where
from asperity.orbit.floquet import floquet_form, log_multipliers_along
from asperity.orbit.methods.fourier import (
    LARGEST_CONTRACTING_RATE,
    GridEquations,
    States,
    advance,
    force_spectrum,
    fourier_orbit,
    jacobian_on,
    orbit_error,
    per_tau,
    rates_on,
    together,
)
from asperity.orbit.methods.inertial_fourier import BalanceEquations
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


def _equations(program: Program) -> Any:
    """Equations of the method; multipliers are of `FourierEquations` alone."""
    if _quasi_static(program):
        return FourierEquations(_NODES, _GRADING)
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
    equations = _equations(program)
    unknowns, prepared, error, steps = equations.orbits(problem, program.harmonics)
    good &= error < _ERROR
    if program.multipliers:
        good &= floquet_form(*equations.linearised_in_tau(problem, unknowns), factor=True).converged
    # Other points get states with finite equations, so that no NaN reaches a good point.
    steady = equations.steady(problem)
    unknowns = jax.tree.map(lambda a, s: jnp.where(good, a, s), unknowns, steady)
    prepared = jax.tree.map(lambda a: jnp.where(good, a, 0.0), prepared)
    return FastOrbits(unknowns, (prepared, jnp.where(good.any(), steps, 0)), valid, good)


def fast_values(parameters: Parameters, fast: FastOrbits, program: Program) -> ResponseValues:
    """Response of the orbits, with its derivatives by the parameters."""
    problem = program.equations.problem(only_where(fast.converged, parameters))
    equations = _equations(program)
    unknowns = implicit_solution(equations, (problem, *fast.prepared), fast.unknowns)
    mean, harmonics = equations.force_spectrum(problem, unknowns, program.harmonics)
    logs = jnp.zeros((0, *mean.shape), dtype=complex)
    if program.multipliers:
        logs = log_multipliers_along(*equations.linearised_in_tau(problem, unknowns))
    outcome = jnp.where(fast.converged, int(Outcome.CONVERGED), int(Outcome.NO_ORBIT))
    return ResponseValues(mean, harmonics.T, logs.T, outcome)


#: Iterations of a linear system: the fewest in a round, as a round of a few may not come closer to
#: the solution, and those in addition to the iterations of the orbit, one without modulation.
_FEWEST_STEPS, _MORE_STEPS = 7, 1


class FourierUnknowns(NamedTuple):
    """A Fourier orbit: mean states (points,) and zero-mean parts (nodes, points)."""

    mean: States
    zero_mean: States


class FourierEquations(GridEquations):
    """Orbit equations on a grid; the parameters are (problem, (), steps that the orbit took)."""

    def orbits(
        self, problem: Problem, harmonics: int
    ) -> tuple[FourierUnknowns, tuple[()], Array, Array]:
        """Unknowns, no data of linear systems, estimated error (points,), and steps."""
        orbit = fourier_orbit(problem, nodes=self.nodes, grading=self.grading)
        error = orbit_error(problem.system, self.cycle(problem), orbit, harmonics)
        return FourierUnknowns(orbit.mean, orbit.zero_mean), (), error, orbit.steps

    def steady(self, problem: Problem) -> FourierUnknowns:
        """Steady sliding under the mean load."""
        mean = tuple(problem.system.steady())
        return FourierUnknowns(mean, (jnp.zeros((self.nodes, 1)),) * len(mean))

    def force_spectrum(
        self, problem: Problem, unknowns: FourierUnknowns, harmonics: int
    ) -> tuple[Array, Array]:
        """Mean of F/W0 and its complex harmonics, shape (harmonics, points)."""
        return force_spectrum(problem.system, self.cycle(problem), *unknowns, harmonics)

    def linearised_in_tau(
        self, problem: Problem, unknowns: FourierUnknowns
    ) -> tuple[Matrix, np.ndarray]:
        """Derivatives of the rates per unit of tau, and the integrating matrix of the grid."""
        cycle = self.cycle(problem)
        return per_tau(cycle, self.jacobian(problem, unknowns)), cycle.integral

    def jacobian(self, problem: Problem, unknowns: FourierUnknowns) -> Matrix:
        """Derivatives of the rates on the grid to the states, [i][j] of shape (nodes, points)."""
        return jacobian_on(problem.system, self.cycle(problem), together(*unknowns))

    def prepare(
        self, parameters: tuple[Problem, tuple[()], Array], unknowns: FourierUnknowns
    ) -> tuple[tuple[Matrix, Matrix], Array]:
        """Jacobian and the inverse of its mean; steps."""
        problem, _, steps = parameters
        J = self.jacobian(problem, unknowns)
        inverse = inverse_points(averaged(J, self.cycle(problem).share))
        return (inverse, J), jnp.maximum(steps + _MORE_STEPS, _FEWEST_STEPS)

    def residual(
        self,
        parameters: tuple[Problem, tuple[()], Array],
        unknowns: FourierUnknowns,
        at: tuple[Matrix, Matrix],
    ) -> FourierUnknowns:
        """The unknowns minus the result of one iteration step from them."""
        problem = parameters[0]
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
