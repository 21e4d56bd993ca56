"""Saturation: an extreme at which a channel is cut off, or kept by a command."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from asperity.arrays import Bool, Float, Index

#: Number of levels next to the extreme that show the usual number of samples at a level.
_LEVELS = 3
#: Saturation needs this ratio of samples at the extreme to samples at the next level. A quantised
#: smooth extreme has a ratio up to 2.4 (parabola) or 5.3 (fourth power).
CROWDED = 8
_FEWEST = 5
#: Samples on both sides of a run at the extreme that show whether it ends abruptly.
_BEYOND = 2
#: Differences of values from which the step of a converter is computed.
_SEARCHED_STEPS = 64
#: Values that differ by less than this share of the range are equal: a signal without noise that is
#: sampled at the same phases in each period repeats its values to within their last digits.
_SAME = 1e-9
#: This many equal samples in a row are no chance where the values next to them occur once.
_IN_A_ROW = 3

#: No rows.
NONE: Index = np.empty(0, dtype=np.intp)


class Saturated(NamedTuple):
    """An extreme at which a channel is cut off, or kept by a command.

    Attributes
    ----------
    side : {"largest", "smallest"}
    value : float
    rows : array of int
        Samples at the extreme, in rising order.
    usual : int
        Number of samples at the most frequent of the levels next to the extreme.
    """

    side: str
    value: float
    rows: Index
    usual: int


def saturated(values: Float, crowded: float = CROWDED, spikes: Index = NONE) -> list[Saturated]:
    """Extremes at which the channel has more samples than an unsaturated signal.

    Parameters
    ----------
    values : array, shape (n,)
        NaN where unknown. A channel of three values or fewer, such as a switch, has no flat top.
    crowded : float
        Ratio of the samples at the extreme to those at the next levels that is saturation.
    spikes : array of int
        Samples that are spikes. Alone, they are no saturation, and saturation may lie below them.
    """
    known = np.isfinite(values)
    without = known.copy()
    without[spikes] = False
    result: list[Saturated] = []
    for side in ("largest", "smallest"):
        rows, usual = _crowd(values, without, side, crowded)
        if not rows.size and spikes.size:
            rows, usual = _crowd(values, known, side, crowded)
            if not (np.diff(rows) == 1).any():
                continue
        if rows.size:
            result.append(Saturated(side, float(values[rows[0]]), rows, usual))
    return result


def _crowd(values: Float, use: Bool, side: str, crowded: float) -> tuple[Index, int]:
    """Samples at a saturated extreme, none of another, and the usual number next to it."""
    none = NONE, 0
    at = None if use.all() else np.flatnonzero(use)
    used = values if at is None else values[at]
    if not used.size:
        return none
    low, high = float(used.min()), float(used.max())
    sign, extreme = (1.0, high) if side == "largest" else (-1.0, low)
    rows = np.flatnonzero(used == extreme)
    # The usual case, without further work.
    if low == high or rows.size < _IN_A_ROW:
        return none
    heights, same = sign * (used - extreme), _SAME * (high - low)
    usual = _most_at_a_level(heights, same)
    if usual is None:
        return none
    later = rows[_IN_A_ROW - 1 :]
    in_a_row = bool(np.any(later - rows[: later.size] == _IN_A_ROW - 1))
    full = rows.size >= _FEWEST and rows.size > crowded * usual
    if full or (in_a_row and (usual == 1 or _cut_off(heights, rows, same))):
        return (rows if at is None else at[rows]), usual
    return none


def _most_at_a_level(heights: Float, same: float) -> int | None:
    """Samples at the most frequent level below the extreme, 0; None with too few levels."""
    left, most, level = heights, 0, 0.0
    for _ in range(_LEVELS):
        left = left[left < level - same]
        if not left.size:
            return None
        level = float(left.max())
        most = max(most, int(np.count_nonzero(left >= level - same)))
    return most


def _cut_off(heights: Float, rows: Index, same: float) -> bool:
    """Whether most runs of samples at the extreme end more abruptly than a rounded smooth top.

    The top of a fourth power that stays within one step for m samples, (m - 1)/2 on either side of
    its middle, has fallen by at most ((m - 1 + 2 j)/(m - 1))^4 steps j samples further on.
    """
    edges = np.flatnonzero(np.diff(rows) > 1)
    first, last = rows[np.r_[0, edges + 1]], rows[np.r_[edges, rows.size - 1]]
    inside = (first >= _BEYOND) & (last < heights.size - _BEYOND)
    long = (last - first >= _IN_A_ROW - 1) & inside
    first, last = first[long], last[long]
    if first.size < _FEWEST or 2 * (last - first + 1).sum() < rows.size:
        return False
    step, sharp = _common_step(heights, same), np.zeros(first.size, bool)
    for j in range(1, _BEYOND + 1):
        fall = -np.maximum(heights[first - j], heights[last + j])
        sharp |= fall > (1 + 2 * j / (last - first)) ** 4 * step
    return bool(2 * np.count_nonzero(sharp) > sharp.size)


def _common_step(values: Float, same: float) -> float:
    """The largest step of which all differences of values are multiples, to within `same`.

    A signal that is sampled at the same phases in each period has few values, which may all be many
    steps apart.
    """
    steps = np.diff(np.unique(values))
    steps = steps[steps > same]
    _, different = np.unique(np.round(steps / same), return_index=True)
    step = float(steps.min())
    for other in steps[different][:_SEARCHED_STEPS]:
        # Euclid's algorithm.
        larger, smaller = float(other), step
        while smaller > same:
            remainder = larger % smaller
            larger, smaller = smaller, min(remainder, smaller - remainder)
        step = larger
    return step
