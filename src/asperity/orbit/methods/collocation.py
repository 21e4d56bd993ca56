"""The robust method: from the averaged limit, and refinement.

An orbit is solved on finer and finer meshes until two of them agree.
"""

from __future__ import annotations

import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.arrays import Bool, Complex, Float, Index
from asperity.orbit.batches import mesh_chunk, points_of, put, run_chunks, take
from asperity.orbit.floquet import AGREEMENT, multiplier_gap
from asperity.orbit.mesh.equations import VANISHING_GROWTH, read_orbit, split_observables
from asperity.orbit.mesh.mesh import GAUSS, Orbit, graded_mesh, scheme_for
from asperity.orbit.mesh.newton import ACCEPTED, FIRST_MESH, MESHES, refined_orbit, remeshed, solve
from asperity.orbit.observables import Observables, response_gap, waveform
from asperity.orbit.outcome import Outcome
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem
from asperity.theory.limits import averaged_limit

#: As `AGREEMENT`, for two meshes with the same number of intervals.
_CLOSE_AGREEMENT = 1e-8


def refine(
    problem: Problem,
    solution: Solution,
    orbit: Orbit,
    index: Index,
    options: SearchOptions,
) -> None:
    """Refine the orbits of the points `index` and write those that are resolved to `solution`.

    Parameters
    ----------
    problem : Problem
    solution : Solution
        Solution of the points of the problem.
    orbit : Orbit
        Orbits of the problem on the initial mesh.
    index : array of int
        Points that have an orbit.
    options : SearchOptions
    """
    size, points = orbit.centre.shape
    coarse, previous = len(orbit.mesh) - 1, Solution.unsolved(problem, options)
    evaluate = partial(read_orbit, harmonics=options.harmonics)
    for part, initial in run_chunks(evaluate, (problem, orbit), index, mesh_chunk(size)):
        previous.store(part, initial)
    for intervals in (intervals for intervals in MESHES if intervals >= coarse):
        close = intervals == len(orbit.mesh) - 1
        agreement = _CLOSE_AGREEMENT if close else AGREEMENT
        finer = Orbit.empty(orbit.scheme, size, intervals, points)
        solve = partial(refined_orbit, intervals=intervals, read=evaluate)
        resolved = np.zeros(points, dtype=bool)
        for part, (fine, observables, error) in run_chunks(
            solve, (problem, orbit), index, mesh_chunk(size)
        ):
            put(finer, part, fine)
            solution.iterations[part] = intervals
            resolved[part] = _compare(solution, part, previous, observables, error, agreement)
        _store_orbits(problem, solution, finer, index[resolved[index]])
        orbit, index = finer, index[~resolved[index]]
        if not len(index):
            return
    _finish(problem, solution, orbit, index)


def _finish(problem: Problem, solution: Solution, orbit: Orbit, index: Index) -> None:
    """Resolve multipliers, and store the points `index` or discard them, according to `outcome`."""
    stiff = index[solution.outcome[index] == Outcome.MULTIPLIERS_NOT_RESOLVED]
    resolve_multipliers(problem, solution, orbit, stiff)
    converged = solution.converged[index]
    _store_orbits(problem, solution, orbit, index[converged])
    solution.discard(index[~converged])


def _store_orbits(problem: Problem, solution: Solution, orbit: Orbit, rows: Index) -> None:
    """Write waveforms and orbits of the points `rows` to `solution`, if they were requested."""
    chunk = mesh_chunk(problem.system.size)
    phases = solution.waveform.shape[1]
    if phases:
        sample = partial(waveform, phases=phases)
        for part, samples in run_chunks(sample, (problem, orbit), rows, chunk):
            solution.waveform[..., part] = samples
    intervals = len(solution.orbit.mesh) - 1
    if intervals:
        remesh = partial(remeshed, intervals=intervals)
        for part, kept in run_chunks(remesh, (problem, orbit), rows, chunk):
            put(solution.orbit, part, kept)


def accept(problem: Problem, solution: Solution, orbit: Orbit, options: SearchOptions) -> None:
    """Write orbits that need no refinement to `solution`, once their multipliers are resolved.

    Parameters
    ----------
    problem : Problem
    solution : Solution
        Solution of the points of the problem.
    orbit : Orbit
        An orbit for every point.
    options : SearchOptions
    """
    intervals = orbit.mesh.shape[0] - 1
    evaluate = partial(read_orbit, harmonics=options.harmonics)
    chunk = mesh_chunk(problem.system.size)
    points = np.arange(orbit.centre.shape[1])
    for part, observables in run_chunks(evaluate, (problem, orbit), points, chunk):
        logs = observables.log_multipliers
        known = extreme_multipliers(observables, logs)
        solution.store(part, observables, logs)
        solution.iterations[part] = intervals
        solution.outcome[part[~known]] = Outcome.MULTIPLIERS_NOT_RESOLVED
    _finish(problem, solution, orbit, points)


