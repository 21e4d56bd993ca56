"""Slip events of a stick-slip recording: onset, end, forces, drop, creep, each with uncertainty.

Next to each fall the force is a straight line up to the onset, a slip, and a straight line again. A
slider at constant friction moves by half a cosine, while the drive goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.measurement.stick_slip.detection import Falls

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: A line long enough that noise moves its end by this share of the drop; longer ones bend.
_PRECISION = 0.01
_SHORTEST = 6
#: Bins of the slip, and candidates of onset and end on each zoom of the search.
_BINS = 32
_CANDIDATES = 8
_ZOOMS = 4
#: Events that are searched together: their arrays fit the memory.
_TOGETHER = 256
#: Readings of the falls, each without those that the one before has not confirmed.
_READINGS = 4
#: What sampling adds to the uncertainty of an onset or end (samples).
_SAMPLING = 0.45


@dataclass(frozen=True, eq=False)
class SlipEvents:
    """Slip events, an entry each, in rising order. Forces are in the unit of the signal.

    Attributes
    ----------
    onset, end : array, (k,)
        Times (s) at which the force begins and ceases to fall.
    timing_uncertainty : array, (k,)
        Of either (s).
    force_before, force_after : array, (k,)
        At onset and end.
    drop_uncertainty : array, (k,)
        Of force_before - force_after.
    loading_slope, slope_uncertainty : array, (k,)
        Of the middle half of the stick before the event (1/s times the unit); NaN of the first.
    creep, creep_uncertainty : array, (k,)
        What the force at onset lacks to the line of that slope; NaN of the first.
    fall_rate : array, (k,)
        Steepest fall of the force over a quarter of the slip (1/s times the unit).
    """

    onset: Array
    end: Array
    timing_uncertainty: Array
    force_before: Array
    force_after: Array
    drop_uncertainty: Array
    loading_slope: Array
    slope_uncertainty: Array
    creep: Array
    creep_uncertainty: Array
    fall_rate: Array

    def __len__(self) -> int:
        return self.onset.size

    @property
    def drop(self) -> Array:
        """Fall of the force from onset to end."""
        return self.force_before - self.force_after

    @property
    def slip_duration(self) -> Array:
        """Seconds from onset to end."""
        return self.end - self.onset

    @property
    def stick_duration(self) -> Array:
        """Seconds from the end of the event before to the onset; NaN of the first."""
        return self.onset - np.concatenate([[np.nan], self.end])[:-1]

    @property
    def recurrence(self) -> Array:
        """Seconds from the onset of the event before to the onset; NaN of the first."""
        return np.diff(self.onset, prepend=np.nan)


class _Sums:
    """Sums over samples from which a straight line through any run of them follows.

    Times and forces of each event's cell are counted from its middle, so that squares of long
    recordings lose no digits.
    """

    def __init__(self, force: Array, edges: Index, origin: Index) -> None:
        cell = np.clip(np.searchsorted(edges, np.arange(force.size), side="right") - 1, 0, None)
        cell = np.minimum(cell, origin.size - 1)
        t = np.arange(force.size) - origin[cell].astype(float)
        y = force - force[origin][cell]
        self.origin, self.level = origin.astype(float), force[origin]
        self.t, self.tt, self.y, self.ty, self.yy = (
            np.concatenate([[0.0], np.cumsum(v)]) for v in (t, t * t, y, t * y, y * y)
        )

    def line(self, first: Index, stop: Index) -> tuple[Array, Array, Array, Array]:
        """Level and slope at the origin of the cell, sum of squared residuals, mean of t.

        `first` and `stop` bound runs inside one cell each.
        """
        n = (stop - first).astype(float)
        t, tt, y, ty, yy = (s[stop] - s[first] for s in (self.t, self.tt, self.y, self.ty, self.yy))
        n = np.maximum(n, 1.0)
        power = np.maximum(tt - t * t / n, 1e-9)
        slope = (ty - t * y / n) / power
        rest = yy - y * y / n - slope * (ty - t * y / n)
        return (y - slope * t) / n, slope, np.maximum(rest, 0.0), t / n


def read_events(time: Array, force: Array, falls: Falls) -> SlipEvents:
    """Measure every fall.

    Parameters
    ----------
    time : array, (n,)
        Seconds.
    force : array, (n,)
        Without impulses.
    falls : Falls
    """
    least = falls.thresholds.min()
    for _ in range(_READINGS):
        if not len(falls):
            break
        events, visible, farther = _read(time, force, falls)
        # What a line before and a line after do not confirm is a bend in the loading. Where lines
        # from farther off are nearer to no drop at all, impulses have tilted those next to the
        # fall. The others are read again without it.
        real = (visible > least) & (farther > events.drop / 2)
        if real.all():
            return events
        falls = replace(falls, peak=falls.peak[real], trough=falls.trough[real])
    none: dict[str, Any] = {f.name: np.empty(0) for f in fields(SlipEvents)}
    return events if len(falls) else SlipEvents(**none)


def _read(time: Array, force: Array, falls: Falls) -> tuple[SlipEvents, Array, Array]:
    """Events, falls from the highest to the lowest force of each slip, drops by distant lines."""
    peak, trough = falls.peak, falls.trough
    k, n = peak.size, force.size
    before = np.concatenate([[0], trough[:-1]])
    # Cells end in the middle of the sticks.
    edges = np.concatenate(
        [[(before[0] + peak[0]) // 2], (trough[:-1] + peak[1:]) // 2, [(trough[-1] + n) // 2]]
    ).astype(np.intp)
    sums = _Sums(force, edges[:-1], peak)
    drop = np.maximum(force[peak] - force[trough], 2 * falls.scatter[0])
    length = np.ceil((2 * falls.scatter[0] / (_PRECISION * drop)) ** 2) + _SHORTEST
    # The tail of an exponential fall is as long again as its quarters say.
    length = np.minimum(length, n).astype(np.intp) + 2 * (trough - peak)
    first = np.maximum(edges[:-1], peak - length)
    stop = np.minimum(edges[1:], trough + length)
    # Of the middle half: inertia, a ringing gauge and creep bend the force at the ends of a stick.
    quarter = (peak[1:] - trough[:-1]) // 4
    sticks = (np.empty(0),) * 4
    if k > 1:
        sticks = _lines(force, trough[:-1] + quarter, peak[1:] - quarter + 2)
    rate = np.maximum(np.concatenate([sticks[2][:1] if k > 1 else [0.0], sticks[2]]), 0.0)
    bounds = peak, trough, first, stop
    large = np.sort(np.argsort(-drop, kind="stable")[:_TOGETHER])
    shape, shift = _shape(
        sums,
        large,
        [b[large] for b in bounds],
        rate[large],
        drop[large],
        lambda samples: _of_mean(falls.scatter, samples) / drop[large],
    )
    parts = [
        _onset_and_end(sums, part, *(b[part] for b in bounds), rate=rate[part], shape=shape)
        for part in np.array_split(np.arange(k), -(-k // _TOGETHER))
    ]
    onset, end, squares, _ = (np.concatenate(values) for values in zip(*parts, strict=True))
    # The usual residual, as correlated as the noise that detection has seen.
    scatter = falls.scatter * (np.sqrt(np.median(squares)) / falls.scatter[0] or 1.0)
    shapes = shape.timing, shift
    events = _measured(time, force, scatter, sums, (onset, end), (first, stop), sticks, shapes)
    # Lines as far from the fall as two of its lengths, where they are as long or longer.
    away = 2 * (trough - peak)
    first = np.maximum(edges[:-1], peak - 2 * length)
    stop = np.minimum(edges[1:], trough + 2 * length)
    until, since = np.maximum(peak - away, first + 2), np.minimum(trough + away, stop - 2)
    short = np.minimum(until - first, stop - since) < away
    (high, rise, *_), (low, other, *_) = sums.line(first, until), sums.line(since, stop)
    farther = high - low + (rise - other) * away / 4
    u = np.linspace(0, 1, _BINS)
    fall = events.drop[:, None] * shape.fall(u)
    if shape.driven:
        fall += (rate * (end - onset))[:, None] * (u - 1 + shape.fall(u))
    return events, np.ptp(fall, axis=1), np.where(short, events.drop, farther)


def _onset_and_end(
    sums: _Sums,
    part: Index,
    peak: Index,
    trough: Index,
    first: Index,
    stop: Index,
    *,
    rate: Array,
    shape: _Shape,
) -> tuple[Array, Array, Array, Array]:
    """Onset and end by least squares, on grids that zoom in.

    Returns
    -------
    onset, end : array, (k,)
    squares : array, (k,)
        Mean square of all residuals.
    excess : array, (k,)
        Mean square of the residuals of the slip less that of those of the lines.
    """
    length = (trough - peak).astype(float)
    middle = (peak + trough) / 2
    earliest = np.minimum(np.maximum(first + 3.0, peak - 2 * length), peak - 1.0)
    latest = np.maximum(np.minimum(stop - 3.0, trough + 2 * length), trough + 1.0)
    span_on = [earliest, np.minimum(middle + length / 4, trough - 0.5)]
    span_end = [np.maximum(middle - length / 4, peak + 0.5), latest]
    grid = np.linspace(0.0, 1.0, _CANDIDATES)
    rows = np.arange(peak.size)
    at = sums.origin[part][:, None]
    for _ in range(_ZOOMS):
        on = span_on[0][:, None] + (span_on[1] - span_on[0])[:, None] * grid
        off = span_end[0][:, None] + (span_end[1] - span_end[0])[:, None] * grid
        until = np.maximum(np.floor(on).astype(np.intp) + 1, first[:, None] + 2)
        since = np.minimum(np.ceil(off).astype(np.intp), stop[:, None] - 2)
        left = sums.line(np.broadcast_to(first[:, None], on.shape), until)
        right = sums.line(since, np.broadcast_to(stop[:, None], off.shape))
        high = left[0] + left[1] * (on - at)
        low = right[0] + right[1] * (off - at)
        # The slip as sums over bins, from the earliest onset to the latest end.
        edges = np.linspace(span_on[0], span_end[1] + 1.0, _BINS + 1, axis=1)
        edges = np.clip(np.rint(edges).astype(np.intp), first[:, None], stop[:, None])
        pair = np.s_[:, :, None, None], np.s_[:, None, :, None]
        # Of the bin in which the slip begins or ends only the part that is slip.
        begin = np.maximum(edges[:, None, None, :-1], until[pair[0]])
        stops = np.maximum(np.minimum(edges[:, None, None, 1:], since[pair[1]]), begin)
        weight = stops - begin
        length_here = np.maximum(off[pair[1]] - on[pair[0]], 0.25)
        u = np.clip(((begin + stops - 1) / 2 - on[pair[0]]) / length_here, 0.0, 1.0)
        fall = shape.fall(u)
        model = low[pair[1]] + fall * (high[pair[0]] - low[pair[1]])
        if shape.driven:
            model += rate[:, None, None, None] * length_here * (u - 1 + fall)
        misfit = (model * (weight * model - 2 * (sums.y[stops] - sums.y[begin]))).sum(-1)
        squares = sums.yy[since][:, None, :] - sums.yy[until][:, :, None]
        misfit += np.where(since[:, None, :] > until[:, :, None], squares, 0.0)
        straight = left[2][:, :, None] + right[2][:, None, :]
        misfit += straight
        # The end comes after the onset, and the force falls.
        wrong = (off[:, None, :] <= on[:, :, None]) | (low[:, None, :] >= high[:, :, None])
        misfit[wrong] = np.inf
        best = misfit.reshape(peak.size, -1).argmin(1)
        i, j = np.unravel_index(best, (_CANDIDATES, _CANDIDATES))
        onset, end = on[rows, i], off[rows, j]
        for span, here in ((span_on, onset), (span_end, end)):
            reach = (span[1] - span[0]) / (_CANDIDATES - 1)
            span[:] = [np.maximum(here - reach, span[0]), np.minimum(here + reach, span[1])]
    squares = np.maximum(np.where(np.isfinite(misfit[rows, i, j]), misfit[rows, i, j], 0.0), 0.0)
    inside = np.maximum(since[rows, j] - until[rows, i], 1)
    outside = np.maximum(stop - first - inside - 4, 1)
    lines = straight[rows, i, j]
    # Within a bin the slip goes on, which its mean leaves over.
    change = np.gradient(model[rows, i, j], axis=1)
    binned = (weight[rows, i, j] * change**2).sum(1) / 12
    # Onset and end take two degrees of freedom.
    excess = (squares - lines - binned - (inside - 2) * lines / outside) / inside
    return onset, end, squares / np.maximum(stop - first - 6, 1), excess


def _half_cosine(u: Array) -> Array:
    """(1 + cos(pi u))/2 from 0 to 1 to 1e-4: a polynomial takes a fifth of the time."""
    x = np.pi * (u - 0.5)
    square = x * x
    return np.asarray(0.5 - 0.5 * x * (1 - square / 6 * (1 - square / 20 * (1 - square / 42))))


def _straight(u: Array) -> Array:
    """1 - u."""
    return 1.0 - u


def _relaxing(u: Array) -> Array:
    """Exponential decay over four time constants."""
    tail = np.exp(-4.0)
    return np.asarray((np.exp(-4.0 * u) - tail) / (1 - tail))


@dataclass(frozen=True)
class _Shape:
    """A way to fall from 1 to 0 as u goes from 0 to 1.

    The standard uncertainty of onset or end, the larger of both, of a slip of d samples and drop D
    in white noise s is `timing` sqrt(d) s/D samples (inverse of Fisher's information of both). Of
    correlated noise s sqrt(2/d) is the scatter of means over half of the slip. A `driven` shape is
    that of the slider's displacement, and the spring is loaded during the slip; others are those of
    the force.
    """

    fall: Callable[[Array], Array]
    timing: float
    driven: bool = False


#: How a slider slips on a spring: freely at constant friction, without a drive, at a constant
#: velocity, and damped.
#: Onsets of half a cosine and of a straight fall are this share of the slip apart (least squares).
_SHAPES = (
    _Shape(_half_cosine, 2.65, driven=True),
    _Shape(_straight, 2.0),
    _Shape(_relaxing, 4.97),
    _Shape(_half_cosine, 2.65),
)
_DISTANCE = 0.13
#: Of 26 made recordings the true shapes stand out by 3.4 to 46 standard errors, others by 2.1.
_CLEAR = 3.0


def _shape(
    sums: _Sums,
    part: Index,
    bounds: list[Index],
    rate: Array,
    drop: Array,
    noise: Callable[[Array], Array],
) -> tuple[_Shape, float]:
    """The shape of slips, which all fall alike, and what is open of it.

    Half a cosine unless the squares of another are smaller by more than `_CLEAR` times the standard
    error of their mean difference. Where noise moves onsets by more than another shape would,
    squares only say which shape follows the noise: such events do not count.

    What is open is the standard error of onset or end, over the duration, since slips fall unlike
    any shape. A fall between two shapes, by a share x from one, has residuals in proportion to x of
    the one and to 1 - x of the other: x of the distance between their onsets is the error.
    """
    fits = [_onset_and_end(sums, part, *bounds, rate=rate, shape=shape) for shape in _SHAPES]
    squares = np.array([fit[2] for fit in fits])
    long = np.maximum(fits[0][1] - fits[0][0], 2.0)
    certain = _SHAPES[0].timing / np.sqrt(2.0) * noise(long / 2) < _DISTANCE / 2
    chosen = 0
    for k in range(1, len(_SHAPES) - 1):
        better = (squares[chosen] - squares[k])[certain]
        if better.size > 1 and better.mean() > _CLEAR * better.std(ddof=1) / np.sqrt(better.size):
            chosen = k
    onset, end, *_ = fits[chosen]
    misfit = np.array([_root(fit[3] / drop**2) for fit in fits])
    misfit = np.maximum(misfit, np.finfo(float).tiny)
    away = [
        misfit[chosen]
        / (misfit[chosen] + misfit[k])
        * max(abs(float(np.median((fit[n] - fits[chosen][n]) / (end - onset)))) for n in (0, 1))
        for k, fit in enumerate(fits)
        if k != chosen
    ]
    return _SHAPES[chosen], max(away)


def _root(values: Array) -> float:
    """Root of a mean of squares, two standard errors above what it is."""
    error = values.std() / np.sqrt(max(values.size - 1, 1))
    return float(np.sqrt(max(values.mean() + 2 * error, 0.0)))


def _measured(
    time: Array,
    force: Array,
    scatter: Array,
    sums: _Sums,
    slips: tuple[Array, Array],
    bounds: tuple[Index, Index],
    sticks: tuple[Array, Array, Array, Array],
    timing_of: tuple[float, float],
) -> SlipEvents:
    """Forces and their uncertainties; of the sticks centre, mean, slope and number of samples."""
    (onset, end), (first, stop) = slips, bounds
    step = float(time[-1] - time[0]) / (force.size - 1)
    until = np.clip(np.floor(onset).astype(np.intp) + 1, first + 2, None)
    since = np.clip(np.ceil(end).astype(np.intp), None, stop - 2)

    def level(begin: Index, close: Index, at: Array) -> tuple[Array, Array]:
        mean, slope, *_ = sums.line(begin, close)
        return mean + slope * (at - sums.origin) + sums.level, slope

    high, before = level(first, until, onset)
    low, after = level(since, stop, end)
    drop = high - low
    # The end of a line is twice as uncertain as its mean. What the line of half of its samples says
    # otherwise, in the mean over the events, is how the stick bends: creep in proportion to what is
    # loaded before, a ringing gauge to the drop.
    before_doubt = 2 * _of_mean(scatter, until - first)
    doubt = np.hypot(before_doubt, 2 * _of_mean(scatter, stop - since))
    creeps = (level(until - (until - first) // 2, until, onset)[0] - high).sum()
    rings = (level(since, since + (stop - since) // 2, end)[0] - low).sum()
    rise = high - np.concatenate([low[:1], low[:-1]])
    doubt = np.hypot(doubt, creeps / rise.sum() * rise - rings / drop.sum() * drop)
    long = np.maximum(end - onset, 2.0)
    fisher, shift = timing_of
    timing = fisher / np.sqrt(2.0) * _of_mean(scatter, long / 2) / np.maximum(drop, scatter[0])
    timing = np.hypot(long * np.hypot(timing, shift), _SAMPLING)
    # Slips unlike their shape begin earlier and end later, or the reverse.
    doubt = np.hypot(doubt, (np.abs(before) + np.abs(after)) * timing)
    centre, mean, slope, count = sticks
    mean_doubt = _of_mean(scatter, count)
    # The slope of n samples has a variance of 12/n^2 of that of their mean.
    slope_doubt = np.sqrt(12.0) * mean_doubt / count
    reach = onset[1:] - centre
    lag_doubt = np.sqrt(mean_doubt**2 + (slope_doubt * reach) ** 2 + before_doubt[1:] ** 2)
    samples = np.arange(force.size, dtype=float)
    none = [np.nan]
    return SlipEvents(
        onset=np.interp(onset, samples, time),
        end=np.interp(end, samples, time),
        timing_uncertainty=timing * step,
        force_before=high,
        force_after=low,
        drop_uncertainty=doubt,
        loading_slope=np.concatenate([none, slope / step]),
        slope_uncertainty=np.concatenate([none, slope_doubt / step]),
        creep=np.concatenate([none, mean + slope * reach - high[1:]]),
        creep_uncertainty=np.concatenate([none, lag_doubt]),
        fall_rate=steepest_fall(force, onset, end, drop) / step,
    )


def _lines(force: Array, first: Index, stop: Index) -> tuple[Array, Array, Array, Array]:
    """Centre, mean, slope and number of samples of runs that do not overlap, in rising order."""
    sums = _Sums(force, first, (first + stop) // 2)
    level, slope, _, away = sums.line(first, stop)
    mean, count = level + slope * away + sums.level, (stop - first).astype(float)
    return sums.origin + away, mean, slope, count


def _of_mean(scatter: Array, samples: Index | Array) -> Array:
    """Scatter of the mean over so many samples, between and beyond the widths that are known."""
    known = np.arange(scatter.size)
    octave = np.log2(np.maximum(samples, 1))
    inside = np.exp(np.interp(octave, known, np.log(scatter)))
    return np.asarray(inside * 2.0 ** (-np.maximum(octave - known[-1], 0.0) / 2))


def steepest_fall(force: Array, onset: Array, end: Array, drop: Array) -> Array:
    """Largest fall per sample over a quarter of the slip; of an unresolved slip its drop.

    Parameters
    ----------
    force : array, (n,)
    onset, end : array, (k,)
        In samples.
    drop : array, (k,)
    """
    total = np.concatenate([[0.0], np.cumsum(force)])
    duration = np.maximum(end - onset, 1.0)
    width = np.maximum(duration / 4, 1.0)
    places = onset[:, None] + duration[:, None] * np.linspace(0.0, 1.0, 9)
    reach = np.broadcast_to(width[:, None] / 2, places.shape)

    def mean(low: Array, high: Array) -> Array:
        first, last = (np.interp(at + 0.5, np.arange(total.size), total) for at in (low, high))
        return np.asarray((last - first) / (high - low))

    # Means over the halves before and after a place lie half a width apart.
    rate = (mean(places - reach, places) - mean(places, places + reach)) / reach
    return np.where(end - onset < 2.0, drop, rate.max(1))
