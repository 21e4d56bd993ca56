"""Long curves in few points: the extremes of blocks of equally many samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def extremes(x: Array, y: Array, blocks: int) -> dict[str, Array]:
    """The smallest and the largest sample of each block, in order of time.

    Parameters
    ----------
    x, y : array, shape (n,)
    blocks : int
        A curve with fewer than four samples per block is returned whole.

    Returns
    -------
    dict
        ``x`` and ``y``, of at most 2 `blocks` + 2 points; NaN where all samples of a block are.
    """
    length = -(-y.size // blocks)
    if length < 4:
        return {"x": _rounded(x), "y": _rounded(y)}
    whole = y.size // length * length
    table = y[:whole].reshape(-1, length)
    low = np.argmin(np.where(np.isnan(table), np.inf, table), axis=1)
    high = np.argmax(np.where(np.isnan(table), -np.inf, table), axis=1)
    first = np.arange(0, whole, length)
    pair = np.sort(np.stack([first + low, first + high], axis=1), axis=1).ravel()
    remainder = y[whole:]
    if remainder.size and not np.isnan(remainder).all():
        ends = sorted({whole + int(np.nanargmin(remainder)), whole + int(np.nanargmax(remainder))})
        pair = np.concatenate([pair, ends])
    return {"x": _rounded(x[pair]), "y": _rounded(y[pair])}


def _rounded(values: Array) -> Array:
    """Values rounded to seven digits of the largest: more than a picture shows."""
    finite = values[np.isfinite(values)]
    size = float(np.abs(finite).max()) if finite.size else 0.0
    if not size:
        return values
    places = 7 - int(np.floor(np.log10(size)))
    return np.round(values, places) if abs(places) < 300 else values
