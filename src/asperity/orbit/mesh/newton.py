"""Newton's method on whole orbits, along a line of parameters or at fixed parameters.

The unknowns are an orbit X and the coordinate t of a line of parameters. Newton's step is condensed
interval by interval to a transfer map and the maps are tied into a cycle by
`asperity.algebra.cyclic`, together with one more equation

    <row, dX> + corner dt = value:

of a plane across a branch of orbits for continuation, or dt = 0 where the parameters are fixed.
The method does not depend on the stability of the orbit, nor on fast and slow directions.

The exponent of the slip rate changes by tens of units within a period, so the step is shortened
until no exponent and no logarithmic state changes by more than a few units.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.algebra.cyclic import Border, solve_bordered
from asperity.arrays import Bool, Float
from asperity.orbit.batches import FEW, put, run_chunks
from asperity.orbit.mesh.equations import (
    CondensedEquations,
    collocated,
    condensed,
    transfer_maps,
)
from asperity.orbit.mesh.mesh import Orbit, equidistributed
from asperity.slider.motion import Motion
from asperity.slider.pointwise import PointValues, excitation_at
from asperity.slider.problem import Problem

T = TypeVar("T")

#: Newton's method ends at this change; the error is then about the square of the change.
TOLERANCE = 1e-8
#: A last change below this counts as converged.
ACCEPTED = 1e-6
#: Bound on the change of an exponent or logarithmic state in one step: the slip rate then changes
#: by at most e^2.
_LARGEST_CHANGE = 2.0


class Plane(NamedTuple):
    """The equation <row, dX> + corner dt = 0 on the changes of the nodes and of t.

    Attributes
    ----------
    row : array, shape (n, intervals, points)
    corner : array, shape (points,)
    """

    row: Float
    corner: Float

    @classmethod
    def of_fixed_parameters(cls, orbit: Orbit) -> Plane:
        """The equation dt = 0."""
        return cls(np.zeros_like(orbit.nodes), np.ones(orbit.nodes.shape[-1]))


class Change(NamedTuple):
    """Changes of nodes (n, intervals, points), slopes (n, STAGES, intervals, points) and t."""

    nodes: Array
    slopes: Array
    t: Array


class NewtonStep(NamedTuple):
    """A step and its size.

    Attributes
    ----------
    change : Change
    largest : array, shape (points,)
        Largest change of the slip exponent and of a logarithmic state at the collocation points.
    error : array, shape (points,)
        The largest of `largest`, the change of t, and changes of forces and velocities relative to
        their ranges over the period.
    """

    change: Change
    largest: Array
    error: Array


class NewtonResult(NamedTuple):
    """Result of Newton's method.

    Attributes
    ----------
    orbit : Orbit
    t : array, shape (points,)
    error : array, shape (points,)
        Size of the last step; inf where it was not finite.
    steps : int array, shape (points,)
    """

    orbit: Orbit
    t: Float
    error: Float
    steps: NDArray[np.int_]


@jit_large
def _step(
    response: Array,
    constant: Array,
    slip_gradient: Array,
    orbit: tuple[Array, Array, Array],
    plane: Plane,
    value: Array,
    coefficients: tuple[Array, Array],
    logarithms: Array,
    least_swing: Array,
) -> NewtonStep:
    """Solve the linearised equations; `orbit` is (widths, nodes, slopes)."""
    widths, nodes, slopes = orbit
    a, b = coefficients
    defect = constant[:, :, 0]
    # Without a direction of the parameters the equations do not depend on t.
    column = constant[:, :, 1] if constant.shape[2] > 1 else jnp.zeros_like(defect)
    gain = widths * jnp.einsum("k,nkmb->nmb", b, column)
    gap = jnp.roll(nodes, -1, axis=1) - nodes
    rise = widths * jnp.einsum("k,nkmb->nmb", b, slopes + defect) - gap
    border = Border(gain, plane.row, plane.corner, value)
    moved, t = solve_bordered(transfer_maps(response, widths, b), rise, border)
    bent = jnp.einsum("nkcmb,cmb->nkmb", response, moved) + defect + column * t
    stages = moved[:, None] + widths * jnp.einsum("jk,nkmb->njmb", a, bent)
    exponent = jnp.abs((slip_gradient * stages).sum(0)).max((0, 1))
    each = jnp.abs(stages).max((1, 2))
    mask = logarithms[:, None]
    largest = jnp.maximum(exponent, jnp.where(mask, each, 0.0).max(0))
    # `least_swing` keeps the relative change above round-off where a state hardly changes.
    after = nodes + moved
    swing = jnp.abs(after - after[:, :1]).max(1) + least_swing
    relative = jnp.abs(stages - stages[:, :1, :1]).max((1, 2)) / swing
    error = jnp.maximum(largest, jnp.where(mask, 0.0, relative).max(0))
    return NewtonStep(Change(moved, bent, t), largest, jnp.maximum(error, jnp.abs(t)))


def newton_step(
    system: Motion,
    equations: CondensedEquations,
    orbit: Orbit,
    plane: Plane,
    value: float = 0.0,
    *,
    closed: bool = True,
) -> NewtonStep:
    """A Newton step, which the caller applies.

    Parameters
    ----------
    system : Motion
    equations : CondensedEquations
    orbit : Orbit
    plane : Plane
    value : float
        Distance of the new point from the plane.
    closed : bool
        Whether the step reduces the residual of the equations. If not, it solves the homogeneous
        linear equations: the tangent of a branch.
    """
    nodes, slopes = (orbit.nodes, orbit.slopes) if closed else (0 * orbit.nodes, 0 * orbit.slopes)
    points = nodes.shape[-1]
    step = _step(
        equations.response,
        equations.constant,
        equations.values.slip_gradient,
        (orbit.widths, nodes, slopes),
        plane,
        np.full(points, value),
        (np.asarray(orbit.scheme.a), np.asarray(orbit.scheme.b)),
        system.logarithms,
        least_swing(system, points),
    )
    return jax.tree.map(np.asarray, step)


def least_swing(system: Motion, points: int) -> Float:
    """Lower bound for the range of a force or velocity in relative errors, shape (points,)."""
    return np.broadcast_to(1e-4 * np.minimum(np.asarray(system.kappa), 1.0), (points,))


def moved(orbit: Orbit, t: Float, change: Change, length: Float) -> tuple[Orbit, Float]:
    """The orbit and the coordinate changed by `length`, (points,), times `change`."""
    nodes = orbit.nodes + length * change.nodes
    centre = orbit.centre + nodes[:, 0]
    slopes = orbit.slopes + length * change.slopes
    return orbit._replace(centre=centre, nodes=nodes - nodes[:, :1], slopes=slopes), (
        t + length * change.t
    )


def solve_in_plane(
    line: Callable[[Float], tuple[Problem, Problem | None]],
    guess: Orbit,
    t: Float,
    plane: Plane,
    *,
    max_steps: int,
    tolerance: float = TOLERANCE,
    few: int = 0,
    patience: float = math.inf,
) -> NewtonResult:
    """Newton's method on the plane through a guess.

    Parameters
    ----------
    line : callable
        Parameters at the coordinate t, and their derivative or None.
    guess : Orbit
    t : array, shape (points,)
    plane : Plane
    max_steps : int
    tolerance : float
        Bound on `NewtonStep.error` of the last step.
    few : int
        Number of points that may be left unfinished.
    patience : float
        Steps without a smaller change than before, after which a point counts as failed.
    """
    orbit, t = guess, np.array(t, float)
    problem, direction = line(t)
    at = excitation_at(problem.load, orbit.stage_phases)
    error, steps = np.full(t.shape, np.inf), np.zeros(t.shape, int)
    smallest, waited = error.copy(), steps.copy()
    for _ in range(max_steps):
        active = (error > tolerance) & (waited < patience)
        if active.sum() <= few:
            break
        equations = condensed(problem, orbit, direction, at=at)
        # The guess lies in the plane, and every change keeps it there.
        step = newton_step(problem.system, equations, orbit, plane)
        with np.errstate(invalid="ignore", divide="ignore"):
            shortened = np.minimum(1.0, _LARGEST_CHANGE / step.largest)
        # Converged points are not changed while other points of the chunk iterate.
        change = Change(*(np.where(active, part, 0.0) for part in step.change))
        orbit, t = moved(orbit, t, change, shortened)
        size = np.where(np.isfinite(step.error), step.error, np.inf)
        error, steps = np.where(active, size, error), steps + active
        waited = np.where(error < smallest, 0, waited + 1)
        smallest = np.minimum(error, smallest)
        if direction is not None:
            problem, direction = line(t)
            at = excitation_at(problem.load, orbit.stage_phases)
    return NewtonResult(orbit, t, error, steps)


def solve(
    problem: Problem, guess: Orbit, max_steps: int, patience: float = math.inf
) -> NewtonResult:
    """Newton's method at fixed parameters, NumPy arrays (points,); see `solve_in_plane`."""
    t = np.zeros(guess.nodes.shape[-1])
    few = FEW if len(t) > FEW else 0
    plane = Plane.of_fixed_parameters(guess)
    result = solve_in_plane(
        lambda _: (problem, None), guess, t, plane, max_steps=max_steps, few=few, patience=patience
    )
    # The last few points continue in a smaller chunk, whose steps take less time.
    taken = int(result.steps.max())
    left = np.flatnonzero((result.error > TOLERANCE) & (result.steps == taken))
    if 0 < len(left) <= few and taken < max_steps:
        again = partial(solve, max_steps=max_steps - taken, patience=patience)
        for part, rest in run_chunks(again, (problem, result.orbit), left, FEW):
            put(result, part, rest._replace(steps=rest.steps + taken))
    return result


