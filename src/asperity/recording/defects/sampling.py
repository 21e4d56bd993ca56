"""The clock of a recording: even or not, gaps, stamps that stand still or run backward.

Rounded stamps are an even grid, cut by gaps, plus a rounding error. A clock that is stored in
single precision, or written with few digits, has steps that alternate though the samples are
evenly spaced. Without correction such stamps lower an amplitude by the share (2 pi f q)^2/24 for a
quantum q; where q exceeds the sampling step, several samples share a stamp.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from asperity.arrays import Float, Index
from asperity.parameters.parameter import count_text
from asperity.recording.finding import Finding, Severity, at_row

#: Steps that differ by less than this part of their median are even.
_EVEN = 0.01
#: A gap is longer than this many usual steps...
_GAP = 1.5
#: ...and lies this many robust standard deviations outside them.
_OUTSIDE = 6.0
#: Number of steps on each side of a gap whose median is the usual step.
_SIDE = 24
_CHUNK = 100_000
#: Samples of a stretch of one sampling rate, at least, and the change of the interval that ends it.
_SHORTEST, _OTHER_RATE = 16, 1.5


def even_rate(time: Float) -> float | None:
    """Samples per second if all steps agree within 1 % or are even up to rounding, else None.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds.

    Returns
    -------
    float or None
        ``(n - 1) / (time[-1] - time[0])``, Hz.
    """
    if time.size < 2:
        return None
    steps = np.diff(time)
    # Written so that NaN is uneven.
    if steps.min() > 0 and _are_even(steps):
        return float((time.size - 1) / (time[-1] - time[0]))
    grid = rounded_grid(time)
    return None if grid is None or grid.gaps else 1 / grid.step


def check_sampling(time: Float) -> list[Finding]:
    """Findings on the clock: backward and repeated stamps, gaps, uneven steps."""
    clean = time if np.isfinite(time.sum()) else time[np.isfinite(time)]
    if clean.size < 2:
        return []
    steps = np.diff(clean)
    low, high = float(steps.min()), float(steps.max())
    if low > 0 and high - low <= _EVEN * low:
        # The usual case: even within the strictest limit, so that no median is needed.
        return []
    rows = np.flatnonzero(np.isfinite(time))
    grid = rounded_grid(time)
    rounded: list[Finding] = []
    if grid is not None:
        clean = grid.time
        steps = np.diff(clean)
        if grid.quantum > _EVEN * grid.step:
            rounded = [_rounded(grid)]
    findings = rounded + _backward_and_repeated(steps, clean, rows)
    forward = steps > 0
    steps, starts = (steps, rows) if forward.all() else (steps[forward], rows[:-1][forward])
    if not steps.size:
        return findings
    gap, missing = _gaps(steps)
    if gap.size:
        longest = gap[np.argmax(missing)]
        row, lost = int(starts[longest]), float(missing.sum())
        text = (
            f"{count_text(gap.size, 'gap')} in the recording, {lost:.4g} s missing in all; the "
            f"longest step, {steps[longest]:.4g} s, follows row {row}."
        )
        findings.append(Finding("gap", "warning", lost, at_row("time", row, time), text))
        steps, starts = np.delete(steps, gap), np.delete(starts, gap)
    if steps.size and not _are_even(steps):
        findings.append(_uneven(steps, starts, time))
    return findings


def _backward_and_repeated(steps: Float, time: Float, rows: Index) -> list[Finding]:
    """Findings on the steps from row to row, of the times `time` in the rows `rows`."""

    def finding(name: str, severity: Severity, count: int, step: int, text: str) -> Finding:
        row = rows[step + 1]
        where = f"time, row {row}, t = {time[step + 1]:.10g} s"
        return Finding(name, severity, count, where, f"{text} row {row}.")

    findings = []
    backward, repeated = np.flatnonzero(steps < 0), np.flatnonzero(steps == 0)
    if backward.size:
        i, times = int(backward[np.argmin(steps[backward])]), count_text(backward.size, "time")
        text = f"Time runs backward {times}, the farthest by {-steps[i]:.4g} s at"
        findings.append(finding("backward time", "error", backward.size, i, text))
    if repeated.size:
        stamps = count_text(repeated.size, "time stamp")
        text = f"{stamps} the same as the one before, the first in"
        findings.append(finding("repeated time", "warning", repeated.size, int(repeated[0]), text))
    return findings


def gap_rows(time: Float) -> Index:
    """Samples that follow a gap, in rising order.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds, finite and rising.
    """
    return _gaps(np.diff(time))[0] + 1


def rate_stretches(time: Float) -> tuple[tuple[int, int], ...]:
    """Start and stop (exclusive) of each stretch with a constant sampling rate.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds, finite and rising.
    """
    from scipy.ndimage import median_filter

    steps = np.log(median_filter(np.diff(time), 7, mode="nearest"))
    bounds = [0]
    level, begin, reach = steps[0], 0, 64
    while begin < steps.size:
        # Search the next different interval in growing parts.
        other = np.abs(steps[begin : begin + reach] - level) > np.log(_OTHER_RATE)
        if not other.any():
            begin, reach = begin + reach, 4 * reach
            continue
        begin, reach = begin + int(np.argmax(other)), 64
        if begin - bounds[-1] >= _SHORTEST:
            bounds.append(begin)
        level = steps[begin]
    if time.size - bounds[-1] < _SHORTEST and len(bounds) > 1:
        bounds.pop()
    return tuple(pairwise([*bounds, time.size]))


def _gaps(steps: Float) -> tuple[Index, Float]:
    """Indices of the steps that are gaps, and the time missing in each."""
    suspects = np.flatnonzero(steps > _GAP * float(np.median(steps)))
    if not suspects.size:
        return suspects, np.empty(0)
    # Beyond the ends of a recording its steps are reflected.
    runs = sliding_window_view(np.pad(steps, _SIDE, mode="reflect"), _SIDE)
    # After a change to a lower rate every step is a candidate; chunks bound the memory.
    gaps, missing = [], []
    for part in np.array_split(suspects, suspects.size // _CHUNK + 1):
        sides = np.stack([runs[part], runs[part + _SIDE + 1]])
        middle = np.median(sides, axis=-1)
        scatter = 1.4826 * np.median(np.abs(sides - middle[..., None]), axis=-1)
        limit = np.maximum(_GAP * middle, middle + _OUTSIDE * scatter)
        is_gap = steps[part] > limit.max(0)
        gaps.append(part[is_gap])
        missing.append((steps[part] - middle.min(0))[is_gap])
    return np.concatenate(gaps), np.concatenate(missing)


def _uneven(steps: Float, starts: Index, time: Float) -> Finding:
    median = float(np.median(steps))
    worst = int(np.argmax(np.abs(steps - median)))
    share, where = float(abs(steps[worst] - median) / median), at_row("time", starts[worst], time)
    text = (
        f"Steps of time run from {steps.min():.4g} s to {steps.max():.4g} s with a median of "
        f"{median:.4g} s; there is no one sampling rate."
    )
    return Finding("uneven sampling", "warning", share, where, text)


def _rounded(grid: RoundedGrid) -> Finding:
    text = (
        f"Time stamps are rounded to {grid.quantum:.3g} s; they were read as the even grid that "
        f"they stand for, of {1 / grid.step:.8g} samples per second."
    )
    return Finding("rounded time", "note", grid.quantum / grid.step, "time", text)


def _are_even(steps: Float) -> bool:
    median = float(np.median(steps))
    return bool(steps.max() - median <= _EVEN * median >= median - steps.min())


#: Smallest mean number of samples between gaps.
_FEWEST = 16
#: Samples from which the quantum is estimated; in single precision the quantum grows with time.
_WINDOW = 64
#: Largest ratio of the quantum in the last part of a recording to that in most of it.
_DOUBLED = 2.1
#: Smallest number of steps that differ from the most common one, where a step may be a single
#: quantum. Fewer such steps may be lost samples: of 3,500 recordings that lost 8 to 39 samples at
#: random, 3 were taken for rounded with 16 here, and none with 24.
_EVENTS = 24
#: Largest range of the deviations from the least-squares line, in quanta. Rounded grids have at
#: most 1.09 (11,400 grids of 24 to 20,000 samples); stamps with a jitter of 0.03 to 0.5 steps,
#: rounded to that or finer, have at least 1.96 (3,280 cases).
_WITHIN = 1.25
#: A gap is longer than a step by a quantum and by this share of a step.
_LONG_STEP = 0.4


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

    Between gaps all steps of the grid are equal. The first time after a gap follows from the
    samples after it.

    Parameters
    ----------
    time : array, (n,)
        Seconds.
    """
    if time.size < _FEWEST:
        return None
    # Times may be infinite; NaN fails the next test, too.
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff(time)
    low, high = float(steps.min()), float(steps.max())
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
    gaps = np.flatnonzero(steps > (1 + _LONG_STEP) * step + 1.25 * quantum)
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
    """The quantum of the stamps; None if no rounding explains their steps.

    Steps of a rounded grid take two values, which differ by the quantum. A quantum shorter than the
    sampling interval is no longer than the shortest step. Stamps with a longer quantum repeat, and
    rise by the quantum otherwise. A larger change from one step to the next is a gap.
    """
    change = np.abs(np.diff(steps))
    low = float(steps.min())
    longest = low if low > exact else _DOUBLED * float(np.median(steps[steps > exact]))
    change[(change <= exact) | (change > longest + exact)] = np.inf
    edges = np.arange(0, change.size, _WINDOW)
    # The last window may be too short to have such a change.
    least = np.minimum.reduceat(change, edges[:-1] if edges.size > 1 else edges)
    least = least[np.isfinite(least)]
    if not least.size:
        return None
    quantum = float(least[least <= _DOUBLED * np.median(least)].max())
    whole = np.rint(steps / quantum)
    if whole.min() >= 2 and np.all(np.abs(steps - whole * quantum) <= whole * exact):
        return quantum
    # Lost samples have steps of whole samples too.
    events = np.count_nonzero(np.abs(steps - np.median(steps)) > exact)
    return quantum if events >= _EVENTS else None
