"""Time stamps that were rounded: an even grid, cut by gaps, plus a rounding error.

A clock that is stored in single precision, or written with few digits, has steps that alternate
though the samples are evenly spaced. Without correction such stamps lower an amplitude by the share
(2 pi f q)^2/24 for a quantum q; where q exceeds the sampling step, several samples share a stamp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.arrays import Float

#: Smallest mean number of samples between gaps.
_FEWEST = 16
#: Samples from which the quantum is estimated; in single precision the quantum grows with time.
_WINDOW = 64
#: Largest ratio of the quantum in the last part of a recording to that in most of it.
_DOUBLED = 2.1
#: Smallest number of steps that differ from the most common one. Fewer such steps may be lost
#: samples: of 3,500 recordings that lost 8 to 39 samples at random, 3 were taken for rounded with
#: 16 here, and none with 24.
_EVENTS = 24
#: Largest range of the deviations from the least-squares line, in quanta. Rounded grids have at
#: most 1.09 (11,400 grids of 24 to 20,000 samples); stamps with a jitter of 0.03 to 0.5 steps,
#: rounded to that or finer, have at least 1.96 (3,280 cases).
_WITHIN = 1.25
#: A gap is longer than a step by a quantum and by this share of a step.
_GAP = 0.4


@dataclass(frozen=True, eq=False)
class RoundedGrid:
    """The even grid of rounded time stamps.

    Attributes
    ----------
    time : array, (n,)
        Seconds.
    step : float
        Seconds between samples.
    quantum : float
        Quantum of the rounding, s; the largest quantum in single precision.
    gaps : int
    """

    time: Float
    step: float
    quantum: float
    gaps: int


def even_times(time: Float) -> Float:
    """Times of the samples: the grid if the stamps are a rounded grid, else the stamps.

    Parameters
    ----------
    time : array, (n,)
        Seconds.

    Returns
    -------
    array, (n,)
        Where the stamps are no rounded grid, `time` itself.
    """
    grid = rounded_grid(time)
    return time if grid is None else grid.time


def rounded_grid(time: Float) -> RoundedGrid | None:
    """The even grid that explains the stamps by rounding; None if there is no such grid.

    Between gaps all steps of the grid are equal; where the sampling begins anew after a gap, the
    samples there say.

    Parameters
    ----------
    time : array, (n,)
        Seconds.
    """
    if time.size < _FEWEST:
        return None
    steps = np.diff(time)
    low, high = float(steps.min()), float(steps.max())
    # NaN fails this test, too.
    if not (low >= 0 and np.isfinite(high)):
        return None
    exact = 8 * float(np.spacing(np.abs(time[[0, -1]]).max()))
    if high - low <= exact:
        return None
    lag = min(_WINDOW, time.size // 4)
    step = float(np.median(time[lag:] - time[:-lag])) / lag
    quantum = _quantum(steps, exact)
    if quantum is None or not step > 0:
        return None
    gaps = np.flatnonzero(steps > (1 + _GAP) * step + 1.25 * quantum)
    if gaps.size * _FEWEST > time.size:
        return None
    starts = np.concatenate([[0], gaps + 1])
    counts = np.diff([*starts, time.size])
    index = np.arange(time.size) - np.repeat(starts, counts)
    # From the first stamp, so that long times keep their digits.
    since = time - time[0]
    middle, level = (np.add.reduceat(x, starts) / counts for x in (index.astype(float), since))
    away = index - np.repeat(middle, counts)
    step = float(away @ (since - np.repeat(level, counts)) / (away @ away))
    made = np.repeat(level, counts) + step * away
    off = since - made
    spread = np.maximum.reduceat(off, starts) - np.minimum.reduceat(off, starts)
    if not spread.max() <= _WITHIN * quantum or not np.diff(made).min() > 0:
        return None
    return RoundedGrid(time[0] + made, step, quantum, int(gaps.size))


def _quantum(steps: Float, exact: float) -> float | None:
    """What stamps may have been rounded to: steps of a rounded grid take two values, one apart.

    A quantum is no longer than a step; where it is longer than the sampling step, so that stamps
    repeat, it is what the others rise by. What changes by more is a gap.
    """
    change = np.abs(np.diff(steps))
    low = float(steps.min())
    longest = low if low > exact else _DOUBLED * float(np.median(steps[steps > exact]))
    usual = np.median(steps)
    if np.count_nonzero(np.abs(steps - usual) > exact) < _EVENTS:
        return None
    change[(change <= exact) | (change > longest + exact)] = np.inf
    edges = np.arange(0, change.size, _WINDOW)
    # The last, short window says less.
    least = np.minimum.reduceat(change, edges[:-1] if edges.size > 1 else edges)
    least = least[np.isfinite(least)]
    if not least.size:
        return None
    return float(least[least <= _DOUBLED * np.median(least)].max())
