"""Resolution of Floquet multipliers: transfer maps are refined until they agree."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.algebra.small_systems import scaled_product
from asperity.orbit.batches import Indices, mesh_chunk, run_chunks
from asperity.orbit.floquet import LARGEST_LOG, from_logs, log_multipliers
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.reading import (
    VANISHING_GROWTH,
    piece_map,
    read_orbit,
    split_observables,
)
from asperity.orbit.observables import Observables
from asperity.orbit.outcome import Outcome
from asperity.orbit.solution import Solution
from asperity.slider.problem import Problem

#: Agreement between two meshes, relative, at which the finer one is trusted to 1e-8: with three
#: times the intervals the error is smaller by 3^4 for a stiff orbit, by 3^8 otherwise.
AGREEMENT = 2e-7

#: Each interval is divided into 3, 9, 27... parts for finer transfer maps, up to these total
#: numbers: with all maps in memory, and with one interval at a time.
_MOST_AT_ONCE, _MOST_INTERVALS = 35_000, 40_000_000
#: Largest number of intervals of all points for work on whole chunks of points (some 200 MB).
_MOST_SIDE_BY_SIDE = 100_000

#: Multipliers below this modulus are compared absolutely, because no experiment can measure them:
#: for two multipliers, whose product Liouville's formula gives, and for more, where round-off of
#: the large ones hides the small ones.
_VANISHING = (1e-12, 1e-6)
_LOST_IN_ROUND_OFF = 1e-7

#: Mean logarithm of the multipliers, exact by Liouville's formula, above which the largest
#: multiplier overflows a double, and above which no mesh resolves the other ones.
_OVERFLOW, _HOPELESS = 750.0, 5000.0


def extreme_multipliers(
    observables: Observables, logs: NDArray[np.complex128]
) -> NDArray[np.bool_]:
    """Points whose multipliers are beyond doubles and need no mesh; their `logs` are corrected.

    Returns
    -------
    bool array, shape (points,)
    """
    vanishing = observables.growth < VANISHING_GROWTH
    overflowing = ~vanishing & (observables.log_determinant > _HOPELESS * len(logs))
    for k in np.flatnonzero(vanishing):
        logs[:, k] = _frozen_logs(observables, k)
    for k in np.flatnonzero(overflowing):
        logs[:, k] = _overflowing_logs(len(logs), observables.log_determinant[k])
    return np.asarray(vanishing | overflowing)


def resolve_multipliers(problem: Problem, solution: Solution, orbit: Orbit, index: Indices) -> None:
    """Resolve the multipliers of resolved orbits on finer and finer transfer maps."""
    if len(index):
        _resolve_by_splitting(problem, solution, orbit, index)
        index = index[~solution.converged[index]]
        _resolve_interval_by_interval(problem, solution, orbit, index)


def _resolve_by_splitting(
    problem: Problem, solution: Solution, orbit: Orbit, index: Indices
) -> None:
    """Resolve multipliers with the maps of all intervals in memory, as long as these fit."""
    intervals = orbit.mesh.shape[0] - 1
    splits = [3**k for k in range(1, 10) if intervals * 3**k <= _MOST_AT_ONCE]
    for parts in splits:
        solve = partial(split_observables, parts=parts)
        most = _MOST_SIDE_BY_SIDE // (intervals * parts)
        chunk = tuple(k for k in mesh_chunk(problem.system.size) if k <= most) or 1
        for part, observables in run_chunks(solve, (problem, orbit), index, chunk):
            logs = observables.log_multipliers
            gap = _compare_with_coarser(solution, part, logs)
            over = np.flatnonzero(
                (gap > AGREEMENT) & (observables.log_determinant > _OVERFLOW * len(logs))
            )
            if parts == splits[-1] and len(over):
                solution.log_multipliers[:, part[over]] = _overflowing_logs(
                    len(logs), observables.log_determinant[over]
                )
                solution.outcome[part[over]] = Outcome.CONVERGED
        index = index[~solution.converged[index]]
        if not len(index):
            return


def _resolve_interval_by_interval(
    problem: Problem, solution: Solution, orbit: Orbit, index: Indices
) -> None:
    """Resolve multipliers with the transfer map of one interval at a time in memory.

    For slow modulation, under which a disturbance turns or grows by many thousand radians or
    factors of e in a period, and yet is about as large at its end as in the beginning.
    """
    intervals = orbit.mesh.shape[0] - 1
    parts = next(3**k for k in range(20) if intervals * 3**k > _MOST_AT_ONCE)
    while len(index) and intervals * parts <= _MOST_INTERVALS:
        solve = partial(_monodromy_by_intervals, parts=parts)
        for part, monodromy in run_chunks(solve, (problem, orbit), index, 1):
            _compare_with_coarser(solution, part, log_multipliers(*monodromy))
        index = index[~solution.converged[index]]
        parts *= 3


def _compare_with_coarser(
    solution: Solution, rows: Indices, logs: NDArray[np.complex128]
) -> NDArray[np.float64]:
    """Replace the multipliers of coarser maps; returns their relative change."""
    before = solution.log_multipliers[:, rows]
    gap = np.array([multiplier_gap(before[:, k], logs[:, k]) for k in range(len(rows))])
    solution.log_multipliers[:, rows], solution.detail[rows] = logs, gap
    solution.outcome[rows[gap <= AGREEMENT]] = Outcome.CONVERGED
    return gap


def _monodromy_by_intervals(
    problem: Problem, orbit: Orbit, *, parts: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Monodromy matrix, logarithm of its scale, and logarithm of the determinant."""
    maps, log_scales = [], []
    for k in range(orbit.mesh.shape[0] - 1):
        step, log_step = piece_map(problem, orbit.piece(k, k + 1), parts)
        maps.append(step)
        log_scales.append(log_step)
    # Maps that miss growth within a part may give no finite product; then no two meshes agree.
    with np.errstate(all="ignore"):
        whole, log_scale = scaled_product(np.stack(maps, axis=2))
    observables = read_orbit(problem, orbit, 1)
    return whole, log_scale + np.sum(log_scales, axis=0), observables.log_determinant


