"""The robust method: from the averaged limit, and refinement.

An orbit is solved on finer and finer meshes until two of them agree.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, mesh_chunk, put, run_chunks, take
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import ACCEPTED
from asperity.orbit.mesh.reading import read_orbit
from asperity.orbit.mesh.remeshing import MESHES, refined_orbit, remeshed
from asperity.orbit.methods.collocation.initial_guess import (
    InitialGuess,
    orbits_from_averaged_limit,
)
from asperity.orbit.methods.method import Method
from asperity.orbit.multipliers import (
    AGREEMENT,
    extreme_multipliers,
    multiplier_gap,
    resolve_multipliers,
)
from asperity.orbit.observables import Observables, waveform
from asperity.orbit.outcome import Outcome
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem

#: As `AGREEMENT`, for two meshes with the same number of intervals.
_CLOSE_AGREEMENT = 1e-8


class _Compared(NamedTuple):
    """Observables by which two meshes are compared."""

    mean: float
    harmonics: NDArray[np.complex128]
    logs: NDArray[np.complex128]


def refine(
    problem: Problem,
    solution: Solution,
    orbit: Orbit,
    index: Indices,
    options: SearchOptions,
    meshes: tuple[int, ...] = MESHES,
) -> None:
    """Refine the orbits of the points `index` and write those that are resolved to `solution`.

    Parameters
    ----------
    problem : Problem
    solution : Solution
        Of the points of the problem.
    orbit : Orbit
        Orbits of the problem on the initial mesh.
    index : array of int
        Points that have an orbit.
    options : SearchOptions
    meshes : tuple of int
        Numbers of intervals.
    """
    size, points = orbit.centre.shape
    previous = _initial_observables(problem, orbit, index, options)
    for intervals in meshes:
        close = intervals == len(orbit.mesh) - 1
        agreement = _CLOSE_AGREEMENT if close else AGREEMENT
        finer = Orbit.empty(orbit.scheme, size, intervals, points)
        solve = partial(refined_orbit, intervals=intervals, harmonics=options.harmonics)
        resolved = np.zeros(points, dtype=bool)
        for part, (fine, observables, error) in run_chunks(
            solve, (problem, orbit), index, mesh_chunk(size)
        ):
            put(finer, part, fine)
            solution.iterations[part] = intervals
            resolved[part] = _compare(solution, part, previous, observables, error, agreement)
        _keep(problem, solution, finer, index[resolved[index]])
        orbit, index = finer, index[~resolved[index]]
        if not len(index):
            return
    stiff = index[solution.outcome[index] == Outcome.MULTIPLIERS_NOT_RESOLVED]
    resolve_multipliers(problem, solution, orbit, stiff)
    _keep(problem, solution, orbit, stiff[solution.converged[stiff]])
    solution.discard(index[~solution.converged[index]])


def _keep(problem: Problem, solution: Solution, orbit: Orbit, rows: Indices) -> None:
    """Write waveforms and orbits of the points `rows` to `solution`, which may have room."""
    phases = solution.waveform.shape[1]
    if phases:
        chunk = mesh_chunk(problem.system.size)
        sample = partial(waveform, phases=phases)
        for part, samples in run_chunks(sample, (problem, orbit), rows, chunk):
            solution.waveform[..., part] = samples
    intervals = len(solution.orbit.mesh) - 1
    if intervals:
        remesh = partial(remeshed, intervals=intervals)
        chunk = mesh_chunk(problem.system.size)
        for part, kept in run_chunks(remesh, (problem, orbit), rows, chunk):
            put(solution.orbit, part, kept)


def accept(problem: Problem, solution: Solution, orbit: Orbit, options: SearchOptions) -> None:
    """Write orbits that are exact already to `solution`, once their multipliers are resolved.

    Parameters
    ----------
    problem : Problem
    solution : Solution
        Of the points of the problem.
    orbit : Orbit
        An orbit for every point.
    options : SearchOptions
    """
    intervals = orbit.mesh.shape[0] - 1
    evaluate = partial(read_orbit, harmonics=options.harmonics)
    chunk = mesh_chunk(problem.system.size)
    points = np.arange(orbit.centre.shape[1])
    stiff = []
    for part, observables in run_chunks(evaluate, (problem, orbit), points, chunk):
        logs = observables.log_multipliers
        known = extreme_multipliers(observables, logs)
        solution.store(part, observables, logs)
        solution.iterations[part] = intervals
        stiff.append(part[~known])
    index = np.concatenate(stiff)
    solution.outcome[index] = Outcome.MULTIPLIERS_NOT_RESOLVED
    resolve_multipliers(problem, solution, orbit, index)
    _keep(problem, solution, orbit, np.flatnonzero(solution.converged))
    solution.discard(np.flatnonzero(~solution.converged))


def _initial_observables(
    problem: Problem, orbit: Orbit, index: Indices, options: SearchOptions
) -> dict[int, _Compared]:
    """Observables on the initial mesh."""
    initial: dict[int, _Compared] = {}
    evaluate = partial(read_orbit, harmonics=options.harmonics)
    chunk = mesh_chunk(problem.system.size)
    for part, observables in run_chunks(evaluate, (problem, orbit), index, chunk):
        initial.update(zip(part, _rows(observables, observables.log_multipliers), strict=True))
    return initial


def _rows(observables: Observables, logs: NDArray[np.complex128]) -> list[_Compared]:
    return [
        _Compared(observables.mean_friction[k], observables.harmonics[:, k], logs[:, k])
        for k in range(logs.shape[1])
    ]


def _compare(
    solution: Solution,
    part: Indices,
    previous: dict[int, _Compared],
    observables: Observables,
    error: NDArray[np.float64],
    agreement: float,
) -> NDArray[np.bool_]:
    """Compare each point with its previous mesh; returns a mask of the points that agree."""
    logs = observables.log_multipliers
    known = extreme_multipliers(observables, logs)
    for k, (point, now) in enumerate(zip(part, _rows(observables, logs), strict=True)):
        if error[k] > ACCEPTED:
            solution.outcome[point], solution.detail[point] = Outcome.NOT_RESOLVED, np.inf
            continue
        before, previous[point] = previous.get(point), now
        orbit_gap, multiplier_change = _gaps(before, now)
        if orbit_gap > agreement:
            solution.outcome[point], solution.detail[point] = Outcome.NOT_RESOLVED, orbit_gap
        elif multiplier_change > agreement and not known[k]:
            solution.outcome[point] = Outcome.MULTIPLIERS_NOT_RESOLVED
            solution.detail[point] = multiplier_change
        else:
            solution.outcome[point] = Outcome.CONVERGED
    # Only the multipliers are computed again where mean and harmonics are resolved already.
    outcome = solution.outcome[part]
    written = np.isin(outcome, (Outcome.CONVERGED, Outcome.MULTIPLIERS_NOT_RESOLVED))
    kept = np.flatnonzero(written)
    solution.store(part[kept], take(observables, kept), logs[:, kept])
    solution.outcome[part] = outcome
    return outcome == Outcome.CONVERGED


def _gaps(before: _Compared | None, now: _Compared) -> tuple[float, float]:
    """Relative change of mean and harmonics, and of multipliers, between two meshes."""
    if before is None or not all(np.all(np.isfinite(a)) for a in now[:2]):
        return np.inf, np.inf
    mean = abs(now.mean - before.mean) / abs(now.mean)
    # Harmonics that vanish relative to the first, or to the mean, are compared up to round-off.
    floor = (1e-14 * abs(now.harmonics[0]) + 1e-17 * abs(now.mean)) / AGREEMENT
    scale = np.abs(now.harmonics) + floor
    # Harmonics beyond the second are compared relative to the first.
    scale[2:] = np.abs(now.harmonics[0]) + floor
    harmonics = np.abs(now.harmonics - before.harmonics) / scale
    return float(max(mean, harmonics.max())), multiplier_gap(before.logs, now.logs)


class Collocation(Method):
    """Collocation with Newton's method on the whole orbit."""

    name = "collocation"
    choice = "collocation"

    def suits(self, problem: Problem) -> bool:
        """Any equations and load."""
        return True

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`."""
        solution = Solution.unsolved(problem, problem.system.V.shape[-1], options)
        guess = orbits_from_averaged_limit(problem, len(solution.outcome))
        solve_from(problem, solution, guess, options)
        options.progress(int(solution.converged.sum()))
        return solution


def solve_from(
    problem: Problem, solution: Solution, guess: InitialGuess, options: SearchOptions
) -> None:
    """Refine the orbits of a guess and take over its outcomes of the points without one.

    Parameters
    ----------
    problem : Problem
    solution : Solution
        Of the points of the problem; overwritten where `guess` has an outcome.
    guess : InitialGuess
    options : SearchOptions
    """
    informed = guess.solved | (guess.detail > 0)
    solution.outcome[informed] = guess.outcome[informed]
    solution.detail[informed] = guess.detail[informed]
    index = np.flatnonzero(guess.solved)
    if len(index):
        coarse = guess.orbit.mesh.shape[0] - 1
        meshes = tuple(intervals for intervals in MESHES if intervals >= coarse)
        refine(problem, solution, guess.orbit, index, options, meshes)
