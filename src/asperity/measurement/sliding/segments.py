"""Segments of constant pulling velocity: where the velocity steps, and where the drive holds.

The displacement is cut into lines and parabolas by `asperity.measurement.sliding.change_points`,
whose model leaves out that a motor does not run evenly and needs time to change its velocity.
Therefore neighbouring pieces of nearly the same velocity become one segment, and short pieces
between two segments become a transition between them. A cut lies where the lines on its two sides
intersect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from asperity.arrays import Float
from asperity.errors import require
from asperity.measurement.levels_and_trends import (
    Rate,
    bin_means,
    fit_trend,
    neighbour_scatter,
    slope_of,
)
from asperity.measurement.sliding.change_points import (
    FEWEST,
    MEANS,
    Piece,
    RecordedDisplacement,
    pieces_of,
    recorded_displacement,
)

#: Neighbouring pieces whose velocities have a smaller ratio are one segment; with a ratio between
#: the two numbers it is doubtful whether they are one segment or two.
_RATIO, _CLEAR_RATIO = 1.2, 1.45
#: Pieces between two segments are a transition if they take less than the first share of the time
#: and the slip of both segments. If their velocity changes as in a ramp, the second share is the
#: limit, and above the first share the transition is doubtful.
_TRANSITION, _RAMP = 0.15, 0.5
#: A piece whose velocity does not lie between those of its neighbours is an overshoot below this
#: share.
_OVERSHOOT = 0.05
#: Two lines are intersected over lengths at whose ends they differ by this multiple of the noise.
_LINE = 50.0
#: A segment that moves by at most this multiple of the noise is at rest.
_STILL = 6.0
#: A gauge jumps between two parts of a segment if the displacement changes there by more than this
#: multiple of the noise. A spike of friction looks alike: in 9 of 482 segments of
#: `benchmarks.hostile_sliding`, whose gauges do not jump, a jump is found.
_JUMP = 10.0
#: A segment slower than this share of its neighbours' velocity is a hold, unless it slides
#: steadily.
_HOLD = 5e-3
#: The displacement contradicts a velocity of the user that differs from it by more than this share.
_OTHER_VELOCITY = 0.05
#: It contradicts a hold of the user in which it has at least this share of the velocity next to it.
#: A slider creeps in a short hold, but slower.
_MOVES = 0.5


@dataclass(frozen=True)
class Cut:
    """Where a recording is cut.

    Attributes
    ----------
    time : float
        Time of the change of velocity (s).
    sample : int
        The first sample after this time.
    doubt : float
        Twice the standard uncertainty of the time (s) from the noise of the displacement; 0 for a
        time from the user.
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
    rates : tuple of Rate
        Measured velocities with their uncertainties; empty if the user gives the velocities, and
        without displacement.
    """

    cuts: tuple[Cut, ...]
    velocities: tuple[float, ...]
    holds: tuple[bool, ...]
    doubts: tuple[str, ...] = ()
    rates: tuple[Rate, ...] = ()


def partition(time: Float, displacement: Float | None) -> Partition:
    """Cut a recording where its velocity changes.

    Parameters
    ----------
    time, displacement : array, (n,)
        Seconds, and metres or None.
    """
    if displacement is None:
        return Partition((), (np.nan,), (False,))
    motion = recorded_displacement(time, displacement)
    pieces, parts, doubts = _segments(motion, pieces_of(motion))
    cuts = tuple(_intersection(motion, before, after) for before, after in pairwise(pieces))
    # A piece may hold samples from beyond the cut.
    between = pairwise([0, *(cut.sample for cut in cuts), time.size])
    rates = [_mean_velocity(motion, *each) for each in zip(parts, between, strict=True)]
    speeds, holds, unsure = _speeds(motion, pieces, [rate.value for rate in rates])
    return Partition(cuts, speeds, holds, (*doubts, *unsure), tuple(rates))


def require_cuts(time: Float, cuts: Sequence[float], label: str) -> None:
    """Refuse times of the user that do not cut a recording into segments.

    Parameters
    ----------
    time : array, (n,)
    cuts : sequence of float
        Seconds.
    label : str
        Name of the argument.

    Raises
    ------
    InputError
        If a time lies outside of the recording, or there are too few samples between two times.
    """
    rule, extent = "lie inside the recording", f"it runs from {time[0]:.10g} s to {time[-1]:.10g} s"
    for at in cuts:
        require(time[0] < at < time[-1], label, rule, f"{at:.10g} s", extent)
    samples = [0, *np.searchsorted(time, cuts).tolist(), time.size]
    for (a, b), at in zip(pairwise(samples), [*cuts, time[-1]], strict=True):
        rule = f"rise, with at least {FEWEST} samples between them and the ends"
        got = f"{max(b - a, 0)} before {at:.10g} s"
        require(b - a >= FEWEST, label, rule, got, "leave one out, or correct them")


def partition_at(
    time: Float, displacement: Float | None, times: Float, velocities: Sequence[float] | None = None
) -> Partition:
    """Cut a recording at given times.

    Parameters
    ----------
    time, displacement : array, (n,)
    times : array, (cuts,)
        Seconds, inside the recording.
    velocities : sequence of float, optional
        Velocities of the drive between the cuts (m/s), 0 in a hold; measured by default.
    """
    at = np.searchsorted(time, times)
    cuts = tuple(Cut(float(t), int(i)) for t, i in zip(times, at, strict=True))
    speeds, holds = (np.nan,) * (len(cuts) + 1), (False,) * (len(cuts) + 1)
    rates: list[Rate] = []
    if displacement is not None:
        pieces = list(pairwise([0, *at.tolist(), time.size]))
        motion = recorded_displacement(time, displacement)
        rates = [_mean_velocity(motion, [piece], piece) for piece in pieces]
        speeds, holds, _ = _speeds(motion, pieces, [rate.value for rate in rates])
    if velocities is None:
        return Partition(cuts, speeds, holds, rates=tuple(rates))
    doubts = tuple(_contradicted(velocities, speeds))
    given = Partition(cuts, tuple(velocities), (False,) * len(speeds), doubts)
    return with_holds(given, tuple(v == 0 for v in velocities), speeds)


def with_holds(cut: Partition, holds: Sequence[bool], speeds: Sequence[float]) -> Partition:
    """The partition with the holds of the user, and doubts on those that the displacement moves in.

    Parameters
    ----------
    cut : Partition
    holds : sequence of bool
        Whether each segment is a hold.
    speeds : sequence of float
        Measured velocities of the displacement (m/s); NaN where unknown.
    """
    doubts = list(cut.doubts)
    for k, (hold, speed) in enumerate(zip(holds, speeds, strict=True)):
        others = [abs(speeds[j]) for j in (k - 1, k + 1) if 0 <= j < len(speeds)]
        if hold and others and abs(speed) >= _MOVES * min(others) > 0:
            ends = " to ".join(f"{c.time:.6g} s" for c in cut.cuts[max(k - 1, 0) : k + 1])
            doubts.append(
                f"the displacement moves at {abs(speed):.4g} m/s in the hold from {ends}: it "
                "slides there, or the times are not those of the hold"
            )
    return replace(cut, holds=tuple(holds), doubts=tuple(doubts))


def _contradicted(given: Sequence[float], measured: Sequence[float]) -> list[str]:
    """Sentences on given velocities (m/s) that the recorded displacement contradicts."""
    return [
        f"velocity {k} is given as {abs(V):.4g} m/s, and the recorded displacement has "
        f"{abs(v):.4g} m/s; correct one of them"
        for k, (V, v) in enumerate(zip(given, measured, strict=True), start=1)
        if V != 0 and np.isfinite(v) and abs(abs(v) - abs(V)) > _OTHER_VELOCITY * abs(V)
    ]


def _velocity(motion: RecordedDisplacement, piece: Piece) -> float:
    """Slope of the displacement over a piece, m/s."""
    t, x = motion.time[slice(*piece)], motion.displacement[slice(*piece)]
    return slope_of(t, x) if t.size > 1 else np.nan


def _mean_velocity(motion: RecordedDisplacement, parts: list[Piece], between: Piece) -> Rate:
    """Slope of the line through the parts of a segment that lie between two samples, m/s.

    A motor or a gear that does not run evenly leaves a residual, which is slow noise. A jump of the
    gauge between two parts does not change the slope: the line continues at another height.
    """
    inside = [(max(a, between[0]), min(b, between[1])) for a, b in parts]
    inside = [part for part in inside if part[1] - part[0] >= FEWEST] or parts
    t, x = (
        np.concatenate([values[a:b] for a, b in inside])
        for values in (motion.time, motion.displacement)
    )
    since = t - t.mean()
    left = x - slope_of(t, x) * since
    firsts = np.cumsum([b - a for a, b in inside])[:-1]
    apart = np.abs(left[firsts] - left[firsts - 1])
    jumps = firsts[apart > _JUMP * max(neighbour_scatter(left), motion.noise)]
    line = np.searchsorted(jumps, np.arange(t.size), side="right")
    at, means = bin_means(since, x - x.mean())
    shares = [bin_means(since, (line == k).astype(float))[1] for k in range(jumps.size + 1)]
    return fit_trend(np.stack([at, *shares], axis=1), means).rate(0)


def _duration(motion: RecordedDisplacement, piece: Piece) -> float:
    """Seconds from the first sample of a piece to its last."""
    return float(motion.time[piece[1] - 1] - motion.time[piece[0]])


def _velocity_change(motion: RecordedDisplacement, piece: Piece) -> tuple[float, float]:
    """Velocity at the end of a piece less that at its beginning, and its uncertainty (m/s)."""
    n = piece[1] - piece[0]
    m = max(1, n // MEANS)
    stop = piece[0] + n // m * m
    t = motion.time[piece[0] : stop].reshape(-1, m).mean(axis=1)
    x = motion.displacement[piece[0] : stop].reshape(-1, m).mean(axis=1)
    span = _duration(motion, piece)
    away = (t - t.mean()) / span
    bend = float(np.polyfit(away, x - x.mean(), 2)[0])
    return 2 * bend / span, float(np.sqrt(720 / n)) * motion.slow_noise / span


def _still(motion: RecordedDisplacement, piece: Piece, speed: float) -> bool:
    """Whether noise explains the whole motion of a piece."""
    return abs(speed) * _duration(motion, piece) <= _STILL * motion.noise


def _segments(
    motion: RecordedDisplacement, pieces: list[Piece]
) -> tuple[list[Piece], list[list[Piece]], list[str]]:
    """Pieces without transitions and small changes, the parts that each is made of, and doubts."""
    doubts: list[str] = []
    parts = [[piece] for piece in pieces]
    speeds = [_velocity(motion, piece) for piece in pieces]
    while len(pieces) > 1:
        rounded = [
            0.0 if _still(motion, *each) else each[1] for each in zip(pieces, speeds, strict=True)
        ]
        ratios = np.array([_log_ratio(*pair) for pair in pairwise(rounded)])
        spans = np.array([_duration(motion, piece) for piece in pieces])
        both = np.stack([spans, spans * np.abs(speeds)])
        # Motors and contacts do not move evenly: a short part of nearly the same velocity as its
        # neighbour belongs to the segment of this neighbour.
        sides = both[:, :-1], both[:, 1:]
        share = np.max(np.minimum(*sides) / np.maximum(np.maximum(*sides), 1e-300), axis=0)
        allowed = np.where(share < _TRANSITION, np.log(_CLEAR_RATIO), np.log(_RATIO))
        least = int(np.argmin(ratios / allowed))
        if ratios[least] < allowed[least]:
            whole = pieces[least][0], pieces[least + 1][1]
            weights = [
                sum(_duration(motion, part) for part in parts[k]) for k in (least, least + 1)
            ]
            speeds[least : least + 2] = [np.average(speeds[least : least + 2], weights=weights)]
            parts[least : least + 2] = [parts[least] + parts[least + 1]]
            pieces[least : least + 2] = [whole]
            continue
        transition = _transition(motion, pieces, speeds)
        if transition is None:
            doubts += [
                f"the velocity changes by a factor of {np.exp(ratio):.3g} only at "
                f"{motion.time[first]:.6g} s, which may be no step"
                for ratio, (first, _) in zip(ratios, pieces[1:], strict=True)
                if ratio < np.log(_CLEAR_RATIO)
            ]
            break
        i, j, share = transition
        doubts += [
            f"{_duration(motion, pieces[k]):.3g} s at {1e6 * abs(speeds[k]):.3g} um/s from "
            f"{motion.time[pieces[k][0]]:.6g} s on are read as the transition between two "
            "velocities, and may be a segment"
            for k in range(i + 1, j)
            if share > _TRANSITION
            or _course(motion, pieces[k], speeds[k], (speeds[i], speeds[j])) == "even"
        ]
        del pieces[i + 1 : j], parts[i + 1 : j], speeds[i + 1 : j]
    return pieces, parts, doubts


def _transition(
    motion: RecordedDisplacement, pieces: list[Piece], speeds: list[float]
) -> tuple[int, int, float] | None:
    """The pieces on the two sides of the shortest transition, and its share of time or slip."""
    spans = [_duration(motion, piece) for piece in pieces]
    slips = [abs(speed) * span for speed, span in zip(speeds, spans, strict=True)]
    still = [_still(motion, *each) for each in zip(pieces, speeds, strict=True)]
    shortest, transition = np.inf, None
    for i, j in combinations(range(len(pieces)), 2):
        low, high = sorted((speeds[i], speeds[j]))
        inner = range(i + 1, j)
        between = all(low <= speeds[k] <= high for k in inner)
        span = float(motion.time[pieces[j][0]] - motion.time[pieces[i][1] - 1])
        if not inner or not (between or j == i + 2) or span >= shortest:
            continue
        # A stop, however short, is a hold and no transition.
        slowest = min(abs(low), abs(high))
        if any(still[k] and not _still(motion, pieces[k], slowest / 2) for k in inner):
            continue
        kinds = [_course(motion, pieces[k], speeds[k], (low, high)) for k in inner]
        limit = _RAMP if "even" not in kinds else _TRANSITION
        sides = [i, j]
        if not between:
            limit = _TRANSITION if kinds == ["settling"] else _OVERSHOOT
            if kinds == ["settling"]:
                sides = [min(sides, key=lambda k: _log_ratio(speeds[k], speeds[i + 1]))]
        # Two sides of nearly the same velocity are parts of one segment.
        total = sum if _log_ratio(low, high) < np.log(_RATIO) else min
        moved = [slips[k] for k in sides if not still[k]]
        share = span / total(spans[k] for k in sides)
        share = max(share, sum(slips[k] for k in inner) / total(moved) if moved else np.inf)
        if share < limit:
            shortest, transition = span, (i, j, share)
    return transition


def _course(
    motion: RecordedDisplacement, piece: Piece, speed: float, ends: tuple[float, float]
) -> str:
    """How the velocity of a piece between two segments changes.

    "even" if it is constant and differs from the velocities of both segments, "settling" if it goes
    from one of them to the other, empty if neither is certain.
    """
    change, uncertainty = _velocity_change(motion, piece)
    between = min(ends) <= speed <= max(ends)
    whole = abs(ends[1] - ends[0]) if between else min(abs(speed - end) for end in ends)
    other = min(_log_ratio(speed, end) for end in ends) > np.log(_CLEAR_RATIO)
    if other and abs(change) + 2 * uncertainty < whole / 2:
        return "even"
    return "settling" if abs(change) - 2 * uncertainty > whole / 2 else ""


def _log_ratio(a: float, b: float) -> float:
    """Logarithm of the ratio of two velocities; infinite if their signs differ or one is zero."""
    if a == b:
        return 0.0
    return float(abs(np.log(a / b))) if a * b > 0 else np.inf


def _intersection(motion: RecordedDisplacement, before: Piece, after: Piece) -> Cut:
    """Where the lines of displacement on the two sides of a cut intersect."""
    middles = [(piece[0] + piece[1]) // 2 for piece in (before, after)]
    step = abs(_velocity(motion, after) - _velocity(motion, before))
    # A motor does not run evenly: the lines are no longer than noise requires.
    long = _LINE * max(motion.slow_noise, motion.step) / max(step, 1e-300)
    time = motion.time
    first = int(np.searchsorted(time, time[before[1] - 1] - long))
    last = int(np.searchsorted(time, time[after[0]] + long))
    sides = (
        (max(before[0], min(first, before[1] - 16)), before[1]),
        (after[0], min(after[1], max(last, after[0] + 16))),
    )
    (v1, t1, x1, s1), (v2, t2, x2, s2) = (
        (
            _velocity(motion, side),
            float(time[slice(*side)].mean()),
            float(motion.displacement[slice(*side)].mean()),
            2 * motion.slow_noise / np.sqrt(side[1] - side[0]),
        )
        for side in sides
    )
    middle = float(time[before[1] - 1] + time[after[0]]) / 2
    if v1 == v2:
        return Cut(middle, after[0])
    at = middle + (x1 - x2 + v1 * (middle - t1) - v2 * (middle - t2)) / (v2 - v1)
    if not time[middles[0]] < at < time[middles[1]]:
        at = middle
    doubt = 2 * float(np.hypot(np.hypot(s1, s2), motion.step / np.sqrt(12))) / abs(v2 - v1)
    return Cut(at, int(np.searchsorted(time, at)), doubt)


def _speeds(
    motion: RecordedDisplacement, pieces: list[Piece], speeds: list[float]
) -> tuple[tuple[float, ...], tuple[bool, ...], list[str]]:
    """Velocities, zero where noise explains the motion; which segments are holds; and doubts."""
    speeds = [
        0.0 if _still(motion, *each) else each[1] for each in zip(pieces, speeds, strict=True)
    ]
    holds, doubts = [False] * len(pieces), []
    for k, (piece, speed) in enumerate(zip(pieces, speeds, strict=True)):
        neighbours = [abs(speeds[j]) for j in (k - 1, k + 1) if 0 <= j < len(speeds)]
        if not neighbours and speed == 0:
            doubts.append("the displacement changes by no more than its noise: nothing slides")
            continue
        share = abs(speed) / max(min(neighbours, default=0.0), 1e-300)
        change, uncertainty = _velocity_change(motion, piece)
        since = f"from {motion.time[piece[0]]:.6g} s on the velocity"
        # Creep in a hold slows down.
        steady = abs(change) + 2 * uncertainty < abs(speed) / 2
        holds[k] = speed == 0 or (share < _HOLD and not steady)
        if holds[k]:
            continue
        if share < _HOLD:
            doubts.append(
                f"{since} is {100 * share:.2g} % of its neighbours': read as sliding, it may be "
                "meant as a hold"
            )
        if abs(change) - 3 * uncertainty > np.log(_CLEAR_RATIO) * abs(speed):
            doubts.append(f"{since} changes by {100 * abs(change / speed):.2g} % within a segment")
    return tuple(speeds), tuple(holds), doubts
