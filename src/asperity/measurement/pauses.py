"""The part of an unmodulated stretch that stands for F(0): sliding under the same load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: The load of a pause may differ from that of the reading by this share, and by its scatter.
_SAME_LOAD, _SCATTERS = 0.02, 5.0
_BLOCKS = 100


def under_the_same_load(
    load: Array, first: int, stop: int, mean_load: float, *, before: bool
) -> tuple[int, int]:
    """Samples of a pause next to the modulated stretch whose load is that of the reading.

    A loading ramp or an unloading is no part of F(0).

    Parameters
    ----------
    load : array, (n,)
        Of the whole recording.
    first, stop : int
        The pause.
    mean_load : float
        Of the reading.
    before : bool
        Whether the pause ends, or begins, at the modulated stretch.

    Returns
    -------
    (int, int)
        As a slice; empty where even the next samples are under another load.
    """
    length = max(1, (stop - first) // _BLOCKS)
    whole = (stop - first) // length
    values = load[stop - whole * length : stop] if before else load[first : first + whole * length]
    blocks = values.reshape(whole, length)
    if before:
        blocks = blocks[::-1]
    means = blocks.mean(1)
    noise = float(np.median(blocks.std(1))) / np.sqrt(length)
    same = np.abs(means - mean_load) <= _SAME_LOAD * abs(mean_load) + _SCATTERS * noise
    if same.all():
        return first, stop
    kept = int(np.argmin(same)) * length
    return (stop - kept, stop) if before else (first, first + kept)
