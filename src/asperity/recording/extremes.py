"""Long curves in few points: the extremes of blocks of equally many samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def extremes(values: NDArray[np.float64], blocks: int) -> NDArray[np.intp]:
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