def _compare(
    solution: Solution,
    part: Index,
    previous: Solution,
    observables: Observables,
    error: Float,
    agreement: float,
) -> Bool:
    """Compare each point with its previous mesh; returns a mask of the points that agree."""
    logs = observables.log_multipliers
    known = extreme_multipliers(observables, logs)
    orbit_gap = response_gap(previous.numbers[:, part], observables.numbers)
    changes = multiplier_gap(previous.log_multipliers[:, part], logs)
    solved = error <= ACCEPTED
    resolved = solved & (orbit_gap <= agreement)
    agreed = resolved & (known | (changes <= agreement))
    outcome = np.where(resolved, int(Outcome.MULTIPLIERS_NOT_RESOLVED), int(Outcome.NOT_RESOLVED))
    outcome[agreed] = Outcome.CONVERGED
    detail = np.where(resolved, changes, np.where(solved, orbit_gap, np.inf))
    for rows, target in ((solved, previous), (resolved, solution)):
        kept = np.flatnonzero(rows)
        target.store(part[kept], take(observables, kept), logs[:, kept])
    solution.outcome[part], solution.detail[part] = outcome, detail
    return agreed


def refined_where_resolved(
    problem: Problem, options: SearchOptions, orbit: Orbit, index: Index
) -> Solution:
    """The solution of a problem by `refine`; an orbit that is not resolved may not exist.

    Such a point is left to other methods.
    """
    solution = Solution.unsolved(problem, options)
    refine(problem, solution, orbit, index, options)
    doubtful = solution.outcome == Outcome.NOT_RESOLVED
    solution.outcome[doubtful], solution.detail[doubtful] = Outcome.NO_ORBIT, 0.0
    options.progress(int(solution.converged.sum()))
    return solution


