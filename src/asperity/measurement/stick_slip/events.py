"""Slip events of a stick-slip recording: onset, end, forces, drop, creep, each with uncertainty.

Around each fall the force is modelled as a straight line up to the onset, a slip, and a straight
line after the end. During the slip a slider at constant friction follows half a cosine, while the
drive continues to move.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from asperity.arrays import Float, Index
from asperity.measurement.stick_slip.detection import Falls, LineSums
from asperity.recording.defects.autoregression import Autoregression, fitted
from asperity.recording.defects.resolution import recorder_step

Shape = Callable[[Float, Float], Float]

#: Lines are long enough that noise moves their ends by this share of the drop at most; longer lines
#: bend.
_PRECISION = 0.01
_SHORTEST = 6
#: Bins of a slip; candidates of onset and end in each zoom of the search, and number of zooms.
_BINS = 32
_CANDIDATES = 8
_ZOOMS = 4
#: Events that are fitted together: their arrays fit the cache.
_FITTED_TOGETHER = 64
#: A stick shorter than this multiple of a slip may be the rise of an oscillation about sliding.
STICKING = 2.0
#: Largest number of events that determine the shape, and of simulated events of each shape.
_MEASURED_EVENTS, _SIMULATED_EVENTS = 64, 64
#: Largest number of runs in sticks from which the noise is estimated, and of samples of a run.
_RUNS, _LONGEST_RUN = 64, 4096
#: Part of the uncertainty of an onset or end that sampling causes (samples).
_SAMPLING = 0.45


@dataclass(frozen=True, eq=False)
class SlipEvents:
    """Slip events in order of time: arrays with an entry for each event.

    Forces are in the unit of the signal.

    Attributes
    ----------
    onset, end : array, (k,)
        Times (s) at which the force begins and ceases to fall. If the fall begins gradually, as
        with a rate-and-state law, the onset lies between the peak and the time at which the fall
        reaches a tenth of its steepest rate.
    timing_uncertainty : array, (k,)
        Standard uncertainty of the onset, and of the end (s).
    force_before, force_after : array, (k,)
        Force at onset and end.
    drop_uncertainty : array, (k,)
        Standard uncertainty of force_before - force_after.
    loading_slope, slope_uncertainty : array, (k,)
        Slope of the force in the middle half of the stick before the event (1/s times the unit),
        including creep throughout the stick; NaN for the first event.
    slope_bend : array, (k,)
        Part of `slope_uncertainty` that all sticks have in common.
    creep, creep_uncertainty : array, (k,)
        The line of the loading at the onset, less the force at the onset; NaN for the first event.
    fall_rate : array, (k,)
        Steepest fall of the force over a quarter of the slip (1/s times the unit), from the mean
        shape of all slips of the recording.
    """

    onset: Float
    end: Float
    timing_uncertainty: Float
    force_before: Float
    force_after: Float
    drop_uncertainty: Float
    loading_slope: Float
    slope_uncertainty: Float
    slope_bend: Float
    creep: Float
    creep_uncertainty: Float
    fall_rate: Float

    def __len__(self) -> int:
        return self.onset.size

    @property
    def drop(self) -> Float:
        """Fall of the force from onset to end."""
        return self.force_before - self.force_after

    @property
    def slip_duration(self) -> Float:
        """Seconds from onset to end."""
        return self.end - self.onset

    @property
    def stick_duration(self) -> Float:
        """Seconds from the end of the previous event to the onset; NaN for the first event."""
        return self.onset - np.concatenate([[np.nan], self.end])[:-1]

    @property
    def recurrence(self) -> Float:
        """Seconds from the onset of the previous event to the onset; NaN for the first event."""
        return np.diff(self.onset, prepend=np.nan)


def read_events(time: Float, force: Float, falls: Falls) -> SlipEvents:
    """Measure every fall.

    Parameters
    ----------
    time : array, (n,)
        Seconds.
    force : array, (n,)
        Force without impulses.
    falls : Falls
    """
    if not len(falls):
        return SlipEvents(*(np.empty(0) for _ in fields(SlipEvents)))
    events = _fit_events(time, force, falls)
    # A fall that the lines before and after it do not confirm is a bend in the loading, caused by
    # hum or a ringing gauge. In an oscillation about sliding all lines bend; the size of the drop
    # decides there, which for a sine is a third too small. Lines of other events still end at an
    # unconfirmed fall, because it may be a slip that noise hides.
    clear = events.drop > 1.96 * events.drop_uncertainty
    cycles = events.stick_duration[1:] / events.slip_duration[1:]
    sticks = cycles.size > 0 and np.median(cycles) >= STICKING
    real = clear if sticks else events.drop > falls.thresholds.min() * 2 / 3
    return SlipEvents(*(getattr(events, f.name)[real] for f in fields(SlipEvents)))


class _Windows(NamedTuple):
    """The part of the force that is fitted to each event.

    Attributes
    ----------
    sums : LineSums
    peak, trough : array, (k,)
        Samples of the fall.
    first, stop : array, (k,)
        First sample of the line before the slip, and the sample after the line that follows it.
    rate : array, (k,)
        Loading by the drive (per sample).
    """

    sums: LineSums
    peak: Index
    trough: Index
    first: Index
    stop: Index
    rate: Float

    def of(self, part: Index) -> _Windows:
        """The windows of some events."""
        peak, trough, first, stop = (bound[part] for bound in self[1:5])
        return _Windows(self.sums.of(part), peak, trough, first, stop, self.rate[part])

    def lines(
        self, onset: Float, end: Float
    ) -> tuple[Index, Index, tuple[Float, ...], tuple[Float, ...]]:
        """The first sample of the slip and the first after it, and the lines before and after.

        Of a line its height at the onset or the end, its slope, and its sum of squared residuals;
        onset and end are of shape (k, ...).
        """
        first, stop = (v.reshape(-1, *[1] * (onset.ndim - 1)) for v in (self.first, self.stop))
        until = np.maximum(np.floor(onset).astype(np.intp) + 1, first + 2)
        since = np.minimum(np.ceil(end).astype(np.intp), stop - 2)
        return until, since, self.sums.at(first, until, onset), self.sums.at(since, stop, end)


def _fit_events(time: Float, force: Float, falls: Falls) -> SlipEvents:
    peak, trough, scatter = falls.peak, falls.trough, falls.scatter
    k, n = peak.size, force.size
    # Cells end in the middle of the sticks.
    edges = (np.append(0, trough) + np.append(peak, n)) // 2
    drop = np.maximum(force[peak] - force[trough], 2 * scatter[0])
    length = np.ceil((2 * scatter[0] / (_PRECISION * drop)) ** 2) + _SHORTEST
    # The tail of an exponential fall is as long again as the part between its quarters.
    length = np.minimum(length, n).astype(np.intp) + 2 * (trough - peak)
    first = np.maximum(edges[:-1], peak - length + (trough - peak))
    stop = np.minimum(edges[1:], trough + length)
    # Only the middle half of a stick is fitted: inertia, a ringing gauge and creep bend its ends.
    quarter = (peak[1:] - trough[:-1]) // 4
    middles = trough[:-1] + quarter, peak[1:] - quarter + 2
    sticks = _sticks(force, *middles, scatter)
    rate = np.maximum(np.concatenate([sticks.slope[:1] if k > 1 else [0.0], sticks.slope]), 0.0)
    windows = _Windows(LineSums(force, edges[:-1], peak), peak, trough, first, stop, rate)
    # The shape is estimated from events of the whole recording. They are not the largest events:
    # among equal slips, noise alone decides which is the largest.
    large = np.flatnonzero(drop > np.quantile(drop, 0.9) / 2)
    large = large[np.linspace(0, large.size - 1, min(large.size, _MEASURED_EVENTS)).astype(np.intp)]
    noise = _noise(force, *(middles if k > 1 else (first, peak)))
    timing = _timing(windows.of(large), drop[large], noise, scatter)
    fits = [
        _onset_and_end(windows.of(part), timing.shape)
        for part in np.array_split(np.arange(k), -(-k // _FITTED_TOGETHER))
    ]
    onset, end, _ = (np.concatenate(values) for values in zip(*fits, strict=True))
    slow = _slow_noise_factor(windows, edges[1:-1], onset, end, sticks.slope, scatter)
    return _events_from_fits(time, force, scatter, windows, onset, end, sticks, timing, slow)


def _onset_and_end(windows: _Windows, shape: Shape) -> tuple[Float, Float, Float]:
    """Onset and end by least squares, on grids that zoom in.

    Returns
    -------
    onset, end : array, (k,)
    squares : array, (k,)
        Sum of the squares of all residuals, apart from a constant.
    """
    sums, peak, trough, first, stop, rate = windows
    length = (trough - peak).astype(float)
    middle = (peak + trough) / 2
    earliest = np.minimum(np.maximum(first + 3.0, peak - 2 * length), peak - 1.0)
    latest = np.maximum(np.minimum(stop - 3.0, trough + 2 * length), trough + 1.0)
    span_on = [earliest, np.minimum(middle + length / 4, trough - 0.5)]
    span_end = [np.maximum(middle - length / 4, peak + 0.5), latest]
    grid = np.linspace(0.0, 1.0, _CANDIDATES)
    rows = np.arange(peak.size)
    for _ in range(_ZOOMS):
        on = span_on[0][:, None] + (span_on[1] - span_on[0])[:, None] * grid
        off = span_end[0][:, None] + (span_end[1] - span_end[0])[:, None] * grid
        until, since, (high, _, before), (low, _, after) = windows.lines(on, off)
        # The slip as sums over bins, from the earliest onset to the latest end.
        edges = np.linspace(span_on[0], span_end[1] + 1.0, _BINS + 1, axis=1)
        edges = np.clip(np.rint(edges).astype(np.intp), first[:, None], stop[:, None])
        pair = np.s_[:, :, None, None], np.s_[:, None, :, None]
        # In the bins in which the slip begins or ends, only samples of the slip count.
        begin = np.maximum(edges[:, None, None, :-1], until[pair[0]])
        stops = np.maximum(np.minimum(edges[:, None, None, 1:], since[pair[1]]), begin)
        weight = stops - begin
        length_here = np.maximum(off[pair[1]] - on[pair[0]], 0.25)
        u = np.clip(((begin + stops - 1) / 2 - on[pair[0]]) / length_here, 0.0, 1.0)
        drop = high[pair[0]] - low[pair[1]]
        loaded = rate[:, None, None, None] * length_here / np.where(drop > 0, drop, np.inf)
        model = low[pair[1]] + drop * shape(u, loaded)
        misfit = (model * (weight * model - 2 * (sums.y[stops] - sums.y[begin]))).sum(-1)
        squares = sums.yy[since][:, None, :] - sums.yy[until][:, :, None]
        misfit += np.where(since[:, None, :] > until[:, :, None], squares, 0.0)
        misfit += before[:, :, None] + after[:, None, :]
        # The end comes after the onset, and the force falls.
        wrong = (off[:, None, :] <= on[:, :, None]) | (low[:, None, :] >= high[:, :, None])
        misfit[wrong] = np.inf
        best = misfit.reshape(peak.size, -1).argmin(1)
        i, j = np.unravel_index(best, (_CANDIDATES, _CANDIDATES))
        onset, end = on[rows, i], off[rows, j]
        for span, here in ((span_on, onset), (span_end, end)):
            reach = (span[1] - span[0]) / (_CANDIDATES - 1)
            span[:] = [np.maximum(here - reach, span[0]), np.minimum(here + reach, span[1])]
    squares = misfit[rows, i, j]
    return onset, end, np.where(np.isfinite(squares), squares, 0.0)


def _free_slip(u: Float, loaded: Float) -> Float:
    """A free slider at constant friction: the cosine of a phase from -a to pi + a.

    The slip joins the lines with the slope of the loading. The loading by the drive during the
    slip, over the drop, is `loaded` = (pi/2 + a) tan a.
    """
    angle = np.interp(loaded, _LOADED, _ANGLES)
    x = (np.pi + 2 * angle) * (u - 0.5)
    square = x * x
    # A polynomial for sin x, to 1e-4, takes a fifth of the time.
    sine = 1 - square / 20 * (1 - square / 42 * (1 - square / 72))
    return np.asarray(0.5 - 0.5 * x * (1 - square / 6 * sine) / np.cos(angle))


_ANGLES = np.linspace(0.0, 0.75, 64)
_LOADED = (np.pi / 2 + _ANGLES) * np.tan(_ANGLES)

#: Shapes of the slip of a slider on a spring: free at constant friction, at constant velocity,
#: damped over four time constants, with a velocity in proportion to u (1 - u), and free under a
#: drive that pauses. The force falls from 1 to 0 as u goes from 0 to 1; the second argument is the
#: loading by the drive during the slip, over the drop.
_SHAPES: tuple[Shape, ...] = (
    _free_slip,
    lambda u, _: 1 - u,
    lambda u, _: (np.exp(-4 * u) - np.exp(-4)) / (1 - np.exp(-4)),
    lambda u, _: 1 - u * u * (3 - 2 * u),
    lambda u, _: _free_slip(u, np.zeros(())),
)


@dataclass(frozen=True)
class _Timing:
    """Shape of the slips of a recording, and the uncertainty of their onsets and ends.

    Attributes
    ----------
    shape : callable
        One of `_SHAPES`.
    factor : float
        The standard uncertainty of onset or end, whichever is larger, is factor d s/D for a slip of
        d samples and drop D, where s is the scatter of means over half of the slip.
    shift : float
        Standard uncertainty of onset or end due to the unknown shape, over the duration; all slips
        have it in common.
    """

    shape: Shape
    factor: float
    shift: float


def _timing(windows: _Windows, drop: Float, noise: Autoregression, scatter: Float) -> _Timing:
    """The shape of all slips of a recording, by comparison with simulated recordings.

    For each shape, slips are simulated with noise of the recording's spectrum, and all shapes are
    fitted to them. A shape is likely if its simulated recordings have the same sums of squared
    residuals under all shapes as the recording (indirect inference: Gourieroux, Monfort and
    Renault, J. Appl. Econometrics 8, S85, 1993); correlated noise acts on both alike. Where no
    shape fits, distances are divided by the smallest.

    The true shape may lie between these shapes: that of a damped slider lies between a free slip
    and an exponential fall. Differences of sums of squares are linear in the shape. The mixture of
    shapes that reproduces the sums of the recording therefore says how late or early the best shape
    places onset and end.
    """
    # scipy.signal loads the whole of scipy.stats, which recordings without events do not need.
    from scipy.signal import lfilter

    k, first = windows.peak.size, windows.first

    def contrasts(fits: Sequence[tuple[Float, ...]], drop: Float) -> Float:
        squares = np.array([fit[2] for fit in fits])
        return (squares[1:] - squares[0]) / drop**2

    fits = [_onset_and_end(windows, shape) for shape in _SHAPES]
    seen = contrasts(fits, drop).mean(1)
    # Windows of the events, one after the other, several times.
    many = np.repeat(np.arange(k), -(-_SIMULATED_EVENTS // k))
    size = (windows.stop - first)[many]
    begin = np.concatenate([[0], np.cumsum(size)])
    event = np.repeat(np.arange(many.size), size)
    place = np.arange(begin[-1]) - begin[event] + first[many][event]
    shift = begin[:-1] - first[many]
    peak, trough, start, stop = (bound[many] + shift for bound in windows[1:5])
    rng = np.random.default_rng(0)
    taps = np.concatenate([[1.0], -noise.coefficients[-1]])
    distance, shifts, factors, means, covariances = [], [], [], [], []
    for shape, (onset, end, *_) in zip(_SHAPES, fits, strict=True):
        clean = _fitted_force(windows, shape, onset, end, place, many[event])
        settling = 10 * taps.size
        white = rng.standard_normal(settling + place.size)
        made = clean + noise.innovation * lfilter([1.0], taps, white)[settling:]
        sums = LineSums(made, begin[:-1], peak)
        simulated = _Windows(sums, peak, trough, start, stop, windows.rate[many])
        again = [_onset_and_end(simulated, each) for each in _SHAPES]
        values = contrasts(again, drop[many])
        covariance = np.atleast_2d(np.cov(values)) * (1 / k + 1 / many.size)
        means.append(values.mean(1))
        covariances.append(covariance)
        off = seen - means[-1]
        distance.append(float(off @ np.linalg.pinv(covariance, hermitian=True) @ off))
        length = (end - onset)[many]
        late = np.array(
            [[f[n] - t[many] - shift for f in again] for n, t in enumerate((onset, end))]
        )
        late /= np.maximum(length, 1.0)
        shifts.append(np.median(late, axis=2))
        unit = _scatter_of_mean(scatter, np.maximum(length, 2.0) / 2) / drop[many]
        # The standard deviation of normal values, from their 95 % quantile.
        away = np.abs(late - shifts[-1][:, :, None]) / unit
        factors.append(np.quantile(away, 0.95, axis=2).max(0) / 1.96)
    excess = max(min(distance) / (len(_SHAPES) - 1), 1.0)
    # A free slider, unless another shape is nearer by three standard errors.
    best = int(np.argmin(distance))
    best = best if distance[0] - distance[best] > 9 * excess else 0
    weight = np.exp((min(distance) - np.array(distance)) / (2 * excess))
    weight /= weight.sum()
    off_by = np.array(shifts)[:, :, best]
    variance = weight @ off_by**2
    variance = _with_mixtures(variance, means, seen, covariances[best], off_by, best)
    return _Timing(_SHAPES[best], float(factors[best][best]), float(np.sqrt(variance.max())))


def _with_mixtures(
    variance: Float, means: list[Float], seen: Float, covariance: Float, moved: Float, best: int
) -> Float:
    """Variances of onset and end, with the shifts by a shape between those of `_SHAPES`.

    Parameters
    ----------
    variance : array, (2,)
        Variances by the choice among `_SHAPES`.
    means : list of array, (shapes - 1,)
        Differences of sums of squares of the recordings simulated with each shape.
    seen : array, (shapes - 1,)
        Those of the recording.
    covariance : array, (shapes - 1, shapes - 1)
        Noise of these differences.
    moved : array, (shapes, 2)
        Shifts of onset and end of slips of each shape under the shape `best`, over the duration.
    best : int
    """
    from scipy.optimize import nnls

    # Distances between the shapes, in standard deviations of the noise.
    power, axes = np.linalg.eigh(covariance)
    known = power > 1e-12 * power[-1]
    if not known.any():  # Falls from one sample to the next have the same residuals in every shape.
        return variance
    away = np.array([*means, seen]) - means[best]
    away = away @ axes[:, known] / np.sqrt(power[known])
    # The shares of a mixture add up to one: a row of large weight.
    unit = np.full((len(means) + 1, 1), 1e3 * np.abs(away).max())
    columns = np.hstack([away, unit])
    mixture, left = nnls(columns[:-1].T, columns[-1])
    # A part that neither a mixture nor noise explains is due to an unknown shape. It is assumed
    # to move onset or end, per distance, no more than the worst of the known shapes.
    far = (away[:-1] ** 2).sum(1)
    others = np.arange(len(_SHAPES)) != best
    lever = (moved[others] ** 2 / far[others, None]).max(0)
    beyond = max(left**2 - known.sum(), 0.0) * lever
    return np.asarray(variance + (mixture @ moved) ** 2 + beyond)


def _fitted_force(
    windows: _Windows, shape: Shape, onset: Float, end: Float, place: Index, owner: Index
) -> Float:
    """Fitted force, line, slip and line, at the samples `place` of the events `owner`."""
    _, _, (high, before, _), (low, after, _) = windows.lines(onset, end)
    length = np.maximum(end - onset, 0.25)
    u = np.clip((place - onset[owner]) / length[owner], 0.0, 1.0)
    drop = np.maximum(high - low, np.finfo(float).tiny)
    slip = low[owner] + drop[owner] * shape(u, (windows.rate * length / drop)[owner])
    slip += before[owner] * np.minimum(place - onset[owner], 0.0)
    return np.asarray(slip + after[owner] * np.maximum(place - end[owner], 0.0))


def _events_from_fits(
    time: Float,
    force: Float,
    scatter: Float,
    windows: _Windows,
    onset: Float,
    end: Float,
    sticks: _Sticks,
    timing_of: _Timing,
    slow: float,
) -> SlipEvents:
    """Events with uncertainties; slow noise multiplies the uncertainties of forces by `slow`."""
    sums, first, stop = windows.sums, windows.first, windows.stop
    step = float(time[-1] - time[0]) / (force.size - 1)
    until, since, (high, before, _), (low, after, _) = windows.lines(onset, end)
    creeps = (sums.at(until - (until - first) // 2, until, onset)[0] - high).sum()
    rings = (sums.at(since, since + (stop - since) // 2, end)[0] - low).sum()
    high, low = high + sums.level, low + sums.level
    drop = high - low
    # The end of a line is twice as uncertain as its mean. Lines through half of the samples differ
    # from the whole lines where sticks bend: by creep in proportion to the loading before the slip,
    # and by a ringing gauge in proportion to the drop.
    before_error = slow * 2 * _scatter_of_mean(scatter, until - first)
    of_noise = np.hypot(before_error, slow * 2 * _scatter_of_mean(scatter, stop - since))
    # The level of a line may lie anywhere within a step of the recorder.
    rounding = recorder_step(force) / np.sqrt(6.0)
    of_noise = np.hypot(of_noise, rounding)
    rise = high - np.concatenate([low[:1], low[:-1]])
    bend = creeps / rise.sum() * rise - rings / drop.sum() * drop
    error = np.hypot(of_noise, bend)
    long = np.maximum(end - onset, 2.0)
    least = np.maximum(drop, scatter[0])
    timing = timing_of.factor * _scatter_of_mean(scatter, long / 2) / least
    # A line that ends too low meets the slip later by the same share. The factor already includes
    # the effect of noise with the spectrum of the sticks.
    slowly = np.hypot(of_noise * np.sqrt(1 - slow**-2), rounding) / least
    timing = np.linalg.norm(
        [timing, np.full_like(drop, timing_of.shift), bend / least, slowly], axis=0
    )
    timing = np.hypot(long * timing, _SAMPLING)
    # Slips unlike their shape begin earlier and end later, or the reverse.
    error = np.hypot(error, (np.abs(before) + np.abs(after)) * timing)
    reach = onset[1:] - sticks.centre
    lag_error = np.hypot(np.hypot(sticks.mean_error, sticks.slope_error * reach), before_error[1:])
    samples = np.arange(force.size, dtype=float)
    none = [np.nan]
    return SlipEvents(
        onset=np.interp(onset, samples, time),
        end=np.interp(end, samples, time),
        timing_uncertainty=timing * step,
        force_before=high,
        force_after=low,
        drop_uncertainty=error,
        loading_slope=np.concatenate([none, sticks.slope / step]),
        slope_uncertainty=np.concatenate([none, np.hypot(sticks.slope_error, sticks.bend) / step]),
        slope_bend=np.concatenate([none, sticks.bend / step]),
        creep=np.concatenate([none, sticks.mean + sticks.slope * reach - high[1:]]),
        creep_uncertainty=np.concatenate([none, lag_error]),
        fall_rate=steepest_fall(force, onset, end, drop) / step,
    )


@dataclass(frozen=True, eq=False)
class _Sticks:
    """Lines through the middle halves of the sticks between k events.

    Attributes
    ----------
    centre, mean, slope : array, (k - 1,)
        Middle of the line (samples), and its mean and slope (per sample).
    mean_error, slope_error : array, (k - 1,)
        Standard uncertainty of mean and slope due to noise.
    bend : array, (k - 1,)
        Standard uncertainty of the slope due to the curvature that all sticks have in common.
    """

    centre: Float
    mean: Float
    slope: Float
    mean_error: Float
    slope_error: Float
    bend: Float


def _sticks(force: Float, first: Index, stop: Index, scatter: Float) -> _Sticks:
    """Lines through the middle halves of sticks; lines through their halves show the curvature."""
    if not first.size:
        return _Sticks(*(np.empty(0),) * 6)
    middle = (first + stop) // 2
    sums = LineSums(force, first, middle)
    level, slope, _, away = sums.line(first, stop)
    count = (stop - first).astype(float)
    mean_error = _scatter_of_mean(scatter, count)
    # The slope of n samples has a variance of 12/n^2 of that of their mean.
    slope_error = np.sqrt(12.0) * mean_error / count
    # Slopes of halves, in white noise, differ by four times as much as the slope scatters.
    change = (sums.line(first, middle)[1] - sums.line(middle, stop)[1]) / (4 * slope_error)
    usual = np.median(change)
    slope_error = slope_error * max(1.0, float(np.median(np.abs(change - usual))) / 0.6745)
    # Creep bends the second half; its effect on the whole is of the size of the difference.
    error = np.sqrt(np.pi / 2 / first.size)
    bend = 4 * slope_error * np.sqrt(max(usual**2 - error**2, 0.0))
    mean = level + slope * away + sums.level
    return _Sticks(sums.origin + away, mean, slope, mean_error, slope_error, bend)


def _slow_noise_factor(
    windows: _Windows, edges: Index, onset: Float, end: Float, slope: Float, scatter: Float
) -> float:
    """Ratio of the true uncertainty of a drop to the uncertainty by the scatter of means.

    In the middle of a stick there is no slip, and the lines before and after should meet. Hum and
    other noise slower than a thirty-second of a cycle keep them apart.
    """
    half = (end - onset)[:-1] / 2
    # After a slip the gauge may ring, and before the next slip the slider creeps.
    margin = (onset[1:] - end[:-1]) / 8
    until, since = np.floor(edges - half).astype(np.intp), np.ceil(edges + half).astype(np.intp)
    lead = np.minimum(until - end[:-1] - margin, (onset - windows.first)[1:]).astype(np.intp)
    tail = np.minimum(onset[1:] - margin - since, (windows.stop - end)[:-1]).astype(np.intp)
    long = (lead >= _SHORTEST) & (tail >= _SHORTEST)
    if not long.any():
        return 1.0
    until, since, lead, tail = until[long], since[long], lead[long], tail[long]
    cells = np.flatnonzero(long)
    before, after = windows.sums.of(cells), windows.sums.of(cells + 1)
    high = before.at(until - lead, until, until)[0] + before.level
    low = after.at(since, since + tail, since)[0] + after.level
    drop = high - low + slope[long] * (since - until)
    error = 2 * np.hypot(_scatter_of_mean(scatter, lead), _scatter_of_mean(scatter, tail))
    # The median: some sticks hold slips that were not detected.
    return max(1.0, float(np.median(np.abs(drop) / error)) / 0.6745)


def _noise(force: Float, first: Index, stop: Index) -> Autoregression:
    """Noise about straight lines through runs of samples in sticks; short runs are left out."""
    from scipy.signal import detrend

    size = np.minimum(stop - first, _LONGEST_RUN)
    runs = np.flatnonzero(size >= np.median(size))[:: -(-size.size // _RUNS)]
    parts = [force[first[k] : first[k] + size[k]] for k in runs]
    return fitted([detrend(part) for part in parts], parameters=2 * len(parts))


def _scatter_of_mean(scatter: Float, samples: Index | Float) -> Float:
    """Scatter of means over `samples` samples, interpolated between the widths 2^j of `scatter`."""
    known = np.arange(scatter.size)
    octave = np.log2(np.maximum(samples, 1))
    inside = np.exp(np.interp(octave, known, np.log(scatter)))
    return np.asarray(inside * 2.0 ** (-np.maximum(octave - known[-1], 0.0) / 2))


def steepest_fall(force: Float, onset: Float, end: Float, drop: Float) -> Float:
    """Largest fall per sample over a quarter of the slip; for an unresolved slip, its drop.

    All slips have one shape, and the steepest quarter of their mean is used: noise would bias the
    largest rate of a single slip.

    Parameters
    ----------
    force : array, (n,)
    onset, end : array, (k,)
        Sample numbers, with fractions.
    drop : array, (k,)
    """
    total = np.concatenate([[0.0], np.cumsum(force)])
    duration = np.maximum(end - onset, 1.0)
    width = np.maximum(duration / 4, 1.0)
    places = onset[:, None] + duration[:, None] * np.linspace(0.0, 1.0, 9)
    reach = np.broadcast_to(width[:, None] / 2, places.shape)

    def mean(low: Float, high: Float) -> Float:
        first, last = (np.interp(at + 0.5, np.arange(total.size), total) for at in (low, high))
        return np.asarray((last - first) / (high - low))

    # Means over the halves before and after a place lie half a width apart.
    rate = (mean(places - reach, places) - mean(places, places + reach)) / reach
    resolved = end - onset >= 2.0
    if not resolved.any():
        return drop
    times_mean = (rate * duration[:, None])[resolved].sum(0).max() / drop[resolved].sum()
    return np.where(resolved, times_mean * drop / duration, drop)
