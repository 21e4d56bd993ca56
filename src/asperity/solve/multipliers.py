"""Trust in multipliers: those beyond doubles, and finer transfer maps until the rest settle."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, run_chunks
from asperity.solve.floquet import LARGEST_LOG, from_logs
from asperity.solve.found import Found, logs_of
from asperity.solve.kernels import Problem, Reading, split_reading
from asperity.solve.mesh import Orbit
from asperity.solve.outcome import Outcome

#: Agreement between two meshes, relative, at which the finer one is trusted to 1e-8: with three
#: times the intervals its own error is smaller by 3^4 for a stiff orbit, by 3^8 otherwise.
AGREEMENT = 2e-7

#: Each interval is cut into 3, 9, 27... parts for finer transfer maps, up to this number in all.
_MOST_INTERVALS = 35_000

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


def resolve_by_splitting(
    problem: Problem, found: Found, block: Indices, orbit: Orbit, index: Indices
) -> None:
    """Settle the multipliers of resolved orbits on ever finer transfer maps."""
    intervals = orbit.mesh.shape[0] - 1
    splits = [3**k for k in range(1, 10) if intervals * 3**k <= _MOST_INTERVALS]
    for parts in splits:
        solve = partial(split_reading, parts=parts)
        chunk = max(1, chunk_size(intervals * parts, problem.system.size))
        for part, reading in run_chunks(solve, (problem, orbit), index, chunk):
            logs, rows = logs_of(reading), block[part]
            gap = np.array(
                [
                    multiplier_gap(found.log_multipliers[:, r], logs[:, k])
                    for k, r in enumerate(rows)
                ]
            )
            found.log_multipliers[:, rows] = logs
            found.detail[rows] = gap
            found.outcome[rows[gap <= AGREEMENT]] = Outcome.CONVERGED
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
