"""The drive of a recording: segments of constant pulling velocity, and a piecewise linear load.

The velocities are measured or given. The corners of the load are detected in the recorded load, and
placed between its samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded
from scipy.optimize import minimize_scalar
from scipy.special import ndtri

from asperity.arrays import Float
from asperity.errors import Argument, InputError, require
from asperity.inference.runs.drive import Drive
from asperity.measurement.samples import compressive, load_channel
from asperity.measurement.sliding.segments import (
    Cut,
    Partition,
    partition,
    partition_at,
    require_cuts,
)
from asperity.measurement.sliding.signals import SlidingSignals
from asperity.recording import Trace
from asperity.units import quantity_text

#: A load that varies by less than this share of its mean is taken as constant.
_CONSTANT_LOAD = 1e-3
#: The piecewise linear load follows the recorded load to this many standard deviations of its
#: noise.
_LOAD_NOISE = 5.0
#: Two corners of the load closer than this many samples may be one.
_CORNERS_MERGE = 5
#: Number of samples on each side of a corner from which its time is computed.
_SAMPLES_NEAR_CORNER = 50
#: For recordings of more samples than the first number: number of blocks over which the load
#: between its quick changes is averaged; probability that noise moves a sample beyond the limit.
_FEW_SAMPLES, _LOAD_BLOCKS, _LOAD_BY_CHANCE = 20_000, 4_000, 1e-3


def constant_velocities(
    signals: SlidingSignals,
    name: str,
    steps: Sequence[float] | None,
    velocities: Sequence[float] | None,
) -> Partition:
    """Segments in which the drive has a constant velocity, positive, or rests.

    Parameters
    ----------
    signals : SlidingSignals
    name : str
        Name of the run in messages.
    steps, velocities
        As in `recorded_run`.

    Raises
    ------
    InputError
        If the numbers of velocities and segments differ, if the motion of the drive is neither
        recorded nor given, if the recording begins with a hold, or if the direction reverses.
    """
    result = _given_or_measured(signals, name, steps, velocities)
    both = list(zip(result.velocities, result.holds, strict=True))
    moving = [v for v, hold in both if not hold]
    if not moving or result.holds[0]:
        raise InputError(
            f"{name} must begin with sliding at a constant velocity, got "
            f"{'no sliding' if not moving else 'a hold'}; give a window that does"
        )
    sign = float(np.sign(moving[0]))
    advice = "give another channel of the displacement, or a window that slides"
    require(sign != 0, f"the displacement of {name}", "move", "noise alone", advice)
    if any(sign * v <= 0 for v in moving):
        raise InputError(
            f"{name} must slide in one direction, got a reversal; give a window without"
        )
    speeds = [0.0 if hold else sign * float(v) for v, hold in both]
    # Two neighbouring holds are joined.
    kept = [k for k in range(len(result.cuts)) if speeds[k] or speeds[k + 1]]
    speeds = [speeds[0], *(speeds[k + 1] for k in kept)]
    return Partition(
        tuple(result.cuts[k] for k in kept),
        tuple(speeds),
        tuple(v == 0 for v in speeds),
        result.doubts,
    )


def _given_or_measured(
    signals: SlidingSignals,
    name: str,
    steps: Sequence[float] | None,
    velocities: Sequence[float] | None,
) -> Partition:
    """The segments, with signed velocities."""
    time, displacement = signals.time, signals.displacement
    if velocities is not None and (steps is None or len(velocities) != len(steps) + 1):
        got = f"{len(velocities)} for {len(steps or ())}"
        raise InputError("velocities", "be one more than the steps", got, "give both")
    if displacement is None and velocities is None:
        raise InputError(
            name,
            "have the displacement or velocity of the drive",
            f"none: {signals.no_motion}",
            f"name a channel, like {Argument('columns', 'displacement', 'x')}, or give "
            f"{Argument('steps')} and {Argument('velocities')}",
        )
    if steps is None:
        return partition(time, displacement)
    require_cuts(time, steps, "steps")
    return partition_at(time, displacement, np.array(steps), velocities)


def cut_uncertainty(time: Float, cuts: Sequence[Cut]) -> tuple[float, ...]:
    """Standard uncertainty of the time of each cut (s)."""
    uncertain = []
    for cut in cuts:
        i = int(np.clip(np.searchsorted(time, cut.time), 1, time.size - 1))
        interval = float(np.median(np.diff(time[max(0, i - 3) : i + 3])))
        uncertain.append(max(interval, cut.doubt / 2))
    return tuple(uncertain)


def recorded_load(
    trace: Trace, load: str, time: Float, subject: str, advice: str
) -> tuple[Float, Float] | None:
    """Times and load, positive in compression, of the samples within the span of `time`.

    None if no load is recorded.

    Raises
    ------
    InputError
        If the load is not positive.
    """
    channel = load_channel(trace, load)
    if channel is None:
        return None
    good = np.isfinite(channel.values) & (trace.time >= time[0]) & (trace.time <= time[-1])
    t, W = trace.time[good], compressive(channel.values[good], channel.values[good])[0]
    if t.size < 2:
        return None
    if not (W > 0).all():
        lowest = int(np.argmin(W))
        got = f"{quantity_text(W[lowest], channel.unit)} at {t[lowest]:.6g} s"
        raise InputError(subject, "be under a positive load", got, advice)
    order = np.argsort(t, kind="stable")
    return t[order], W[order]


class LoadCourse(NamedTuple):
    """A piecewise linear load.

    Attributes
    ----------
    times, values : array, shape (corners,)
        Times (s) and load at its corners, and at the first and last sample; the load is 1 if none
        is recorded.
    unit : str
        "N" or "Pa"; empty if no load is recorded.
    """

    times: Float
    values: Float
    unit: str


def load_course(trace: Trace, load: str, name: str, signals: SlidingSignals) -> LoadCourse:
    """The load through the samples of a recording, which is constant or has corners.

    Raises
    ------
    InputError
        If the load is not positive.
    """
    time = signals.time
    ends = time[[0, -1]]
    recorded = recorded_load(
        trace, load, time, name, "give a window in which the slider is in contact"
    )
    if recorded is None:
        return LoadCourse(ends, np.ones(2), "")
    t, W = recorded
    mean = float(W.mean())
    noise = float(np.median(np.abs(np.diff(W, 2)))) / 0.6745 / np.sqrt(6.0) if W.size > 4 else 0.0
    knots = _load_knots(t, W, noise, _CONSTANT_LOAD * mean)
    if len(knots) == 2 and abs(W[0] - W[-1]) < _CONSTANT_LOAD * mean + _LOAD_NOISE * noise:
        return LoadCourse(ends, np.full(2, mean), signals.load_unit)
    at = _corner_times(t, W, knots, max(_LOAD_NOISE * noise, _CONSTANT_LOAD * mean))
    at = _fitted_corners(t, W, at)
    values = _line_through(t, W, at)
    at[[0, -1]] = ends
    return LoadCourse(at, values, signals.load_unit)


def _load_knots(t: Float, W: Float, noise: float, least: float) -> list[int]:
    """Samples at the corners of a piecewise linear load that follows the recorded load.

    Among very many samples, noise alone moves some beyond the limit. Quick changes are therefore
    detected with a wider limit, and slow changes between them in block means.
    """
    if t.size <= _FEW_SAMPLES:
        knots = _line_knots(t, W, max(_LOAD_NOISE * noise, least))
        return _needed_knots(t, W, knots, noise, least)
    chance = -float(ndtri(_LOAD_BY_CHANCE / t.size))
    knots = _line_knots(t, W, max(2 * chance * noise, least))
    result = set(knots)
    for a, b in pairwise(knots):
        q = max(1, (b - a) // _LOAD_BLOCKS)
        if q == 1:
            continue
        whole = (b - a) // q * q
        means = [x[a : a + whole].reshape(-1, q).mean(1) for x in (t, W)]
        limit = max(_LOAD_NOISE * noise / np.sqrt(q), least)
        result |= {a + k * q + q // 2 for k in _line_knots(means[0], means[1], limit)[1:-1]}
    return _needed_knots(t, W, sorted(result), noise, least)


def _corner_times(t: Float, y: Float, knots: Sequence[int], tolerance: float) -> Float:
    """Times of the corners; a corner between two samples is placed where the lines meet.

    A corner between two samples may appear as two corners at these samples, or at samples further
    away, because the line follows the load within a tolerance only. Friction responds to the load
    within a fraction of a sampling interval, so that the exact time matters.
    """
    at = t[list(knots)]
    values = _line_through(t, y, at)
    slope = np.diff(values) / np.diff(at)
    size = np.diff(knots)
    kept = list(at[:1])
    k = 1
    while k < at.size:
        if k + 2 < at.size and size[k] <= min(_CORNERS_MERGE, size[k - 1] - 1, size[k + 1] - 1):
            before, after = slope[k - 1], slope[k + 1]
            gap = values[k + 1] - after * at[k + 1] - (values[k] - before * at[k])
            meeting = gap / (before - after) if before != after else np.nan
            near = slice(knots[k], knots[k + 1] + 1)
            line = np.where(
                t[near] < meeting,
                values[k] + before * (t[near] - at[k]),
                values[k + 1] + after * (t[near] - at[k + 1]),
            )
            if at[k] < meeting < at[k + 1] and np.abs(line - y[near]).max() <= tolerance:
                kept.append(meeting)
                k += 2
                continue
        kept.append(at[k])
        k += 1
    return np.array(kept)


def _fitted_corners(t: Float, y: Float, at: Float) -> Float:
    """Corners moved by up to an interval, to the best fit of the lines on both sides to y."""
    placed = at.copy()
    for k in range(1, at.size - 1):
        middle = int(np.searchsorted(t, at[k]))
        first = max(middle - _SAMPLES_NEAR_CORNER, int(np.searchsorted(t, placed[k - 1])))
        last = min(middle + _SAMPLES_NEAR_CORNER, int(np.searchsorted(t, at[k + 1], side="right")))
        near, values = t[first:last], y[first:last]
        if not first + 1 < middle < last - 2:
            continue

        def squares(corner: float, near: Float = near, values: Float = values) -> float:
            knots = np.array([near[0], corner, near[-1]])
            line = np.interp(near, knots, _line_through(near, values, knots))
            return float(np.sum((line - values) ** 2))

        inside = max(t[middle - 1], near[1]), min(t[middle + 1], near[-2])
        result = minimize_scalar(squares, bounds=inside, method="bounded")
        if result.fun < squares(at[k]):
            placed[k] = result.x
    return placed


def _line_through(t: Float, y: Float, at: Float) -> Float:
    """Values at the knots of the piecewise linear function that fits y best."""
    i = np.clip(np.searchsorted(at, t, side="right") - 1, 0, at.size - 2)
    share = (t - at[i]) / (at[i + 1] - at[i])
    # Normal equations of the hat functions; each has a sample at its knot or next to it.
    bands = np.zeros((2, at.size))
    bands[1] = np.bincount(i, (1 - share) ** 2, at.size) + np.bincount(i + 1, share**2, at.size)
    bands[0, 1:] = np.bincount(i, share * (1 - share), at.size)[:-1]
    right = np.bincount(i, (1 - share) * y, at.size) + np.bincount(i + 1, share * y, at.size)
    return np.asarray(solveh_banded(bands, right))


def _line_knots(t: Float, y: Float, tolerance: float) -> list[int]:
    """Corners of a polyline through y within a tolerance (Ramer, Douglas, Peucker)."""

    def away(a: int, b: int) -> Float:
        """Distances from the chord."""
        chord = y[a] + (y[b] - y[a]) * (t[a : b + 1] - t[a]) / max(t[b] - t[a], 1e-300)
        return np.abs(y[a : b + 1] - chord)

    kept = {0, t.size - 1}
    parts = [(0, t.size - 1)]
    while parts:
        a, b = parts.pop()
        if b - a < 2:
            continue
        apart = away(a, b)
        k = int(np.argmax(apart))
        if apart[k] > tolerance:
            kept.add(a + k)
            parts += [(a, a + k), (a + k, b)]
    return sorted(kept)


def _needed_knots(
    t: Float, y: Float, knots: Sequence[int], noise: float, least: float
) -> list[int]:
    """Knots that are needed: without them, the best piecewise linear fit to y is too poor.

    The corners come from chords through noisy samples, and some of them are no corners of the load.
    Without a corner, the line between its neighbours has a larger sum of squares; the increase is
    compared with the penalty of the Bayesian information criterion for a corner's time and value.
    """
    at = np.asarray(knots)
    span = float(t[-1] - t[0])
    x, v = (t - t[0]) / span, y - y.mean()
    columns = np.stack([np.ones_like(x), x, x * x, v, x * v])
    sums = np.pad(np.cumsum(columns, axis=1), ((0, 0), (1, 0)))
    penalty = 2 * np.log(t.size)
    while at.size > 2:
        a, k, b = at[:-2], at[1:-1], at[2:]
        n, x1, x2, v1, xv = sums[:, b + 1] - sums[:, a]
        m, h1, h2, hv1, hxv = sums[:, b + 1] - sums[:, k]
        here = x[k]
        # The hinge function (x - here)+ less its best linear fit.
        h, hx = h1 - here * m, h2 - here * h1
        hh, hv = hx - here * h, hxv - here * hv1
        spread = x2 - x1 * x1 / n
        slope = (hx - x1 * h / n) / spread
        size = hh - h * h / n - slope * (hx - x1 * h / n)
        bend = (hv - h * v1 / n - slope * (xv - x1 * v1 / n)) / np.maximum(size, 1e-300)
        gain = bend * bend * size
        high = np.abs(bend) * (here - x[a]) * (x[b] - here) / (x[b] - x[a])
        worth = np.minimum(gain / (penalty * noise**2), high / least) if noise else high / least
        # Among neighbours that are not needed, the less needed corner is removed first.
        lower = np.concatenate([[np.inf], worth, [np.inf]])
        gone = (worth < 1) & (worth <= lower[:-2]) & (worth < lower[2:])
        if not gone.any():
            break
        at = np.delete(at, 1 + np.flatnonzero(gone))
    return at.tolist()


def joined_drive(
    time: Float, segments: Partition, course: LoadCourse
) -> tuple[Drive, tuple[int, ...]]:
    """The drive from the first sample on, and its edges at which the velocity changes.

    Parameters
    ----------
    time : array, shape (n,)
        Times of the samples (s).
    segments : Partition
    course : LoadCourse
    """
    times, knots = time - time[0], course.times - time[0]
    cut_times = _with_corners(times, [cut.time - time[0] for cut in segments.cuts], knots)
    edges = np.unique(np.concatenate([[0.0, times[-1]], cut_times, knots]))
    middle = (edges[1:] + edges[:-1]) / 2
    piece = np.searchsorted(np.asarray(cut_times), middle)
    pull = np.asarray(segments.velocities)[piece] / segments.velocities[0]
    at_edges = np.interp(edges, knots, course.values / course.values[0])
    slope = np.diff(at_edges) / np.diff(edges)
    cuts = np.searchsorted(edges, cut_times).tolist()
    return Drive(edges, pull, at_edges[:-1], slope), tuple(cuts)


def _with_corners(times: Float, cut_times: Sequence[float], knots: Float) -> list[float]:
    """Times of velocity changes; those within a sampling interval of a load corner move to it.

    The drive then changes velocity and load at once. The time of a corner is known to a fraction of
    the interval, that of a velocity change is not; a short piece between them would leave no room
    for the delay of the change.
    """
    moved = []
    for cut in cut_times:
        k = int(np.clip(np.searchsorted(times, cut), 1, times.size - 1))
        corner = float(knots[np.argmin(np.abs(knots - cut))])
        close = 0 < corner < times[-1] and abs(corner - cut) < times[k] - times[k - 1]
        moved.append(corner if close else cut)
    return sorted(set(moved)) if len(set(moved)) == len(moved) else list(cut_times)