#: Numbers of intervals.
MESHES = (72, 216, 648, 1944)
FIRST_MESH = MESHES[0]

#: Largest number of attempts: a new mesh, and Newton's method on it.
_ROUNDS = 4
_NEWTON_STEPS = 15


def remeshed(problem: Problem, orbit: Orbit, intervals: int) -> Orbit:
    """The orbit on an equidistributed mesh of `intervals` intervals, NumPy arrays."""
    with np.errstate(all="ignore"):
        scales = _error_scales(problem, orbit, collocated(problem, orbit))
        return equidistributed(orbit, scales, intervals)


def _error_scales(problem: Problem, orbit: Orbit, values: PointValues) -> Float:
    """Weight of each state's error, shape (size, intervals, points): its effect on the slip."""
    system = problem.system
    scales = np.abs(values.slip_gradient).mean(1)
    swing = np.abs(orbit.nodes).max(1) + least_swing(system, orbit.nodes.shape[-1])
    # A force or velocity without influence on slip: errors relative to its range. Errors of
    # logarithmic states count directly, not only by their effect on slip.
    relative = np.where(scales > 0, scales, 1 / swing[:, None])
    return np.where(system.logarithms[:, None, None], np.maximum(scales, 1.0), relative)


def refined_orbit(
    problem: Problem,
    guess: Orbit,
    *,
    intervals: int,
    read: Callable[[Problem, Orbit], T],
    rounds: int = _ROUNDS,
    patience: float = math.inf,
) -> tuple[Orbit, T, Float]:
    """The orbit on an equidistributed mesh of `intervals`, the result of `read`, and the error.

    The error is the size of the last Newton step. Where Newton's method failed, the orbit is the
    guess on the new mesh: for a finer mesh it is a better initial guess than the last iterate.
    """
    first, result = _attempt(problem, guess, intervals, patience)
    mesh, points = jax.tree.map(np.copy, first), len(result.error)
    again = partial(_attempt, intervals=intervals, patience=patience)
    for _ in range(rounds - 1):
        left = np.flatnonzero(result.error >= ACCEPTED)
        # A failed attempt still improves the mesh where the orbit is steep.
        latest = _where(np.isfinite(result.error), result.orbit, mesh)
        for part, attempt in run_chunks(again, (problem, latest), left, (points, FEW)):
            put((mesh, result), part, attempt)
    orbit = _where(result.error < ACCEPTED, result.orbit, first)
    return orbit, read(problem, orbit), result.error


def _attempt(
    problem: Problem, guess: Orbit, intervals: int, patience: float
) -> tuple[Orbit, NewtonResult]:
    """The guess on a new mesh, and the result of Newton's method on that mesh."""
    mesh = remeshed(problem, guess, intervals)
    return mesh, solve(problem, mesh, _NEWTON_STEPS, patience)


def _where(condition: Bool, yes: Orbit, no: Orbit) -> Orbit:
    return jax.tree.map(lambda a, b: np.where(condition, a, b), yes, no)
