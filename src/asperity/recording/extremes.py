"""Long curves in few points: the extremes of blocks of equally many samples."""

from __future__ import annotations

import numpy as np

from asperity.arrays import Float, Index


def extremes(values: Float, blocks: int) -> Index:
    """Smallest and largest sample of each block, by their indices in the order of time.

    Parameters
    ----------
    values : array, shape (n,)
    blocks : int
        With fewer than four samples per block all samples are kept.

    Returns
    -------
    int array
        At most 2 `blocks`; a block without a number has its first sample.
    """
    length = -(-values.size // blocks)
    if length < 4:
        return np.arange(values.size)
    table = np.append(values, np.full(-values.size % length, np.nan)).reshape(-1, length)
    absent, first = np.isnan(table), np.arange(0, values.size, length)
    low = first + np.argmin(np.where(absent, np.inf, table), axis=1)
    high = first + np.argmax(np.where(absent, -np.inf, table), axis=1)
    return np.sort(np.stack([low, high], axis=1), axis=1).ravel()


def thinned(x: Float, y: Float, blocks: int) -> dict[str, Float]:
    """The `asperity.recording.extremes` of a curve as ``x`` and ``y``."""
    kept = extremes(y, blocks)
    return {"x": _rounded(x[kept]), "y": _rounded(y[kept])}


def _rounded(values: Float) -> Float:
    """Values rounded to seven digits of the largest: more than a picture shows."""
    finite = values[np.isfinite(values)]
    size = float(np.abs(finite).max()) if finite.size else 0.0
    if not size:
        return values
    places = 7 - int(np.floor(np.log10(size)))
    return np.round(values, places) if abs(places) < 300 else values
