"""Segments of constant pulling velocity.

Laboratories step the velocity over decades, at equal slip, and often change the sampling rate with
it. A recording is therefore first divided into cells of a little slip each, a time limit for what
stands still; log velocity over cells is cut by optimal partitioning (Killick, Fearnhead and
Eckley, J. Am. Stat. Assoc. 107, 1590, 2012); and the instant of each cut is refined, first where
the lines of displacement on its two sides intersect, then by the kink of the friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Parts of a recording of which a quarter is quiet, and spans of the longest difference in a part.
_QUIET_PARTS, _PER_PART = 16, 6
#: Slip of a cell, in standard deviations of the displacement's noise; 12 tell its velocity to 12 %.
_CELL_NOISE = 12.0
_CELLS = 4000
#: A cell lasts at most this share of the recording, moving or not.
_LONGEST = 0.02
#: Neighbours with a smaller ratio of velocities are one segment; up to the second it is doubtful.
_RATIO, _CLEAR_RATIO = 1.2, 1.45
#: Of recordings with more samples than this, the lines next to a cut are fitted
#: to so many means where they hold more samples than the third number.
_LONG, _MEANS, _MANY = 20_000, 64, 1024
#: A cut must explain so many standard deviations of a cell's log velocity.
_SIGNIFICANT = 5.0
#: A piece with less than this share of its neighbours' slip and of their time is their transition.
_TRANSITION = 0.05
#: A piece after which the velocity returns to what it was is a disturbance up to this share.
_DISTURBANCE = 0.1
#: A piece of a steady rise or fall with less than this share of both its ends is a ramp.
_RAMP = 0.15
#: Unclear changes next to a piece with less than this share of the slip about them are ripple.
_RIPPLE = 0.08
#: A piece next to a larger change, with less than this share of a neighbour and up to this ratio of
#: its velocity, is the settling of a step.
_SETTLING, _SETTLING_RATIO = 0.3, 2.0
#: Pieces of so few cells, of a velocity between those of their neighbours, are transitions too.
_FEW_CELLS = 3
#: A cell that moved by less than so many standard deviations stands still.
_STILL = 3.0
#: Slower than this share of its neighbours, or within the noise, a segment is a hold...
_HOLD = 5e-3
#: ...and up to this share it might be meant as one.
_MAYBE_HOLD = 0.02


@dataclass(frozen=True)
class Cut:
    """Where a recording is cut: the time of the change, and the first sample after it.

    Attributes
    ----------
    time : float
        Seconds.
    sample : int
    doubt : float
        Twice what the noise of the displacement leaves open about the time (s); 0 where it was
        given.
    """

    time: float
    sample: int
    doubt: float = 0.0


@dataclass(frozen=True, eq=False)
class Partition:
    """A recording in segments.

    Attributes
    ----------
    cuts : tuple of Cut
    velocities : tuple of float
        m/s, signed; one more than cuts; NaN without displacement.
    holds : tuple of bool
        Which segments stand still.
    doubts : tuple of str
        Sentences on other ways to cut this recording.
    """

    cuts: tuple[Cut, ...]
    velocities: tuple[float, ...]
    holds: tuple[bool, ...]
    doubts: tuple[str, ...] = ()


def partition(time: Array, displacement: Array | None, friction: Array) -> Partition:
    """Cut a recording where its velocity changes.

    Parameters
    ----------
    time, displacement, friction : array, (n,)
        Seconds, metres or None, and a pure number.
    """
    if displacement is None:
        return Partition((), (np.nan,), (False,))
    noise = displacement_noise(time, displacement)
    edges = _cells(time, displacement, noise)
    duration, slip = np.diff(time[edges]), np.diff(displacement[edges])
    # The logarithm of what stands still is that of its noise.
    log_speed = np.log(np.maximum(np.abs(slip), _STILL * noise) / duration)
    backward = slip < -2 * _STILL * noise
    bounds = _change_points(log_speed + 20.0 * backward)
    bounds, settled = _without_transitions(time, displacement, bounds, edges, noise)
    pieces = [(int(edges[a]), int(edges[b])) for a, b in pairwise(bounds)]
    cuts = [
        _refined(time, displacement, friction, before, after, edges)
        for before, after in pairwise(pieces)
    ]
    # Two cuts may be refined towards each other.
    cuts = [c for k, c in enumerate(cuts) if not k or c.sample >= cuts[k - 1].sample + 4]
    pieces = list(pairwise([0, *(c.sample for c in cuts), time.size]))
    speeds = [_velocity(time, displacement, *p) for p in pieces]
    doubts = settled + _small_changes(time, pieces, speeds)
    # What moves by no more than noise is a stop, however slow the pieces next to it are.
    speeds = _without_rounding(time, pieces, speeds, noise)
    holds, unsure = _holds(time, displacement, pieces, speeds, noise)
    return Partition(tuple(cuts), tuple(speeds), tuple(holds), tuple(doubts + unsure))


def partition_at(time: Array, displacement: Array | None, times: Array) -> Partition:
    """Cut a recording at given times.

    Parameters
    ----------
    time, displacement : array, (n,)
    times : array, (cuts,)
        Seconds, inside the recording.
    """
    at = np.searchsorted(time, times)
    cuts = tuple(Cut(float(t), int(i)) for t, i in zip(times, at, strict=True))
    if displacement is None:
        return Partition(cuts, (np.nan,) * (len(cuts) + 1), (False,) * (len(cuts) + 1))
    noise = displacement_noise(time, displacement)
    bounds = [0, *at.tolist(), time.size]
    pieces = list(pairwise(bounds))
    speeds = [_velocity(time, displacement, *p) for p in pieces]
    holds, _ = _holds(time, displacement, pieces, speeds, noise)
    speeds = _without_rounding(time, pieces, speeds, noise)
    return Partition(cuts, tuple(speeds), tuple(holds))


def displacement_noise(time: Array, displacement: Array) -> float:
    """Standard deviation of a displacement's noise (m), its resolution included.

    From second differences at even steps of time, which velocity does not touch and its changes
    hardly. Noise of a gauge is correlated over many samples, hums and wanders: neighbours are
    nearer to each other than samples far apart. Differences are therefore taken over 1, 2, 4, ...
    samples, and the largest counts, each in the quietest parts of the recording, where the motion
    is even or rests.
    """
    moved = np.abs(np.diff(displacement))
    smallest = float(moved[moved > 0].min()) if moved.any() else 0.0
    spread, lag = 0.0, 1
    while True:
        spread = max(spread, _spread_over(time, displacement, lag))
        lag *= 2
        if lag * _QUIET_PARTS * _PER_PART > time.size:
            break
    # Of a coarse recorder most differences are zero: its step is the noise.
    stands = moved.size and float(np.mean(moved == 0)) > 0.2
    floor = 1e-9 * float(np.ptp(displacement)) + 1e-300
    return max(spread, smallest / np.sqrt(12) if stands else 0.0, floor)


def _spread_over(time: Array, displacement: Array, lag: int) -> float:
    """Standard deviation of samples so far apart about even motion, in the quietest parts."""
    t, x = (values[:: max(1, lag // 4)] for values in (time, displacement))
    k = min(lag, 4)
    if t.size <= 2 * k:
        return 0.0
    before, after = t[k:-k] - t[: -2 * k], t[2 * k :] - t[k:-k]
    second = np.abs(x[2 * k :] - 2 * x[k:-k] + x[: -2 * k])[np.abs(after - before) < 0.05 * after]
    if not second.size:
        return 0.0
    parts = np.array_split(second, max(1, min(_QUIET_PARTS, second.size // (4 * _PER_PART))))
    usual = np.sort([np.median(part) for part in parts])
    return float(usual[usual.size // 4]) * 1.4826 / np.sqrt(6)


def _cells(time: Array, displacement: Array, noise: float) -> NDArray[np.intp]:
    """Samples that bound the cells, the first and the last one among them."""
    path = float(np.sum(np.abs(np.diff(displacement[:: max(1, time.size // 20_000)]))))
    size = max(_CELL_NOISE * noise, path / _CELLS)
    longest = max(_LONGEST * float(time[-1] - time[0]), 4 * float(np.median(np.diff(time))))
    edges = [0]
    at, n = 0, time.size
    while at < n - 1:
        latest = int(np.searchsorted(time, time[at] + longest))
        stop = min(max(latest, at + 3), n - 1)
        reach = 64
        # The first sample that is far enough, looked for in growing pieces.
        edge, begin = stop, at + 3
        while begin < stop:
            end = min(begin + reach, stop)
            far = np.abs(displacement[begin:end] - displacement[at]) >= size
            if far.any():
                edge = begin + int(np.argmax(far))
                break
            begin, reach = end, 4 * reach
        at = edge
        edges.append(at)
    if len(edges) > 2 and edges[-1] - edges[-2] < 3:
        del edges[-2]
    return np.array(edges, dtype=np.intp)


def _change_points(series: Array) -> list[int]:
    """Optimal partitioning of a series into pieces of constant level, both ends included."""
    n = series.size
    if n < 2:
        return [0, n]
    scatter = 1.4826 * float(np.median(np.abs(np.diff(series)))) / np.sqrt(2)
    scatter = max(scatter, 0.05)
    penalty = (_SIGNIFICANT * scatter) ** 2 * (1 + np.log(n) / 10)
    sums = np.concatenate([[0.0], np.cumsum(series)])
    squares = np.concatenate([[0.0], np.cumsum(series**2)])
    best = np.full(n + 1, np.inf)
    best[0] = -penalty
    last = np.zeros(n + 1, dtype=np.intp)
    starts = np.array([0], dtype=np.intp)
    for end in range(1, n + 1):
        count = end - starts
        cost = squares[end] - squares[starts] - (sums[end] - sums[starts]) ** 2 / count
        total = best[starts] + cost + penalty
        at = int(np.argmin(total))
        best[end], last[end] = total[at], starts[at]
        # A start that is worse than the best by the penalty can never become the best.
        starts = np.append(starts[total - penalty <= best[end]], end)
    bounds = [n]
    while bounds[-1] > 0:
        bounds.append(int(last[bounds[-1]]))
    return bounds[::-1]


def _velocity(time: Array, displacement: Array, first: int, stop: int) -> float:
    """Slope of displacement over a piece, m/s; parts of equal time count equally."""
    t, x = time[first:stop], displacement[first:stop]
    if t.size < 2:
        return np.nan
    if t.size > 400:
        at = np.linspace(t[0], t[-1], 201)
        x, t = np.interp(at, t, x), at
    away = t - t.mean()
    return float(away @ (x - x.mean()) / (away @ away))


def _without_transitions(
    time: Array,
    displacement: Array,
    bounds: list[int],
    edges: NDArray[np.intp],
    noise: float,
) -> tuple[list[int], list[str]]:
    """Bounds of pieces, in cells, without transitions and small changes; and doubts."""
    bounds, doubts = list(bounds), []
    while len(bounds) > 2:
        at = [int(edges[b]) for b in bounds]
        duration = np.diff(time[at])
        path = np.abs(np.diff(displacement[at]))
        speeds = [_velocity(time, displacement, a, b + 1) for a, b in pairwise(at)]
        transition = _transition(bounds, duration, path, speeds, noise)
        if transition is not None:
            k, near, share = transition
            if share > _DISTURBANCE:
                doubts.append(
                    f"{duration[k]:.3g} s at {1e6 * abs(speeds[k]):.3g} um/s from "
                    f"{time[at[k]]:.6g} s on are read as the settling of a step, and may be a "
                    "segment"
                )
            del bounds[max(k, near)]
            continue
        ratios = np.array([_log_ratio(a, b) for a, b in pairwise(speeds)])
        ratios[_of_ripple(ratios, path)] = 0.0
        ratios[_of_one_stop(np.array(speeds), duration, noise)] = 0.0
        least = int(np.argmin(ratios))
        if ratios[least] >= np.log(_RATIO):
            break
        del bounds[least + 1]
    return bounds, doubts


def _of_ripple(ratios: Array, path: Array) -> NDArray[np.bool_]:
    """Unclear changes next to a piece with little of the slip at about its velocity."""
    unclear = ratios < np.log(_CLEAR_RATIO)
    # Pieces between clear changes are one group.
    group = np.concatenate([[0], np.cumsum(~unclear)])
    share = path / np.maximum(np.bincount(group, path)[group], 1e-300)
    return np.asarray(unclear & (np.minimum(share[1:], share[:-1]) < _RIPPLE))


def _of_one_stop(speeds: Array, duration: Array, noise: float) -> NDArray[np.bool_]:
    """Changes within one stop: noise moves both pieces, or a gauge that wanders to and fro.

    What wanders is slow as a hold is: the next faster pieces on both sides say.
    """
    speed = np.abs(speeds)
    still = speed * duration <= 2 * _STILL * noise
    one = still[1:] & still[:-1]
    for k in np.flatnonzero((still[1:] | still[:-1] | (speeds[1:] * speeds[:-1] < 0)) & ~one):
        fastest = max(speed[k], speed[k + 1])
        sides = (side[side > fastest] for side in (speed[:k][::-1], speed[k + 2 :]))
        faster = [float(side[0]) for side in sides if side.size]
        one[k] = bool(faster) and fastest < _HOLD * min(faster)
    return np.asarray(one)


def _share_of_ramp(
    k: int, duration: Array, path: Array, speeds: list[float], noise: float
) -> float:
    """Share that a piece has of the largest pieces at the two ends of its change of velocity."""
    rising = abs(speeds[k + 1]) > abs(speeds[k])
    ends = []
    for step in (-1, 1):
        j, largest = k + step, [0.0, 0.0]
        towards = rising if step > 0 else not rising
        last = abs(speeds[k])
        while 0 <= j < len(speeds) and (abs(speeds[j]) > last) == towards:
            largest = [max(largest[0], float(duration[j])), max(largest[1], float(path[j]))]
            last, j = abs(speeds[j]), j + step
        ends.append(largest)
    span, slid = (min(end[n] for end in ends) for n in (0, 1))
    return float(max(duration[k] / max(span, 1e-300), path[k] / max(slid, 10 * noise)))


def _transition(
    bounds: list[int], duration: Array, path: Array, speeds: list[float], noise: float
) -> tuple[int, int, float] | None:
    """The least of the transitions, the neighbour to join it to, and its share of that."""
    least: tuple[int, int, float] | None = None
    for k in range(len(speeds)):
        neighbours = [j for j in (k - 1, k + 1) if 0 <= j < len(speeds)]
        speed = abs(speeds[k])
        if len(neighbours) == 2 and speed < 0.2 * min(abs(speeds[j]) for j in neighbours):
            continue  # a stop is no transition, however short
        spans, paths = (
            [float(duration[j]) for j in neighbours],
            [float(path[j]) for j in neighbours],
        )
        same = len(neighbours) == 2 and _log_ratio(speeds[k - 1], speeds[k + 1]) < np.log(_RATIO)
        span, slid = (sum(spans), sum(paths)) if same else (min(spans), min(paths))
        share = max(duration[k] / max(span, 1e-300), path[k] / max(slid, 10 * noise))
        between = len(neighbours) == 2 and min(abs(speeds[j]) for j in neighbours) < speed < max(
            abs(speeds[j]) for j in neighbours
        )
        if between:
            share = min(share, _share_of_ramp(k, duration, path, speeds, noise))
        few = between and bounds[k + 1] - bounds[k] <= _FEW_CELLS
        near = min(neighbours, key=lambda j: _log_ratio(speeds[k], speeds[j]))
        # Displacement of the contact, not of the machine, overshoots and settles after a step.
        relative = max(
            duration[k] / max(duration[near], 1e-300), path[k] / max(path[near], 10 * noise)
        )
        settles = (
            len(neighbours) == 2
            and relative < _SETTLING
            and _log_ratio(speeds[k], speeds[near]) < np.log(_SETTLING_RATIO)
            and _log_ratio(speeds[k], speeds[near])
            < 0.7 * max(_log_ratio(speeds[k], speeds[j]) for j in neighbours)
        )
        limit = _RAMP if between else _DISTURBANCE if same else _TRANSITION
        if share < limit or few:
            relative = 0.0
        elif not settles:
            continue
        if least is None or relative < least[2]:
            least = k, near, float(relative)
    return least


def _small_changes(time: Array, pieces: list[tuple[int, int]], speeds: list[float]) -> list[str]:
    return [
        f"the velocity changes by a factor of {np.exp(_log_ratio(a, b)):.3g} only at "
        f"{time[first]:.6g} s, which may be no step"
        for (a, b), (first, _) in zip(pairwise(speeds), pieces[1:], strict=True)
        if _log_ratio(a, b) < np.log(_CLEAR_RATIO)
    ]


def _log_ratio(a: float, b: float) -> float:
    """Log of the ratio of two speeds; infinite where they differ in direction."""
    small, large = sorted((abs(a), abs(b)))
    if large <= 0:
        return 0.0
    if a * b < 0 and small > 0.05 * large:
        return np.inf
    return float(np.log(large / max(small, 1e-12 * large)))


def _refined(
    time: Array,
    displacement: Array,
    friction: Array,
    before: tuple[int, int],
    after: tuple[int, int],
    edges: NDArray[np.intp],
) -> Cut:
    """The instant of a change of velocity."""
    cut = after[0]
    cell = int(np.searchsorted(edges, cut))
    lines = []
    first, last = (int(np.searchsorted(edges, end)) for end in (before[0], after[1]))
    if time.size > _LONG:
        # The cells at the ends of a piece, long ones in a hold, may hold a part of the next one.
        first, last = first + (first > 0), last - (last < edges.size - 1)
    sides = (
        (before, int(edges[max(cell - 8, first)]), int(edges[max(cell - 1, 0)])),
        (after, int(edges[min(cell + 1, edges.size - 1)]), int(edges[min(cell + 8, last)])),
    )
    for piece, low, high in sides:
        if high - low < 4 or low < piece[0] or high > piece[1]:
            # A piece of few cells, such as a short hold: all but its ends.
            margin = (piece[1] - piece[0]) // 5
            low, high = piece[0] + margin, piece[1] - margin
        if high - low < 4:
            return Cut(float(time[cut]), cut)
        t, x = time[low:high], displacement[low:high]
        slope = _velocity(time, displacement, low, high)
        middle = float(t.mean())
        left = x - x.mean() - slope * (t - middle)
        if time.size > _LONG and left.size > _MANY:
            # Of many samples, what counts is the scatter of their means.
            left = left[: left.size // _MEANS * _MEANS].reshape(_MEANS, -1).mean(axis=1)
        lines.append((slope, float(x.mean()) - slope * middle, float(left.std()), low, high))
    (v1, c1, s1, low, _), (v2, c2, s2, _, high) = lines
    if v1 == v2:
        return Cut(float(time[cut]), cut)
    at = (c1 - c2) / (v2 - v1)
    if not time[low] < at < time[high - 1]:
        at = float(time[cut])
    doubt = 2 * float(np.hypot(s1, s2)) / abs(v2 - v1)
    at = _kink_of_friction(
        time, friction, at, doubt, float(time[before[0]]), float(time[after[1] - 1])
    )
    sample = int(np.clip(np.searchsorted(time, at), before[0] + 4, after[1] - 4))
    return Cut(at, sample, doubt)


def _kink_of_friction(
    time: Array, friction: Array, at: float, doubt: float, first: float, last: float
) -> float:
    """The time near `at` at which friction begins to change; `at` if none stands out."""
    near = int(np.searchsorted(time, at))
    steps = np.diff(time[max(near - 12, 0) : near + 12])
    if not steps.size or doubt < float(steps.min()):
        return at
    reach = 2 * doubt
    low, high = max(at - 6 * reach, first), min(at + 4 * reach, last)
    a, b = np.searchsorted(time, [low, high])
    t, f = time[a:b], friction[a:b]
    calm = t < at - reach
    if t.size < 16 or calm.sum() < 3:
        return at
    # Up to the peak friction leaves its level in one direction.
    away = np.abs(np.convolve(f - np.median(f[calm]), np.ones(3) / 3, mode="same"))
    away[calm] = 0.0
    peak = max(int(np.argmax(away)) + 1, int(calm.sum()) + 8)
    t, f = t[:peak], f[:peak]
    if t.size < 12:
        return at
    tried = np.linspace(max(at - reach, t[2]), min(at + reach, t[-4]), 61)
    best, kink = np.inf, at
    level = float(np.sum((f - np.polyval(np.polyfit(t - at, f, 1), t - at)) ** 2))
    for begin in tried:
        turn = np.clip(t - begin, 0, None)
        # A straight beginning that may bend: the peak may lie within reach.
        columns = np.stack([np.ones_like(t), turn, turn**2], axis=1)
        beta, *_ = np.linalg.lstsq(columns, f)
        misfit = float(np.sum((f - columns @ beta) ** 2))
        if misfit < best:
            best, kink = misfit, float(begin)
    # Correlated noise makes a kink too: half of the scatter has to go.
    return kink if best < 0.5 * level else at


def _holds(
    time: Array,
    displacement: Array,
    pieces: list[tuple[int, int]],
    speeds: list[float],
    noise: float,
) -> tuple[list[bool], list[str]]:
    holds, doubts = [], []
    for k, (first, stop) in enumerate(pieces):
        neighbours = [abs(speeds[j]) for j in (k - 1, k + 1) if 0 <= j < len(speeds)]
        if not neighbours:
            holds.append(False)
            continue
        share = abs(speeds[k]) / max(min(neighbours), 1e-300)
        moved = abs(float(displacement[stop - 1] - displacement[first]))
        still = share < _HOLD or (share < 0.2 and moved < _CELL_NOISE * noise)
        holds.append(bool(still))
        if not still and share < _MAYBE_HOLD:
            doubts.append(
                f"from {time[first]:.6g} s on the velocity is {100 * share:.2g} % of its "
                "neighbours': read as sliding, it may be meant as a hold"
            )
    return holds, doubts


def _without_rounding(
    time: Array, pieces: list[tuple[int, int]], speeds: list[float], noise: float
) -> list[float]:
    """Velocities, zero where the displacement moves by no more than its noise."""
    kept = []
    for (first, stop), speed in zip(pieces, speeds, strict=True):
        moved = abs(speed) * float(time[stop - 1] - time[first])
        kept.append(0.0 if moved <= 2 * _STILL * noise else speed)
    return kept
