"""Where the force falls: peaks and troughs that noise does not make, at every width of averages."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from asperity.arrays import Float, Index
from asperity.measurement.stick_slip.noise import Noise

#: Means over an eighth of a cycle still show its peak and trough; changes that last for less than a
#: thirty-second of a cycle are noise.
_PER_CYCLE, _PER_CYCLE_OF_NOISE = 8, 32
#: Number of rises on each side of an event from which its usual loading slope is computed.
_NEAR = 10
#: Quantile, by time, of the slopes of rises that is the usual loading slope.
_LOADING = 0.75
#: In symmetrical noise half of the rises last longer than the falls next to them. An excess of this
#: many standard deviations shows loading and slip.
_ASYMMETRY = 3.0
#: The narrowest width of means is chosen whose ratio of rises to falls is within this factor of the
#: largest ratio.
_BLUNTER = 3.0

#: Cycles of an oscillation scatter by less than this share, cycles of noise by a half or more; and
#: smallest number of cycles for this decision.
_REGULAR, _FEWEST_CYCLES = 0.25, 8


def turning_points(values: Float, height: float) -> Index:
    """Alternating maxima and minima between which the values rise and fall by `height` or more.

    Parameters
    ----------
    values : array, (n,)
    height : float

    Returns
    -------
    int array
        Positions in rising order, first and last point included where they are extreme.

    Notes
    -----
    The smallest rise or fall goes first, with both its ends, until all are `height` or more:
    extremes of persistence `height`. Every pass removes all that are smaller than their neighbours.
    """
    step = np.diff(values)
    changing = np.flatnonzero(step)
    up = step[changing] > 0
    turns = changing[:-1][up[1:] != up[:-1]] + 1
    at = np.concatenate([[0], turns, changing[-1:] + 1]).astype(np.intp)
    while at.size > 1:
        size = np.abs(np.diff(values[at]))
        sides = np.pad(size, 1, constant_values=np.inf)
        small = np.flatnonzero((size < height) & (size <= sides[:-2]) & (size < sides[2:]))
        if not small.size:
            break
        at = np.delete(at, np.concatenate([small, small + 1]))
    return at


@dataclass(frozen=True)
class Falls:
    """Falls of the force, in rising order.

    Attributes
    ----------
    peak, trough : int array, (k,)
        Samples.
    scatter : array, (m,)
        Standard deviation of means over 2^j samples.
    thresholds : array, (m,)
        Smallest fall between such means that is no noise.
    evidence : int
        Evidence for loading and slip, against a symmetrical signal: 3 if there are many falls and
        rises last more than twice as long; 2 if rises last longer, but less than twice as long or
        with few falls; 1 if falls come back regularly; otherwise 0.
    """

    peak: Index
    trough: Index
    scatter: Float
    thresholds: Float
    evidence: int

    def __len__(self) -> int:
        return self.peak.size


def find_falls(force: Float, noise: Noise) -> Falls:
    """Every fall of the force that noise does not explain.

    Parameters
    ----------
    force : array, (n,)
        Evenly sampled, without impulses.
    noise : Noise

    Notes
    -----
    Noise as slow as the cycles cannot be distinguished from them. First the shortest width of means
    is chosen at which falls are at least eight widths apart and either follow longer rises or come
    back regularly, as in an oscillation. Then the falls of means of all widths up to an eighth of
    that cycle are collected. Where falls of several widths overlap, those of the width that
    resolves most falls are kept.
    """
    most, candidates, averages = noise.longest, [], _Averages(force, noise)
    for octave in range(most + 1):
        scatter = noise.of_means(octave, octave)
        falls = averages.falls(octave, scatter[octave], 0.0)
        if falls[0].size and _cycle(*falls, force.size) >= _PER_CYCLE << octave:
            candidates.append((*_evidence(*falls), octave, falls))
    evidence = max((c[0] for c in candidates), default=0)
    if evidence:
        likely = [c for c in candidates if c[0] == evidence]
        ratio = max(c[1] for c in likely)
        _, _, octave, falls = next(c for c in likely if c[1] > ratio / _BLUNTER)
        return _at_all_widths(averages, noise, octave, falls, evidence)
    empty = np.empty(0, dtype=np.intp)
    scatter = noise.of_means(most, most)
    return Falls(empty, empty, scatter, _thresholds(noise, scatter), 0)


def _thresholds(noise: Noise, scatter: Float) -> Float:
    return np.array([noise.threshold(s, 1 << k) for k, s in enumerate(scatter)])


def _cycle(peak: Index, trough: Index, samples: int) -> float:
    """Median number of samples from peak to peak; of a single event the shorter rise next to it."""
    if peak.size > 1:
        return float(np.median(np.diff(peak)))
    return float(min(peak[0], samples - trough[0]))


def _evidence(peak: Index, trough: Index) -> tuple[int, float]:
    """Evidence for loading and slip, as of `Falls`, and the ratio of rises to falls in duration.

    Falls of noise are as long as its rises, except for a slow loading under the noise; sticks of
    many events are at least twice as long as slips.
    """
    fall = trough - peak
    rise = peak - np.concatenate([[0], trough[:-1]])
    ratio = float(np.median(rise)) / float(np.median(fall))
    many = peak.size >= _ASYMMETRY**2
    longer = int((rise > fall).sum()) - peak.size / 2 > _ASYMMETRY * np.sqrt(peak.size) / 2
    if many and longer and ratio > 2:
        return 3, ratio
    # A single event has a rise on each side.
    if longer if many else ratio > 4:
        return 2, ratio
    # The peaks of a symmetrical signal may come back regularly.
    cycles = np.diff(peak)
    if cycles.size < _FEWEST_CYCLES:
        return 0, ratio
    low, middle, high = np.quantile(cycles, [0.16, 0.5, 0.84])
    return int((high - low) / 2 < _REGULAR * middle), ratio


class _Averages:
    """Means of a force over 1, 2, 4, ... samples, and their falls, each computed once."""

    def __init__(self, force: Float, noise: Noise) -> None:
        self.force, self._noise = force, noise
        self._total = np.concatenate([[0.0], np.cumsum(force - force.mean())])
        self.means, self.falls = cache(self._means), cache(self._falls)

    def _means(self, octave: int) -> tuple[Float, int]:
        """Means over 2^octave samples, and the samples from one to the next."""
        width = 1 << octave
        hop = max(1, width // 4)
        return (self._total[width::hop] - self._total[:-width:hop]) / width, hop

    def _falls(self, octave: int, scatter: float, tilt: float) -> tuple[Index, Index]:
        """Peaks and troughs of means, without those at the ends of the recording.

        `tilt` is the rate of fall, per sample, below which the slider counts as sticking.
        """
        means, hop = self.means(octave)
        if tilt:
            means = means + tilt * hop * np.arange(means.size)
        at = turning_points(means, self._noise.threshold(scatter, 1 << octave))
        if at.size < 2:
            return at[:0], at[:0]
        falling = np.flatnonzero(np.diff(means[at]) < 0)
        peak, trough = at[falling], at[falling + 1]
        inside = (peak > 0) & (trough < means.size - 1)
        centre = ((1 << octave) - 1) // 2
        return peak[inside] * hop + centre, trough[inside] * hop + centre


def _at_all_widths(
    averages: _Averages, noise: Noise, octave: int, first: tuple[Index, Index], evidence: int
) -> Falls:
    """Falls at all widths up to an eighth of a cycle.

    The cycle becomes longer as false falls disappear, so that each round adds wider means.
    """
    most, longest, (peak, trough) = noise.longest, -1, first
    force = averages.force
    while True:
        cycle = _cycle(peak, trough, force.size)
        wider = min(max(octave, _octave(cycle / _PER_CYCLE)), most)
        if wider <= longest:
            break
        longest = wider
        scatter = noise.of_means(longest, max(octave, _octave(cycle / _PER_CYCLE_OF_NOISE)))
        thresholds = _thresholds(noise, scatter)
        # Means that are long make falls longer than slips.
        tilt = _tilt(force, *_steep_part(averages, peak, trough, thresholds))
        sets = [
            averages.falls(k, scatter[k], tilt) for tilt in (0.0, tilt) for k in range(longest + 1)
        ]
        if not any(p.size for p, _ in sets):
            peak = trough = np.empty(0, dtype=np.intp)
            break
        peak, trough = _without_ringing(force, *_most_resolved(sets))
    return Falls(*_steep_part(averages, peak, trough, thresholds), scatter, thresholds, evidence)


def _steep_part(
    averages: _Averages, peak: Index, trough: Index, thresholds: Float
) -> tuple[Index, Index]:
    """Falls from where they leave their upper quarter to where they reach their lower quarter.

    The highest mean of a stick that loads slowly may lie far before the fall. The means are the
    shortest whose noise is below half of the fall, or else the shortest that show the fall. The
    result is longer by half of the distance between the quarters on each side.
    """
    peak, trough = peak.copy(), trough.copy()
    octave = np.full(peak.size, -1)
    for clear, k in product((2.0, 1.0), range(thresholds.size)):
        means, hop = averages.means(k)
        half = ((1 << k) - 1) // 2
        last = means.size - 1
        high, low = (np.clip((at - half) // hop, 0, last) for at in (peak, trough))
        drop = means[high] - means[low]
        new = np.flatnonzero((octave < 0) & (drop > clear * thresholds[k]) & (low > high))
        if not new.size:
            continue
        octave[new] = k
        high, low, drop = high[new], low[new], drop[new]
        # For each mean, the last fall that begins before it.
        cells = np.diff(high[1:], prepend=0, append=means.size)
        below = np.flatnonzero(means <= np.repeat(means[low] + drop / 4, cells))
        below = below[np.searchsorted(below, high)]
        above = np.flatnonzero(means >= np.repeat(means[high] - drop / 4, cells))
        above = above[np.searchsorted(above, below) - 1]
        reach = (below - above) // 2 + 1
        peak[new] = np.maximum((above - reach) * hop + half, peak[new])
        trough[new] = np.minimum((below + reach) * hop + half, trough[new])
    return peak, trough


def _octave(samples: float) -> int:
    return int(np.log2(max(samples, 1.0)))


def _tilt(force: Float, peak: Index, trough: Index) -> float:
    """Rate of fall between those of loading and of slip, per sample.

    The geometric mean of both: a pause in a fall is as far from loading as from slip.
    """
    fall = float(np.median((force[peak] - force[trough]) / (trough - peak)))
    if peak.size < 2:
        return 0.0
    wait = np.maximum(peak[1:] - trough[:-1], 1)
    rise = float(np.median((force[peak[1:]] - force[trough[:-1]]) / wait))
    return max(np.sqrt(max(rise * fall, 0.0)) - rise, 0.0)


def _most_resolved(sets: list[tuple[Index, Index]]) -> tuple[Index, Index]:
    """Of overlapping falls, those of the set that has most of them."""
    peak = np.concatenate([p for p, _ in sets])
    trough = np.concatenate([t for _, t in sets])
    origin = np.repeat(np.arange(len(sets)), [p.size for p, _ in sets])
    order = np.argsort(peak, kind="stable")
    peak, trough, origin = peak[order], trough[order], origin[order]
    latest = np.maximum.accumulate(trough)
    cluster = np.cumsum(np.concatenate([[True], peak[1:] >= latest[:-1]])) - 1
    counts = np.zeros((cluster[-1] + 1, len(sets)), int)
    np.add.at(counts, (cluster, origin), 1)
    kept = origin == counts.argmax(1)[cluster]
    return peak[kept], trough[kept]


def _without_ringing(force: Float, peak: Index, trough: Index) -> tuple[Index, Index]:
    """Join falls between which the force rises faster than the spring can load.

    The slider does not move backwards: a rise twice as fast as the loading around it is ringing of
    the instrument. The loading has the slope that rises exceed for a quarter of the time.
    """
    if peak.size < 3:
        return peak, trough
    length = np.maximum(peak[1:] - trough[:-1], 1).astype(float)
    # Noise decides where peaks and troughs are: the slope is fitted to all samples between them.
    first, stop = trough[:-1], peak[1:] + 1
    rate = LineSums(force, first, (first + stop) // 2).line(first, stop)[1]
    near = np.arange(rate.size)[:, None] + np.arange(-_NEAR, _NEAR + 1)
    inside = (near >= 0) & (near < rate.size)
    near = np.clip(near, 0, rate.size - 1)
    rates, weights = rate[near], np.where(inside, length[near], 0.0)
    order = np.argsort(rates, axis=1)
    weights = np.take_along_axis(weights, order, 1).cumsum(1)
    fast = (weights >= _LOADING * weights[:, -1:]).argmax(1)
    usual = np.take_along_axis(rates, order, 1)[np.arange(rate.size), fast]
    apart = rate <= 2 * usual
    return peak[np.concatenate([[True], apart])], trough[np.concatenate([apart, [True]])]


class LineSums:
    """Running sums from which the line of least squares through any run of samples follows.

    Times and forces of each event's cell are counted from its middle, so that squares of long
    recordings lose no digits.
    """

    def __init__(self, force: Float, edges: Index, origin: Index) -> None:
        # What lies before the first edge belongs to the first cell.
        inner = np.minimum(edges[1:], force.size)
        cells = np.append(inner, force.size) - np.append(0, inner)
        t = np.arange(force.size) - np.repeat(origin.astype(float), cells)
        y = force - np.repeat(force[origin], cells)
        self.origin, self.level = origin.astype(float), force[origin]
        self.t, self.tt, self.y, self.ty, self.yy = (
            np.concatenate([[0.0], np.cumsum(v)]) for v in (t, t * t, y, t * y, y * y)
        )

    def of(self, part: Index) -> LineSums:
        """The sums with the cells of some events only."""
        some = copy(self)
        some.origin, some.level = self.origin[part], self.level[part]
        return some

    def at(self, first: Index, stop: Index, place: Float | Index) -> tuple[Float, Float, Float]:
        """Height of the line at a place (samples) less `level`, its slope and squared residuals.

        Parameters
        ----------
        first, stop, place : array, (k, ...)
            The run is inside one cell.
        """
        level, slope, squares, _ = self.line(first, stop)
        origin = self.origin.reshape(-1, *[1] * (place.ndim - 1))
        return level + slope * (place - origin), slope, squares

    def line(self, first: Index, stop: Index) -> tuple[Float, Float, Float, Float]:
        """Level and slope at the origin of the cell, sum of squared residuals, mean of t.

        `first` and `stop` bound runs inside one cell each.
        """
        n = (stop - first).astype(float)
        t, tt, y, ty, yy = (s[stop] - s[first] for s in (self.t, self.tt, self.y, self.ty, self.yy))
        n = np.maximum(n, 1.0)
        power = np.maximum(tt - t * t / n, 1e-9)
        slope = (ty - t * y / n) / power
        squares = yy - y * y / n - slope * (ty - t * y / n)
        return (y - slope * t) / n, slope, np.maximum(squares, 0.0), t / n
