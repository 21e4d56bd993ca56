"""The fast methods within a compiled program: orbits without derivatives, then their response.

Derivatives follow from the implicit function theorem. Where R(p, Y) = 0 fixes the unknowns Y as
functions of the parameters p,

    dY = -R_Y^-1 R_p dp.

No iteration of a solver is differentiated. The rule refers to itself, so that derivatives of any
order follow from R; the linear solve has a transpose, so that they do in forward and reverse mode.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
from jax import Array

from asperity._jax import jit_large
from asperity.orbit.floquet import differentiable_log_multipliers
from asperity.orbit.gradient.fourier import (
    FloquetEquations,
    FourierEquations,
    FourierUnknowns,
    floquet_factor,
    means,
)
from asperity.orbit.gradient.parametrised import Parameters, Program, ResponseValues, only_where
from asperity.orbit.methods.fourier.balance import BalanceEquations, balanced_orbit
from asperity.orbit.methods.fourier.method import LARGEST_CONTRACTING_RATE
from asperity.orbit.methods.fourier.orbit import (
    force_spectrum,
    fourier_orbit,
    load_cycle,
    orbit_error,
)
from asperity.orbit.outcome import LARGEST_UNLOADING, SMALLEST_RATE, Outcome
from asperity.orbit.steady_sliding import steady_sliding_of
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem


class Equations(Protocol):
    """Equations R(p, Y) = 0 of many operating points; hashable, without arrays."""

    def residual(self, parameters: Any, unknowns: Any, at: Any) -> Any:
        """R, a pytree like the unknowns, each leaf of which depends on the parameters.

        Parameters
        ----------
        parameters, unknowns : pytree
        at : pytree
            From `prepare`; of no derivative. It may scale and combine the equations.
        """
        ...

    def prepare(self, parameters: Any, unknowns: Any) -> Any:
        """What `residual` and `solve` need at a solution, computed once."""
        ...

    def solve(self, product: Callable[[Any], Any], right: Any, at: Any) -> Any:
        """Solve R_Y y = right, given the product R_Y y as a function of y; NaN where it fails."""
        ...

    def solve_transposed(self, product: Callable[[Any], Any], right: Any, at: Any) -> Any:
        """The same with the transpose of R_Y."""
        ...


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def implicit_solution(equations: Equations, parameters: Any, solution: Any) -> Any:
    """`solution` as a function of the parameters.

    Parameters
    ----------
    equations : Equations
    parameters : pytree of arrays
    solution : pytree of arrays
        Unknowns that solve the equations to round-off; a derivative of theirs does not count.

    Returns
    -------
    pytree
        `solution`, with the derivatives of all orders to `parameters`.
    """
    return solution


@implicit_solution.defjvp
def _implicit_rule(equations: Equations, primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    parameters, solution = primals
    unknowns = implicit_solution(equations, parameters, solution)
    at = jax.lax.stop_gradient(equations.prepare(parameters, unknowns))
    _, right = jax.jvp(lambda p: equations.residual(p, unknowns, at), (parameters,), (tangents[0],))
    _, product = jax.linearize(lambda Y: equations.residual(parameters, Y, at), unknowns)
    moved = jax.lax.custom_linear_solve(
        product,
        jax.tree.map(lambda a: -a, right),
        solve=lambda multiply, b: equations.solve(multiply, b, at),
        transpose_solve=lambda multiply, b: equations.solve_transposed(multiply, b, at),
    )
    return unknowns, moved


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
        Of the equations of the method.
    floquet : pytree or None
        Of those of the Floquet factor, where multipliers are wanted.
    prepared : tuple
        Data of the linear systems of the derivatives.
    valid, converged : bool array, shape (points,)
        Whether the parameters obey their rules, and whether the orbit converged and is resolved.
    """

    unknowns: Any
    floquet: Any
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
    floquet, more_steps = None, jnp.zeros_like(orbit.steps)
    if program.multipliers:
        J = _stretched(FourierEquations(_NODES, _GRADING), problem, unknowns)
        floquet, converged, more_steps = floquet_factor(_NODES, J, _MOST_STEPS)
        good &= converged
        floquet = jax.tree.map(lambda a: jnp.where(good, a, 0.0), floquet)
    # Other points get states with finite equations, so that no NaN reaches a good point.
    steady = system.steady()
    mean = tuple(jnp.where(good, a, s) for a, s in zip(orbit.mean, steady, strict=True))
    zero_mean = tuple(jnp.where(good, a, 0.0) for a in orbit.zero_mean)
    return FastOrbits(
        FourierUnknowns(mean, zero_mean), floquet, (orbit.steps, more_steps), valid, good
    )


def _fourier_values(
    problem: Problem, fast: FastOrbits, program: Program
) -> tuple[Array, Array, Array]:
    equations = FourierEquations(_NODES, _GRADING)
    unknowns = implicit_solution(equations, (problem, fast.prepared[0]), fast.unknowns)
    mean, harmonics = force_spectrum(
        problem.system,
        equations.cycle(problem),
        unknowns.mean,
        unknowns.zero_mean,
        program.harmonics,
    )
    logs = jnp.zeros((0, *mean.shape), dtype=complex)
    if program.multipliers:
        J = _stretched(equations, problem, unknowns)
        floquet = FloquetEquations(_NODES)
        q = implicit_solution(floquet, (J, fast.prepared[1]), fast.floquet)
        exponent = jnp.stack([jnp.stack(row) for row in means(floquet.product(J, q))])
        logs = differentiable_log_multipliers(2 * jnp.pi * exponent)
    return mean, harmonics, logs


def _stretched(equations: FourierEquations, problem: Problem, unknowns: FourierUnknowns) -> Any:
    """Derivatives of the rates per unit of tau."""
    stretch = equations.cycle(problem).stretch[:, None]
    return [[stretch * entry for entry in row] for row in equations.jacobian(problem, unknowns)]


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
    return FastOrbits(unknowns, None, (prepared, orbit.steps), valid, good)


def _balanced_values(
    problem: Problem, fast: FastOrbits, program: Program
) -> tuple[Array, Array, Array]:
    equations = _balance(program)
    unknowns = implicit_solution(equations, (problem, *fast.prepared), fast.unknowns)
    mean, harmonics = equations.force_spectrum(problem, unknowns, program.harmonics)
    return mean, harmonics, jnp.zeros((0, *mean.shape), dtype=complex)