def _overflowing_logs(size: int, log_determinant: Any) -> NDArray[np.complex128]:
    """A lower bound for the largest multiplier, infinite as a double; the others are not known."""
    logs = np.full((size, *np.shape(log_determinant)), complex(np.nan, np.nan))
    logs.real[0] = log_determinant / size
    return logs


def _frozen_logs(observables: Observables, k: int) -> NDArray[np.complex128]:
    """Logarithms from the eigenvalues of the Jacobian, integrated along the orbit.

    A rough estimate, which is enough for multipliers that are 0 as doubles.
    """
    growth, determinant = observables.growth[k], observables.log_determinant[k]
    size = observables.monodromy.shape[0]
    rest = (determinant - growth) / max(size - 1, 1)
    return np.array([growth] + [min(growth, rest)] * (size - 1), dtype=complex)


def multiplier_gap(before: NDArray[np.complex128], now: NDArray[np.complex128]) -> float:
    """Largest change of multipliers between two meshes, relative to them or to the floor below."""
    if not (np.all(np.isfinite(before)) and np.all(np.isfinite(now))):
        return np.inf
    old, new = from_logs(before), from_logs(now)
    # Beyond doubles the logarithms are compared, the multipliers elsewhere.
    huge = now.real > LARGEST_LOG
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        several = len(new) > 2
        largest = np.minimum(np.abs(new).max(initial=0.0), np.exp(LARGEST_LOG))
        floor = max(_VANISHING[several], several * _LOST_IN_ROUND_OFF * largest)
        gaps = np.abs(old - new) / np.maximum(np.abs(new), floor)
        turned = np.abs(np.exp(1j * (before.imag - now.imag)) - 1)
        changes = np.abs(before.real - now.real) / np.abs(now.real)
        gaps = np.where(huge, np.maximum(changes, turned), gaps)
    return float(np.max(gaps, initial=0.0))
