"""Repeated values: a channel that is saturated, coarsely rounded, or repeats its samples."""

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
#: So many equal samples in a row are no chance where the values next to them occur once.
_IN_A_ROW = 3
#: Rounding is coarse where this share of neighbours is equal and the other differences are whole
#: multiples of one step, to this share of it.
_MOSTLY_EQUAL, _WHOLE = 0.5, 0.02
#: Quantile of the differences next to equal samples that is the step: few are smaller by chance, as
#: where the load in F/W changes by a step of its own.
_LEAST = 0.05
#: A sample-and-hold channel repeats at least a tenth of its samples, and has several quantisation
#: steps between them.
_REPEATED, _STEPS = 0.1, 4.0
#: Regular holding: share of runs of the usual length. Irregular holding: share of repeated samples,
#: and size of the steps between them.
_REGULAR, _OFTEN, _FAR = 0.9, 0.3, 10.0


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


def saturated(values: Float, crowded: float = CROWDED) -> list[Saturated]:
    """Extremes at which the channel has more samples than an unsaturated signal.

    Parameters
    ----------
    values : array, shape (n,)
        NaN where unknown. A channel of three values or fewer, such as a switch, has no flat top.
    crowded : float
        Ratio of the samples at the extreme to those at the next levels that is saturation.
    """
    finite = values if np.isfinite(values.sum()) else values[np.isfinite(values)]
    result: list[Saturated] = []
    if finite.size < 2 or finite.min() == finite.max():
        return result
    for side, extreme in (("largest", float(finite.max())), ("smallest", float(finite.min()))):
        at_extreme = values == extreme
        count = int(np.count_nonzero(at_extreme))
        # The usual case, without further work.
        if count < _IN_A_ROW or not (at_extreme[1:] & at_extreme[:-1]).any():
            continue
        usual = _most_at_a_level(finite, extreme, side)
        if usual is None:
            continue
        rows = np.flatnonzero(at_extreme)
        full = count >= _FEWEST and count > crowded * usual
        later = rows[_IN_A_ROW - 1 :]
        in_a_row = bool(np.any(later - rows[: later.size] == _IN_A_ROW - 1))
        if full or (usual == 1 and in_a_row):
            result.append(Saturated(side, extreme, rows, usual))
    return result


def _most_at_a_level(values: Float, extreme: float, side: str) -> int | None:
    """Samples at the most frequent level next to the extreme; None with too few levels."""
    left, most = values, 0
    level = extreme
    for _ in range(_LEVELS):
        left = left[left < level] if side == "largest" else left[left > level]
        if not left.size:
            return None
        level = left.max() if side == "largest" else left.min()
        most = max(most, int(np.count_nonzero(left == level)))
    return most


def recorder_step(values: Float, repeated: float = 0.05) -> float:
    """Step of the recorder, in the unit of the values; 0 of a fine recorder.

    A recorder whose steps are seen repeats samples. Next to a repeated sample the signal changes by
    one step, while elsewhere it may pass many.

    Parameters
    ----------
    values : array, shape (n,)
    repeated : float
        Share of repeated samples from which on the recorder is coarse.
    """
    steps, equal = _steps(values)
    if np.count_nonzero(equal) <= repeated * equal.size or equal.all():
        return 0.0
    adjacent = ~equal
    adjacent[1:-1] &= equal[:-2] | equal[2:]
    return float(np.quantile(steps[adjacent], _LEAST))


def _steps(values: Float) -> tuple[Float, Bool]:
    """Sizes of the differences between neighbours, and which of them are equal."""
    steps = np.abs(np.diff(values))
    return steps, steps <= 1e-9 * float(np.median(np.abs(values)))


def coarsely_rounded(values: Float) -> tuple[float, float] | None:
    """Share of values equal to the value before, and the step of the others.

    None where values were not rounded, or no more coarsely than their noise.

    Parameters
    ----------
    values : array, shape (n,)

    Notes
    -----
    Rounding acts like white noise if the signal has noise of that size (Widrow, 1956). If most
    neighbours are equal there is no such noise, and the rounding error follows the signal.
    """
    step = recorder_step(values, _MOSTLY_EQUAL)
    if not step:
        return None
    steps, equal = _steps(values)
    digits = steps[~equal] / step
    if float(np.abs(digits - np.round(digits)).max()) >= _WHOLE:
        return None
    return float(equal.mean()), step


def held_length(values: Float) -> float | None:
    """Mean number of equal samples in a row, where a converter is slower than the recorder.

    None where the resolution of the channel explains the equal samples.

    Parameters
    ----------
    values : array, shape (n,)
    """
    steps = np.abs(np.diff(values))
    moving = steps[steps > 0]
    repeated = 1 - moving.size / max(steps.size, 1)
    if repeated < _REPEATED or moving.size < 16:
        return None
    jump = float(np.median(moving)) / float(moving.min())
    at = np.flatnonzero(steps > 0)
    runs = np.diff(at)
    length = float(runs.mean())
    regular = float(np.mean((runs >= np.floor(length)) & (runs <= np.ceil(length))))
    if jump > _STEPS and regular > _REGULAR:
        return length
    return length if jump > _FAR and repeated > _OFTEN else None
