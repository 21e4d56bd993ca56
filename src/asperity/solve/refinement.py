"""Trust in an orbit: it is solved on finer and finer meshes until two of them agree."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, put, run_chunks, take
from asperity.solve.floquet import LARGEST_LOG, from_logs
from asperity.solve.found import Found, Options, logs_of, store
from asperity.solve.kernels import (
    ACCEPTED,
    Problem,
    Reading,
    read_orbit,
    refine_orbit,
    split_reading,
)
from asperity.solve.mesh import Orbit
from asperity.solve.outcome import Outcome

#: Agreement between two meshes, relative, at which the finer one is trusted to 1e-8: with three
#: times the intervals its own error is smaller by 3^4 for a stiff orbit, by 3^8 otherwise.
AGREEMENT = 2e-7

#: Intervals of the mesh that orbits are followed on, and of those that they are refined on.
FIRST_MESH = 48
MESHES = (72, 216, 648, 1296)
_SPLITS = (3, 9, 27)

#: The same between the mesh of the start and the first, and between the last two, which are closer.
_CLOSE_AGREEMENT = 1e-8

#: Interval-points in a chunk, for up to two states and for more: keeps the working set of
#: collocation within a core's cache.
_CHUNK_INTERVALS = (1536, 384)

#: Multipliers below this modulus are compared absolutely: no experiment sees them. Two have their
#: product from Liouville's formula; of more the small ones drown in the round-off of the large.
_VANISHING = (1e-12, 1e-6)
_DROWNED = 1e-7

#: Where the largest eigenvalue of the Jacobian integrates to less than this, all multipliers
#: vanish, by many orders of magnitude, whatever the transfer maps of a stiff method say of them.
_DEAD = -200.0

#: Mean logarithm of the multipliers, exact by Liouville's formula, above which the largest
#: overflows a double for certain, and above which no mesh of ours resolves more than that.
_OVERFLOW, _HOPELESS = 750.0, 5000.0


def chunk_size(intervals: int, size: int) -> int:
    """Points per chunk on a mesh of `intervals`, for `size` states."""
    return max(4, _CHUNK_INTERVALS[size > 2] // intervals)


class _State(NamedTuple):
    """What two meshes are compared by."""

    mean: float
    harmonics: NDArray[np.complex128]
    logs: NDArray[np.complex128]


def refine(
    problem: Problem,
    found: Found,
    block: Indices,
    orbit: Orbit,
    index: Indices,
    options: Options,
    meshes: tuple[int, ...] = MESHES,
) -> None:
    """Refine the orbits of the points `index` and write what settles into `found`.

    Parameters
    ----------
    problem : Problem
        The points of a block.
    found : Found
        Results of all points.
    block : array of int
        Where the points of the block stand in `found`.
    orbit : Orbit
        Orbits of the block on the first mesh.
    index : array of int
        Points of the block that have an orbit.
    options : Options
    """
    size = problem.system.size
    previous = _states(problem, orbit, index, options)
    for intervals in meshes:
        close = intervals in (meshes[0], meshes[-1])
        agreement = _CLOSE_AGREEMENT if close else AGREEMENT
        finer = Orbit.empty(orbit.scheme, size, intervals, len(block))
        solve = partial(
            refine_orbit,
            intervals=intervals,
            harmonics=options.harmonics,
            phases=options.phases,
        )
        settled = np.zeros(len(block), dtype=bool)
        for part, (fine, reading, error) in run_chunks(
            solve, (problem, orbit), index, chunk_size(intervals, size)
        ):
            put(finer, part, fine)
            found.iterations[block[part]] = intervals
            settled[part] = _compare(found, block[part], part, previous, reading, error, agreement)
        options.progress(int(settled[index].sum()))
        orbit, index = finer, index[~settled[index]]
        if not len(index):
            return
    stiff = index[found.outcome[block[index]] == Outcome.MULTIPLIERS_NOT_RESOLVED]
    _split(problem, found, block, orbit, stiff)
    found.discard(block[index[found.outcome[block[index]] != Outcome.CONVERGED]])
    options.progress(len(index))


def _states(problem: Problem, orbit: Orbit, index: Indices, options: Options) -> dict[int, _State]:
    """What the orbits on the mesh that they were found on are worth."""
    states: dict[int, _State] = {}
    solve = partial(read_orbit, harmonics=options.harmonics)
    chunk = chunk_size(FIRST_MESH, problem.system.size)
    for part, reading in run_chunks(solve, (problem, orbit), index, chunk):
        logs = logs_of(reading)
        for k, point in enumerate(part):
            states[point] = _State(reading.mean_friction[k], reading.harmonics[:, k], logs[:, k])
    return states


def _compare(
    found: Found,
    rows: Indices,
    part: Indices,
    previous: dict[int, _State],
    reading: Reading,
    error: NDArray[np.float64],
    agreement: float,
) -> NDArray[np.bool_]:
    """Hold each point against its previous mesh; returns which of them are settled."""
    settled = np.zeros(len(part), dtype=bool)
    logs = logs_of(reading)
    for k, point in enumerate(part):
        if error[k] > ACCEPTED:
            found.outcome[rows[k]], found.detail[rows[k]] = Outcome.NOT_RESOLVED, np.inf
            continue
        state = _State(reading.mean_friction[k], reading.harmonics[:, k], logs[:, k])
        before, previous[point] = previous.get(point), state
        orbit_gap, multiplier_gap = _gaps(before, state)
        if orbit_gap <= agreement and reading.growth[k] < _DEAD:
            logs[:, k], multiplier_gap = _frozen_logs(reading, k), 0.0
        elif orbit_gap <= agreement and reading.log_determinant[k] > _HOPELESS * len(logs):
            logs[:, k], multiplier_gap = (
                _overflowing_logs(len(logs), reading.log_determinant[k]),
                0.0,
            )
        if orbit_gap > agreement:
            found.outcome[rows[k]], found.detail[rows[k]] = Outcome.NOT_RESOLVED, orbit_gap
        elif multiplier_gap > agreement:
            found.outcome[rows[k]] = Outcome.MULTIPLIERS_NOT_RESOLVED
            found.detail[rows[k]] = multiplier_gap
        else:
            settled[k] = True
    kept = np.flatnonzero(settled)
    store(found, rows[kept], take(reading, kept), logs[:, kept])
    # Kept until the multipliers settle, so that only they are computed again.
    resolved = np.flatnonzero(found.outcome[rows] == Outcome.MULTIPLIERS_NOT_RESOLVED)
    outcome = found.outcome[rows[resolved]]
    store(found, rows[resolved], take(reading, resolved), logs[:, resolved])
    found.outcome[rows[resolved]] = outcome
    return settled


def _split(problem: Problem, found: Found, block: Indices, orbit: Orbit, index: Indices) -> None:
    """Settle the multipliers of resolved orbits on ever finer transfer maps."""
    for parts in _SPLITS:
        solve = partial(split_reading, parts=parts)
        chunk = max(1, chunk_size(MESHES[-1] * parts, problem.system.size))
        for part, reading in run_chunks(solve, (problem, orbit), index, chunk):
            logs, rows = logs_of(reading), block[part]
            gap = np.array(
                [
                    _multiplier_gap(found.log_multipliers[:, r], logs[:, k])
                    for k, r in enumerate(rows)
                ]
            )
            found.log_multipliers[:, rows] = logs
            found.detail[rows] = gap
            found.outcome[rows[gap <= AGREEMENT]] = Outcome.CONVERGED
            over = np.flatnonzero(
                (gap > AGREEMENT) & (reading.log_determinant > _OVERFLOW * len(logs))
            )
            if parts == _SPLITS[-1] and len(over):
                found.log_multipliers[:, rows[over]] = _overflowing_logs(
                    len(logs), reading.log_determinant[over]
                )
                found.outcome[rows[over]] = Outcome.CONVERGED
        index = index[found.outcome[block[index]] != Outcome.CONVERGED]
        if not len(index):
            return


def _overflowing_logs(size: int, log_determinant: Any) -> NDArray[np.complex128]:
    """A lower bound for the largest multiplier, infinite as a double; the others are not known."""
    logs = np.full((size, *np.shape(log_determinant)), complex(np.nan, np.nan))
    logs.real[0] = log_determinant / size
    return logs


def _frozen_logs(reading: Reading, k: int) -> NDArray[np.complex128]:
    """Logarithms from the eigenvalues of the Jacobian along the orbit, each followed on its own.

    A rough estimate, which is enough for multipliers that are 0 as doubles.
    """
    growth, determinant = reading.growth[k], reading.log_determinant[k]
    size = reading.monodromy.shape[0]
    rest = (determinant - growth) / max(size - 1, 1)
    return np.array([growth] + [min(growth, rest)] * (size - 1), dtype=complex)


def _gaps(before: _State | None, now: _State) -> tuple[float, float]:
    """Relative change of mean and harmonics, and of multipliers, between two meshes."""
    if before is None or not all(np.all(np.isfinite(a)) for a in now[:2]):
        return np.inf, np.inf
    mean = abs(now.mean - before.mean) / abs(now.mean)
    # Round-off bounds what a harmonic that vanishes beside the first, or beside the mean, can mean.
    floor = (1e-14 * abs(now.harmonics[0]) + 1e-17 * abs(now.mean)) / AGREEMENT
    scale = np.abs(now.harmonics) + floor
    # Beyond the second they count beside the first.
    scale[2:] = np.abs(now.harmonics[0]) + floor
    harmonics = np.abs(now.harmonics - before.harmonics) / scale
    return float(max(mean, harmonics.max())), _multiplier_gap(before.logs, now.logs)


def _multiplier_gap(before: NDArray[np.complex128], now: NDArray[np.complex128]) -> float:
    if not (np.all(np.isfinite(before)) and np.all(np.isfinite(now))):
        return np.inf
    old, new = from_logs(before), from_logs(now)
    # Beyond doubles the logarithms are compared, the multipliers elsewhere.
    huge = now.real > LARGEST_LOG
    with np.errstate(invalid="ignore", over="ignore"):
        several = len(new) > 2
        largest = np.minimum(np.abs(new).max(initial=0.0), np.exp(LARGEST_LOG))
        floor = max(_VANISHING[several], several * _DROWNED * largest)
        gaps = np.abs(old - new) / np.maximum(np.abs(new), floor)
        turned = np.abs(np.exp(1j * (before.imag - now.imag)) - 1)
        apart = np.abs(before.real - now.real) / np.abs(now.real)
        gaps = np.where(huge, np.maximum(apart, turned), gaps)
    return float(np.max(gaps, initial=0.0))
