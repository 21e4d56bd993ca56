"""Types of NumPy arrays, as annotations name them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]
Bool = NDArray[np.bool_]


def between(low: float, high: float, u: Float, *, log: bool = False) -> Float:
    """Values at fractions `u` of the way from `low` to `high`, with `log` at equal ratios."""
    return np.asarray(low * (high / low) ** u if log else low + (high - low) * u)


def spaced(low: float, high: float, count: int, *, log: bool = False) -> Float:
    """Values at equal distances, or ratios, with both ends, rounded to 15 digits.

    A longer grid of the same step then has bit for bit the same values, and a decimal step gives
    decimal values (0.3, not 0.30000000000000004).
    """
    values = between(low, high, np.linspace(0.0, 1.0, count), log=log)
    return np.array([float(f"{value:.15g}") for value in values])


def batches(count: int, sizes: Sequence[int]) -> Iterator[tuple[Index, int]]:
    """Indices of `count` points for calls of a compiled program, and the points of each call.

    All calls have the smallest of the `sizes` that holds all points, or the largest; the last call
    is filled up with the last point. Of 0 points there is one call, of index -1.
    """
    size = next((n for n in sizes if count <= n), sizes[-1])
    for start in range(0, max(count, 1), size):
        yield np.minimum(np.arange(start, start + size), count - 1), min(count - start, size)
