"""The clock of a recording: even or not, gaps, stamps that stand still or run backward."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from asperity.arrays import Float, Index
from asperity.recording.defects.rounded_time import RoundedGrid, rounded_grid
from asperity.recording.finding import Finding

#: Steps that differ by less than this part of their median are even.
_EVEN = 0.01
#: A gap is longer than this many usual steps...
_GAP = 1.5
#: ...and lies this many robust standard deviations outside them.
_OUTSIDE = 6.0
#: Steps on each side of a gap that say what is usual there.
_SIDE = 24
_CHUNK = 100_000
#: Samples of a stretch of one sampling rate, at least, and the change of the interval that ends it.
_SHORTEST, _OTHER_RATE = 16, 1.5


def even_rate(time: Float) -> float | None:
    """Samples per second where all steps agree within 1 % or are even but for rounding, else None.

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
    if steps.min() > 0 and _are_even(steps, time):
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
    if low > 0 and high - low <= _EVEN * low + _slack(clean, low):
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
    gap, missing = _gaps(steps, clean)
    if gap.size:
        longest = gap[np.argmax(missing)]
        row = int(starts[longest])
        findings.append(
            Finding(
                "gap",
                "warning",
                float(missing.sum()),
                f"time, row {row}, t = {time[row]:.10g} s",
                f"{_counted(gap.size, 'gap')} in the recording, {missing.sum():.4g} s missing in "
                f"all; the longest step, {steps[longest]:.4g} s, follows row {row}.",
            )
        )
        steps, starts = np.delete(steps, gap), np.delete(starts, gap)
    if steps.size and not _are_even(steps, clean):
        findings.append(_uneven(steps, starts, time))
    return findings


def _backward_and_repeated(steps: Float, time: Float, rows: Index) -> list[Finding]:
    findings = []
    backward, repeated = np.flatnonzero(steps < 0), np.flatnonzero(steps == 0)
    if backward.size:
        i = int(backward[np.argmin(steps[backward])])
        findings.append(
            Finding(
                "backward time",
                "error",
                backward.size,
                f"time, row {rows[i + 1]}, t = {time[i + 1]:.10g} s",
                f"Time runs backward {_counted(backward.size, 'time')}, the farthest by "
                f"{-steps[i]:.4g} s at row {rows[i + 1]}.",
            )
        )
    if repeated.size:
        i = int(repeated[0])
        findings.append(
            Finding(
                "repeated time",
                "warning",
                repeated.size,
                f"time, row {rows[i + 1]}, t = {time[i + 1]:.10g} s",
                f"{_counted(repeated.size, 'time stamp')} the same as the one before, the first in "
                f"row {rows[i + 1]}.",
            )
        )
    return findings


def gap_rows(time: Float) -> Index:
    """Samples that follow a gap, in rising order.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds, finite and rising.
    """
    return _gaps(np.diff(time), time)[0] + 1


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


def _gaps(steps: Float, time: Float) -> tuple[Index, Float]:
    """Indices of the steps that are gaps, and the time missing in each."""
    median = float(np.median(steps))
    suspects = np.flatnonzero(steps > _GAP * median + _slack(time, median))
    # After a change to a lower rate every step is a candidate; chunks bound the memory.
    gaps, missing = [], []
    for part in np.array_split(suspects, suspects.size // _CHUNK + 1):
        before = part[:, None] + np.arange(-_SIDE, 0)
        after = part[:, None] + np.arange(1, _SIDE + 1)
        limit = np.fmax(_usual(steps, before)[1], _usual(steps, after)[1])
        usual = np.fmin(_usual(steps, before)[0], _usual(steps, after)[0])
        is_gap = steps[part] > limit
        gaps.append(part[is_gap])
        missing.append((steps[part] - usual)[is_gap])
    return np.concatenate(gaps), np.concatenate(missing)


def _usual(steps: Float, window: Index) -> tuple[Float, Float]:
    """Median step of each window and the longest usual step; NaN for an empty window."""
    if not window.size:
        return np.empty(0), np.empty(0)
    inside = (window >= 0) & (window < steps.size)
    values = np.where(inside, steps[np.clip(window, 0, steps.size - 1)], np.nan)
    empty = ~inside.any(axis=1)
    values[empty] = np.inf
    middle = np.nanmedian(values, axis=1)
    scatter = np.zeros_like(middle)
    filled = ~empty
    scatter[filled] = 1.4826 * np.nanmedian(np.abs(values[filled] - middle[filled, None]), axis=1)
    middle[empty] = np.nan
    return middle, np.maximum(_GAP * middle, middle + _OUTSIDE * scatter)


def _uneven(steps: Float, starts: Index, time: Float) -> Finding:
    median = float(np.median(steps))
    worst = int(np.argmax(np.abs(steps - median)))
    row = int(starts[worst])
    return Finding(
        "uneven sampling",
        "warning",
        float(np.abs(steps[worst] - median) / median),
        f"time, row {row}, t = {time[row]:.10g} s",
        f"Steps of time run from {steps.min():.4g} s to {steps.max():.4g} s with a median of "
        f"{median:.4g} s; there is no one sampling rate.",
    )


def _rounded(grid: RoundedGrid) -> Finding:
    return Finding(
        "rounded time",
        "note",
        grid.quantum / grid.step,
        "time",
        f"Time stamps are rounded to {grid.quantum:.3g} s; they were read as the even grid that "
        f"they stand for, of {1 / grid.step:.8g} samples per second.",
    )


def _are_even(steps: Float, time: Float) -> bool:
    median = float(np.median(steps))
    allowed = _EVEN * median + _slack(time, median)
    return bool(steps.max() - median <= allowed and median - steps.min() <= allowed)


def _slack(time: Float, step: float) -> float:
    """Tolerance for a step, from the last digit of the time stamps."""
    digit = _digit(time)
    # Digits coarser than half a step give no tolerance: stamps of 1 ms at 1 kHz are exact.
    return 1.01 * digit if digit <= step / 2 else 0.0


def _digit(time: Float) -> float:
    """The last decimal of the time stamps, s; the rounding error if they are not decimal."""
    rounding = 4 * np.spacing(np.abs(time[[0, -1]]).max())
    sample = time[:: max(1, time.size // 1000)]
    for decimals in range(10):
        scaled = sample * 10.0**decimals
        if np.all(np.abs(scaled - np.rint(scaled)) <= rounding * 10.0**decimals):
            return float(10.0**-decimals) if decimals else float(rounding)
    return float(rounding)


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
