"""Recordings that hold the same samples: they would count twice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.inference.runs.run import RecordedRun

#: Equal samples in a row that chance does not make, if they have so many different values.
_EQUAL, _DIFFERENT = 64, 16


def require_own_samples(runs: Sequence[RecordedRun]) -> None:
    """Refuse recordings of which two hold the same samples, at whatever times.

    Raises
    ------
    InputError
        If 64 samples in a row of one, with 16 different values among them, are in another.
    """
    for first, second in combinations(runs, 2):
        shared = _shared(first.friction, second.friction)
        if shared is None:
            continue
        a, b = (run.origin + run.time[k] for run, k in zip((first, second), shared, strict=True))
        raise InputError(
            f"{second.name} must hold samples of its own, got those from {b:.6g} s on equal to "
            f"those of {first.name} from {a:.6g} s on; give each recording once, in windows that "
            "do not overlap: they would count twice"
        )


def _shared(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[int, int] | None:
    """Where the first samples of x that are also in y begin in both."""
    if min(x.size, y.size) < _EQUAL:
        return None
    rows = x[: x.size // _EQUAL * _EQUAL].reshape(-1, _EQUAL)
    various = 1 + (np.diff(np.sort(rows, axis=1), axis=1) > 0).sum(axis=1) >= _DIFFERENT
    begins = np.flatnonzero(various)
    marks = _marks(x)[::_EQUAL][begins]
    order = np.argsort(marks)
    others = _marks(y)
    at = np.searchsorted(marks[order], others)
    at[at == order.size] = 0
    for j in np.flatnonzero(marks[order][at] == others) if order.size else ():
        k = int(begins[order[at[j]]])
        if np.array_equal(y[j : j + _EQUAL], rows[k]):
            return k * _EQUAL, int(j)
    return None


def _marks(x: NDArray[np.float64]) -> NDArray[np.uint64]:
    """A number for each 64 samples in a row that depends on all of their bits."""
    bits = np.ascontiguousarray(x).view(np.uint64)
    factor = 0x9E3779B97F4A7C15
    length, mark = 1, bits * np.uint64(factor)
    # Of twice as many samples each time; numbers wrap at 2^64.
    while length < _EQUAL:
        factor = (factor * factor + 2) % 2**64
        later = mark[length:]
        mark = mark[: mark.size - length] * np.uint64(factor) + (later ^ (later >> np.uint64(29)))
        length *= 2
    return mark