class Collocation(Method):
    """Collocation with Newton's method on the whole orbit."""

    name = "collocation"
    choice = "collocation"

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`."""
        solution = Solution.unsolved(problem, options)
        points = np.arange(len(solution.outcome))
        orbit, solved = orbits_from_averaged_limit(problem, points)
        refine(problem, solution, orbit, solved, options)
        options.progress(int(solution.converged.sum()))
        return solution


#: Grading of the first mesh towards the weakest contact, and Newton steps on it.
_GRADING, _NEWTON_STEPS = 0.5, 30


def orbits_from_averaged_limit(
    problem: Problem, index: Index, patience: float = math.inf
) -> tuple[Orbit, Index]:
    """Orbits by Newton's method from the averaged limit.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    index : array of int
        Points to work on.
    patience : float
        Patience of Newton's method, see `asperity.orbit.mesh.newton.solve_in_plane`.

    Returns
    -------
    Orbit
        Of all points, on `FIRST_MESH` intervals.
    array of int
        The points at which Newton's method converged.
    """
    system, solved = problem.system, [index[:0]]
    orbit = Orbit.empty(scheme_for(system), system.size, FIRST_MESH, len(system.V))
    begin = partial(_first_orbit, patience=patience)
    for part, (first, error) in run_chunks(begin, (problem,), index, mesh_chunk(system.size)):
        good = error < ACCEPTED
        put(orbit, part[good], take(first, np.flatnonzero(good)))
        solved.append(part[good])
    return orbit, np.concatenate(solved)


def _first_orbit(problem: Problem, patience: float) -> tuple[Orbit, Float]:
    """Collocation from the averaged limit, with an error for each point.

    The averaged limit is that of the quasi-static equations, whose orbit is the initial guess for
    the equations with inertia.
    """
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    centre = np.asarray(_averaged_states(Problem(quasi_static, load)))
    size, points = centre.shape
    bare = Orbit.empty(GAUSS, size, FIRST_MESH, points)
    mesh = graded_mesh(FIRST_MESH, points, _GRADING)
    guess = bare._replace(mesh=mesh, centre=centre)
    result = solve(Problem(quasi_static, load), guess, _NEWTON_STEPS, patience)
    if not isinstance(system, QuasiStatic):
        result = solve(problem, inertial_guess(problem, result.orbit), _NEWTON_STEPS, patience)
    return result.orbit, result.error


@jit_large
def _averaged_states(sliding: Problem) -> Array:
    """The averaged limit, (size, points), from samples of the load at the collocation points."""
    points = points_of(sliding)
    mesh = graded_mesh(FIRST_MESH, 1, _GRADING)
    widths = np.diff(mesh, axis=0)
    theta = mesh[:-1] + GAUSS.c[:, None, None] * widths
    weights = (GAUSS.b[:, None, None] * widths).ravel() / (2 * np.pi)
    at = sliding.load.at(theta.reshape(-1, 1) * jnp.ones(points))
    samples = jax.tree.map(lambda a: a.reshape(-1, points) if jnp.ndim(a) else a, at)
    return jnp.stack(averaged_limit(sliding.system, samples, weights).centre)


@jit_large
def _converted(problem: Problem, states: Array, slopes: Array, theta: Array) -> tuple[Array, Array]:
    """States of the problem from quasi-static states, (size, ..., points), and their slopes."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)

    def convert(Y: Array, theta: Array) -> Array:
        at = load.at(theta)
        mechanical = system.mechanical_states(
            quasi_static.friction(Y, at),
            quasi_static.slider_velocity(Y, at),
            quasi_static.log_slip(Y, at),
            at,
        )
        return jnp.stack([*mechanical, *quasi_static.law_state(Y)])

    return jax.jvp(convert, (states, theta), (slopes, jnp.ones_like(theta)))


def inertial_guess(problem: Problem, orbit: Orbit) -> Orbit:
    """A quasi-static orbit as a first guess of another equation of motion, NumPy arrays."""
    theta = np.concatenate([orbit.mesh[None, :-1], orbit.stage_phases])
    left = orbit.centre[:, None] + orbit.nodes
    sliding = np.concatenate([left[:, None], orbit.stage_states], axis=1)
    # Slopes at the nodes have no influence.
    slopes = np.concatenate([np.zeros_like(left)[:, None], orbit.slopes], axis=1)
    states, slopes = map(np.asarray, _converted(problem, sliding, slopes, theta))
    nodes = states[:, 0]
    # An interface that sticks has no finite logarithm of its slip rate.
    with np.errstate(invalid="ignore"):
        deviations = nodes - nodes[:, :1]
    scheme = scheme_for(problem.system)
    return Orbit(orbit.mesh, nodes[:, 0], deviations, slopes[:, 1:], scheme)


#: Each interval is divided into 3, 9, 27... parts for finer transfer maps, up to this total number.
_MOST_INTERVALS = 35_000
#: Largest number of intervals of all points of a chunk (some 200 MB).
_MOST_IN_CHUNK = 100_000

#: Mean logarithm of the multipliers, exact by Liouville's formula, above which the largest
#: multiplier overflows a double, and above which no mesh resolves the other ones.
_OVERFLOW, _HOPELESS = 750.0, 5000.0


def extreme_multipliers(observables: Observables, logs: Complex) -> Bool:
    """Points with multipliers outside the range of doubles, for which no finer mesh is needed.

    The function replaces the `logs` of these points by the values that are known.

    Returns
    -------
    bool array, shape (points,)
    """
    growth, determinant, size = observables.growth, observables.log_determinant, len(logs)
    vanishing = growth < VANISHING_GROWTH
    overflowing = ~vanishing & (determinant > _HOPELESS * size)
    # A rough estimate of multipliers that are 0 as doubles: the eigenvalues of the Jacobian,
    # integrated along the orbit.
    others = np.minimum(growth, (determinant - growth) / max(size - 1, 1))
    logs[:, vanishing] = np.stack([growth, *[others] * (size - 1)])[:, vanishing]
    logs[:, overflowing] = _overflowing_logs(size, determinant[overflowing])
    return np.asarray(vanishing | overflowing)


def resolve_multipliers(problem: Problem, solution: Solution, orbit: Orbit, index: Index) -> None:
    """Resolve the multipliers of resolved orbits on finer and finer transfer maps."""
    intervals = orbit.mesh.shape[0] - 1
    splits = [3**k for k in range(1, 10) if intervals * 3**k <= _MOST_INTERVALS]
    for parts in splits:
        solve = partial(split_observables, parts=parts)
        most = _MOST_IN_CHUNK // (intervals * parts)
        chunk = tuple(k for k in mesh_chunk(problem.system.size) if k <= most) or 1
        for part, observables in run_chunks(solve, (problem, orbit), index, chunk):
            logs = observables.log_multipliers
            gap = multiplier_gap(solution.log_multipliers[:, part], logs)
            agreed, determinant = gap <= AGREEMENT, observables.log_determinant
            over = ~agreed & (determinant > _OVERFLOW * len(logs)) & (parts == splits[-1])
            logs[:, over] = _overflowing_logs(len(logs), determinant[over])
            solution.log_multipliers[:, part], solution.detail[part] = logs, gap
            solution.outcome[part[agreed | over]] = Outcome.CONVERGED
        index = index[~solution.converged[index]]
        if not len(index):
            return


def _overflowing_logs(size: int, log_determinant: Float) -> Complex:
    """A lower bound for the largest multiplier, infinite as a double; the others are not known."""
    logs = np.full((size, len(log_determinant)), complex(np.nan, np.nan))
    logs.real[0] = log_determinant / size
    return logs
