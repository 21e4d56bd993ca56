"""Trust in multipliers: those beyond doubles, and finer transfer maps until the rest settle."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, run_chunks
from asperity.solve.floquet import LARGEST_LOG, from_logs, log_multipliers
from asperity.solve.found import Found, logs_of
from asperity.solve.kernels import Problem, Reading, piece_map, read_orbit, split_reading
from asperity.solve.mesh import Orbit
from asperity.solve.outcome import Outcome

#: Agreement between two meshes, relative, at which the finer one is trusted to 1e-8: with three
#: times the intervals its own error is smaller by 3^4 for a stiff orbit, by 3^8 otherwise.
AGREEMENT = 2e-7

#: Each interval is cut into 3, 9, 27... parts for finer transfer maps, up to these numbers in all:
#: of all intervals at once, and of one after the other.
_MOST_AT_ONCE, _MOST_INTERVALS = 35_000, 40_000_000

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


def settle_beyond_doubles(reading: Reading, logs: NDArray[np.complex128], k: int) -> bool:
    """Whether multipliers beyond doubles need no mesh; their logarithms are then put right."""
    if reading.growth[k] < _DEAD:
        logs[:, k] = _frozen_logs(reading, k)
    elif reading.log_determinant[k] > _HOPELESS * len(logs):
        logs[:, k] = _overflowing_logs(len(logs), reading.log_determinant[k])
    else:
        return False
    return True


def resolve_multipliers(
    problem: Problem, found: Found, block: Indices, orbit: Orbit, index: Indices
) -> None:
    """Settle the multipliers of resolved orbits on ever finer transfer maps."""
    if len(index):
        _resolve_by_splitting(problem, found, block, orbit, index)
        index = index[found.outcome[block[index]] != Outcome.CONVERGED]
        _resolve_piece_by_piece(problem, found, block, orbit, index)


def _resolve_by_splitting(
    problem: Problem, found: Found, block: Indices, orbit: Orbit, index: Indices
) -> None:
    """All intervals at once, as long as their maps can all be kept."""
    intervals = orbit.mesh.shape[0] - 1
    splits = [3**k for k in range(1, 10) if intervals * 3**k <= _MOST_AT_ONCE]
    for parts in splits:
        solve = partial(split_reading, parts=parts)
        chunk = max(1, chunk_size(intervals * parts, problem.system.size))
        for part, reading in run_chunks(solve, (problem, orbit), index, chunk):
            logs, rows = logs_of(reading), block[part]
            gap = _hold_against_before(found, rows, logs)
            over = np.flatnonzero(
                (gap > AGREEMENT) & (reading.log_determinant > _OVERFLOW * len(logs))
            )
            if parts == splits[-1] and len(over):
                found.log_multipliers[:, rows[over]] = _overflowing_logs(
                    len(logs), reading.log_determinant[over]
                )
                found.outcome[rows[over]] = Outcome.CONVERGED
        index = index[found.outcome[block[index]] != Outcome.CONVERGED]
        if not len(index):
            return


def _resolve_piece_by_piece(
    problem: Problem, found: Found, block: Indices, orbit: Orbit, index: Indices
) -> None:
    """Settle what is left by products of transfer maps so fine that they are never all kept.

    For slow modulation, under which a disturbance turns or grows by many thousand radians or
    factors of e in a period, and yet is about as large at its end as in the beginning.
    """
    intervals = orbit.mesh.shape[0] - 1
    parts = next(3**k for k in range(20) if intervals * 3**k > _MOST_AT_ONCE)
    while len(index) and intervals * parts <= _MOST_INTERVALS:
        solve = partial(_map_by_pieces, parts=parts)
        for part, monodromy in run_chunks(solve, (problem, orbit), index, 1):
            _hold_against_before(found, block[part], log_multipliers(*monodromy))
        index = index[found.outcome[block[index]] != Outcome.CONVERGED]
        parts *= 3


def _hold_against_before(
    found: Found, rows: Indices, logs: NDArray[np.complex128]
) -> NDArray[np.float64]:
    """Write logarithms of multipliers over those of coarser maps; returns how far they differ."""
    before = found.log_multipliers[:, rows]
    gap = np.array([multiplier_gap(before[:, k], logs[:, k]) for k in range(len(rows))])
    found.log_multipliers[:, rows], found.detail[rows] = logs, gap
    found.outcome[rows[gap <= AGREEMENT]] = Outcome.CONVERGED
    return gap


def _map_by_pieces(
    inputs: tuple[Problem, Orbit], *, parts: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Monodromy matrix, logarithm of its scale, and logarithm of the determinant."""
    problem, orbit = inputs
    size, points = orbit.centre.shape
    whole = np.repeat(np.eye(size)[..., None], points, axis=2)
    log_scale = np.zeros(points)
    for k in range(orbit.mesh.shape[0] - 1):
        step, log_step = piece_map((problem, orbit.piece(k, k + 1)), parts=parts)
        # On maps that miss growth within a part the product may be lost; then no two agree.
        with np.errstate(all="ignore"):
            whole = np.einsum("ijb,jkb->ikb", step, whole)
            largest = np.abs(whole).max((0, 1))
            whole = whole / largest
            log_scale = log_scale + np.asarray(log_step) + np.log(largest)
    reading = read_orbit(inputs, harmonics=1)
    return whole, log_scale, np.asarray(reading.log_determinant)


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


def multiplier_gap(before: NDArray[np.complex128], now: NDArray[np.complex128]) -> float:
    """Largest change of multipliers between two meshes, relative to them or to what counts."""
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
