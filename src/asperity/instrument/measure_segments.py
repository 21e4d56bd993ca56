"""Segments of steady pulling, found where the velocity changes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from asperity.instrument.measure_series import Level, block_means, level, steady_from

Array = NDArray[np.float64]

#: Velocities are compared over so many parts of equal time, each of ten samples at least.
_PARTS = 256
#: A velocity step is a change of a quarter, and of so many times the scatter.
_RATIO = 1.25
_SCATTER = 5.0
#: Share of a segment's beginning in which the extremes after a step are looked for.
_AFTER_STEP = 0.5


@dataclass(frozen=True)
class Segment:
    """A stretch of constant pulling velocity.

    Attributes
    ----------
    start, end : float
        Seconds.
    velocity : float
        m/s; NaN if neither velocity nor displacement is recorded.
    steady : Level
        Friction once it has settled.
    slope : float
        Of the steady friction over time (1/s).
    scatter : float
        Standard deviation of the steady friction about that slope.
    highest, lowest : float
        Extremes of friction in the first half of the segment, smoothed over five samples.
    """

    start: float
    end: float
    velocity: float
    steady: Level
    slope: float
    scatter: float
    highest: float
    lowest: float


def segments_of(
    time: Array, friction: Array, motion: Array | None, *, is_velocity: bool
) -> list[Segment]:
    """Cut a recording where its velocity changes.

    Parameters
    ----------
    time, friction : array, (n,)
    motion : array, (n,), optional
        Velocity (m/s) or displacement (m); without it there is one segment.
    is_velocity : bool
        Which of the two it is.
    """
    if motion is None:
        return [_segment(time, friction, np.nan)]
    cuts = [0]
    for cut in [*_velocity_steps(time, motion, is_velocity), time.size]:
        if cut - cuts[-1] >= 8 or cut == time.size:
            cuts.append(cut)
    speeds = [_velocity(time[a:b], motion[a:b], is_velocity) for a, b in pairwise(cuts)]
    # A part that holds a step has a velocity of its own, and cuts before and after it.
    inner = [
        cut for cut, a, b in zip(cuts[1:-1], speeds[:-1], speeds[1:], strict=True) if _differ(a, b)
    ]
    cuts = [0, *inner, time.size]
    return [
        _segment(time[a:b], friction[a:b], _velocity(time[a:b], motion[a:b], is_velocity))
        for a, b in pairwise(cuts)
    ]


def _segment(time: Array, friction: Array, velocity: float) -> Segment:
    means = block_means(friction, 100)
    settled = steady_from(means, 1) * max(1, friction.size // 100)
    late, values = time[settled:], friction[settled:]
    slope, height = np.polyfit(late - late[0], values, 1)
    first = friction[: max(5, int(_AFTER_STEP * friction.size))]
    smooth = np.convolve(first, np.ones(5) / 5, mode="valid")
    return Segment(
        start=float(time[0]),
        end=float(time[-1]),
        velocity=velocity,
        steady=level(late, values),
        slope=float(slope),
        scatter=float(np.std(values - slope * (late - late[0]) - height)),
        highest=float(smooth.max()),
        lowest=float(smooth.min()),
    )


def _velocity(time: Array, motion: Array, is_velocity: bool) -> float:
    if is_velocity:
        return float(np.median(motion))
    return float(np.polyfit(time - time[0], motion, 1)[0])


def _velocity_steps(time: Array, motion: Array, is_velocity: bool) -> list[int]:
    """Samples at which a new velocity begins."""
    count = int(min(_PARTS, time.size // 10))
    # Parts of equal time: a step often comes with another sampling rate.
    edges = np.unique(np.searchsorted(time, np.linspace(time[0], time[-1], count + 1)[1:-1]))
    edges = np.concatenate([[0], edges[np.diff(np.append(0, edges)) >= 4], [time.size - 1]])
    if is_velocity:
        spans = np.diff(edges)
        speed = np.add.reduceat(motion[: edges[-1]], edges[:-1]) / spans
    else:
        speed = np.diff(motion[edges]) / np.diff(time[edges])
    cuts = _steps(speed)
    return [_sharpened(time, motion, edges, cut, is_velocity) for cut in cuts]


def _steps(speed: Array) -> list[int]:
    """Binary segmentation: the best cut first, then each side by itself."""
    found: list[int] = []
    # Scatter from differences of neighbours, which steps hardly touch.
    noise = 1.4826 * float(np.median(np.abs(np.diff(speed)))) / np.sqrt(2) + 1e-300
    waiting = [(0, speed.size)]
    while waiting:
        a, b = waiting.pop()
        if b - a < 6:
            continue
        sums = np.cumsum(speed[a:b])
        left = np.arange(1, b - a)
        means = sums[:-1] / left, (sums[-1] - sums[:-1]) / (b - a - left)
        gain = np.abs(means[1] - means[0]) * np.sqrt(left * (b - a - left) / (b - a))
        gain[:2] = gain[-2:] = 0.0
        best = int(np.argmax(gain))
        before, after = means[0][best], means[1][best]
        if _differ(before, after) and gain[best] > _SCATTER * noise:
            cut = a + best + 1
            found.append(cut)
            waiting += [(a, cut), (cut, b)]
    return sorted(found)


def _differ(a: float, b: float) -> bool:
    small, large = sorted((abs(a), abs(b)))
    return large > _RATIO * small or a * b < 0


def _sharpened(
    time: Array, motion: Array, edges: NDArray[np.intp], cut: int, is_velocity: bool
) -> int:
    """The sample of a step, from the two parts about it: least squares of a kink or a jump."""
    first, stop = int(edges[max(cut - 2, 0)]), int(edges[min(cut + 2, edges.size - 1)])
    t, x = time[first:stop] - time[first], motion[first:stop]
    tried = np.unique(np.linspace(2, t.size - 3, min(t.size - 4, 200)).astype(int))
    misfit = []
    for at in tried:
        turn = (t >= t[at]).astype(float) if is_velocity else np.maximum(t - t[at], 0.0)
        columns = [np.ones_like(t), turn] if is_velocity else [np.ones_like(t), t, turn]
        matrix = np.stack(columns, axis=1)
        beta = np.linalg.lstsq(matrix, x)[0]
        misfit.append(float(np.sum((x - matrix @ beta) ** 2)))
    return first + int(tried[int(np.argmin(misfit))])
