"""Measurement of a recording without modulation: steady friction, velocity steps, holds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument
from asperity.lock_in.demodulation import DRIFTS
from asperity.measurement.levels_and_trends import (
    MeanLevel,
    Rate,
    block_means,
    mean_level,
    moving_mean,
    slope_of,
    steady_from,
)
from asperity.measurement.samples import about_channels, require_stated_load
from asperity.measurement.sliding.holds import HealingRate, HoldReading, healing_rate, read_hold
from asperity.measurement.sliding.segments import (
    Partition,
    partition,
    partition_at,
    require_cuts,
    with_holds,
)
from asperity.measurement.sliding.signals import SlidingSignals, sliding_signals
from asperity.measurement.sliding.velocity_steps import VelocityStep, read_step
from asperity.measurement.verdicts.checks import findings, friction
from asperity.measurement.verdicts.verdict import SLIDING, Check, Judged
from asperity.parameters.arguments import typed
from asperity.parameters.parameter import SummaryLine
from asperity.questions.recording import Measurement as Question
from asperity.recording.defects.resolution import recorder_step
from asperity.recording.defects.spikes import away_from_changes, spikes, without
from asperity.recording.trace import Trace

_DEFAULTS = Question()
#: Samples on each side that a step needs, and in a hold's surroundings.
_FEWEST = 16
#: A gap may hide a peak if it is longer than this many usual sampling intervals, and than this
#: share of the time from the end of the hold to the peak.
_GAP, _GAP_SHARE = 4.0, 0.2
#: Share of the sliding before a hold that is left out, as it may settle from the hold before it.
_SETTLING = 0.3


@dataclass(frozen=True)
class SlidingSegment:
    """A stretch of constant pulling velocity, or a hold.

    Attributes
    ----------
    start, end : float
        Seconds.
    velocity : float
        m/s; NaN if neither velocity nor displacement is recorded.
    hold : bool
        Whether the pulling stands still.
    steady : MeanLevel
        Friction once it has settled.
    slope : float
        Slope of the steady friction over time (1/s).
    scatter : float
        Standard deviation of the steady friction about that slope.
    highest, lowest : float
        Extremes of friction, smoothed over five samples.
    """

    start: float
    end: float
    velocity: float
    hold: bool
    steady: MeanLevel
    slope: float
    scatter: float
    highest: float
    lowest: float


@dataclass(frozen=True, eq=False, repr=False)
class SlidingMeasurement(Judged):
    """Measurement of a recording without modulation.

    Attributes
    ----------
    friction : MeanLevel
        Mean of F/W over the window.
    load : MeanLevel or None
        Mean load, in its unit; None if it is not in the recording.
    load_unit : str
        SI.
    segments : tuple of SlidingSegment
    steps : tuple of VelocityStep
        Between sliding segments that follow each other.
    holds : tuple of HoldReading
        Between sliding segments.
    healing : HealingRate or None
        None with fewer than two different hold times.
    rates : tuple of (float, float)
        Sampling rates (Hz), each with the share of the samples that has it.
    time, values : array, (n,)
        Friction over time, as used.
    velocity_from : str
        The channel of the velocities; empty without such a channel.
    detrend : {"none", "linear", "quadratic"}
    chosen_by : {"program", "user"}
        Who chose where the recording is cut.
    unread : int
        Findings about channels that were not read.
    checks : tuple of Check
    """

    mode = "sliding"
    _drawn_by = "asperity.figures.recording:draw_sliding"

    friction: MeanLevel
    load: MeanLevel | None
    load_unit: str
    segments: tuple[SlidingSegment, ...]
    steps: tuple[VelocityStep, ...]
    holds: tuple[HoldReading, ...]
    healing: HealingRate | None
    rates: tuple[tuple[float, float], ...]
    time: Float
    values: Float
    velocity_from: str
    detrend: str
    chosen_by: str
    unread: int
    checks: tuple[Check, ...]

    def numbers(self) -> list[SummaryLine]:
        """Mean friction, and the numbers of segments, steps and holds."""
        friction = self.friction
        return [
            SummaryLine("friction", f"{friction.value:.6g} +- {friction.uncertainty:.1g}"),
            SummaryLine("segments", str(len(self.segments))),
            SummaryLine("steps", str(len(self.steps))),
            SummaryLine("holds", str(len(self.holds))),
        ]


@typed
def measure_sliding(trace: Trace, question: Question = _DEFAULTS) -> SlidingMeasurement:
    """Friction, its velocity steps and its holds in a recording without modulation.

    Friction is F/W where both are recorded, and otherwise the recorded friction coefficient.
    Segments are cut where the displacement, or the velocity, changes its rate, or at the steps and
    holds of the question. Levels are extrapolated to a step or a hold through a trend over slip.

    Parameters
    ----------
    trace : Trace
    question : asperity.questions.recording.Measurement
        Its fields of sliding; all have defaults.

    Returns
    -------
    SlidingMeasurement

    Raises
    ------
    InputError
        If neither force and load nor friction is recorded, the window holds too little, or a given
        time lies outside of it.
    """
    steps, holds, detrend = question.steps, question.holds, question.detrend
    signals = sliding_signals(trace, question.load, question.force, question.window)
    if signals.load is not None:
        require_stated_load(question.normal_load, float(np.mean(signals.load)), signals.load_unit)
    time, friction = signals.time, signals.friction
    # Without times of the user the displacement shows where to cut.
    times = None
    if steps is None and holds is None:
        cut = partition(time, signals.displacement)
    else:
        times = sorted([*(steps or ()), *(edge for hold in holds or () for edge in hold)])
        require_cuts(time, times, f"measure.{'steps' if steps else 'holds'}")
        cut = partition_at(time, signals.displacement, np.array(times), question.velocities)
        if holds is not None:
            starts = {start for start, _ in holds}
            edges = [float(time[0]), *(c.time for c in cut.cuts)]
            cut = with_holds(cut, [edge in starts for edge in edges], cut.velocities)
    bounds = [0, *(c.sample for c in cut.cuts), time.size]
    # A check reports the spikes. A peak of friction where the drive changes is no spike.
    wrong = away_from_changes(friction, spikes(friction), bounds[1:-1])
    friction = without(friction, wrong)
    signals = replace(signals, friction=friction)
    resolution = recorder_step(friction)
    segments = tuple(
        _segment(time[a:b], friction[a:b], v, hold, resolution)
        for (a, b), v, hold in zip(pairwise(bounds), cut.velocities, cut.holds, strict=True)
    )
    read_steps, unread = _steps(signals, cut, bounds, segments, DRIFTS[detrend], resolution)
    read_holds, turns = _holds(signals, cut, bounds, segments, DRIFTS[detrend], resolution)
    doubts = [*cut.doubts, *unread, *turns, *_hidden_peaks(time, read_holds)]
    if times is not None and signals.displacement is not None:
        doubts += _other_holds(time, cut, partition(time, signals.displacement))
    if times is None and signals.displacement is None:
        doubts.append(f"velocity steps cannot be seen: {signals.no_motion}")
    checks = _checks(signals, segments, read_steps, doubts)
    about = about_channels(trace, signals.names)
    checks += findings([*about, *signals.signs], len(trace), float(time[-1] - time[0]))
    borne, at = signals.load, signals.load_time
    return SlidingMeasurement(
        friction=mean_level(time, friction, resolution),
        load=None if borne is None or at is None else mean_level(at, borne),
        load_unit=signals.load_unit,
        segments=segments,
        steps=tuple(read_steps),
        holds=tuple(read_holds),
        healing=healing_rate(read_holds),
        rates=_rates(time),
        time=time,
        values=friction,
        velocity_from=signals.motion,
        detrend=detrend,
        chosen_by="program" if times is None else "user",
        unread=len(trace.findings) - len(about),
        checks=tuple(checks),
    )


def _segment(
    time: Float, friction: Float, velocity: float, hold: bool, resolution: float
) -> SlidingSegment:
    means = block_means(friction, 100)
    begin = steady_from(means, 1) * max(1, friction.size // 100)
    late, values = time[begin:], friction[begin:]
    slope = slope_of(late, values)
    smooth = moving_mean(friction, 5)
    return SlidingSegment(
        start=float(time[0]),
        end=float(time[-1]),
        velocity=velocity,
        hold=hold,
        steady=mean_level(late, values, resolution),
        slope=slope,
        scatter=float(np.std(values - slope * (late - late.mean()))),
        highest=float(smooth.max()),
        lowest=float(smooth.min()),
    )


def _steps(
    signals: SlidingSignals,
    cut: Partition,
    bounds: list[int],
    segments: tuple[SlidingSegment, ...],
    degree: int,
    resolution: float,
) -> tuple[list[VelocityStep], list[str]]:
    """Steps between two sliding segments, and sentences on steps that cannot be read."""
    steps: list[VelocityStep] = []
    unread: list[str] = []
    sides = []
    # Velocities of the user are exact.
    rates = cut.rates or (Rate(0.0, 0.0, np.inf),) * len(cut.velocities)
    for (a, b), rate, velocity in zip(pairwise(bounds), rates, cut.velocities, strict=True):
        part = signals.friction[a:b]
        sides.append((signals.time[a:b], _direction(part) * part, rate._replace(value=velocity)))
    # The first segment may begin with the loading.
    first = segments[0]
    speed = abs(first.velocity) if np.isfinite(first.velocity) and first.velocity else 1.0
    settling = speed * (first.steady.start - first.start)
    for k, change in enumerate(cut.cuts):
        before, after = sides[k : k + 2]
        # The slip in which friction settles after a hold, or a step that is not read, is not known:
        # half of the sliding before the next step is left out.
        earlier, settling = settling, np.inf
        if cut.holds[k] or cut.holds[k + 1]:
            continue
        if min(before[0].size, after[0].size) < _FEWEST:
            unread.append(f"the step at {change.time:.6g} s has too few samples on one side")
            continue
        step = read_step(
            change.time, before, after, degree=degree, first_settling=earlier, resolution=resolution
        )
        if step is None:
            unread.append(f"the step at {change.time:.6g} s does not settle in what was recorded")
            continue
        steps.append(step)
        settling = step.settling_slip
    return steps, unread


def _holds(
    signals: SlidingSignals,
    cut: Partition,
    bounds: list[int],
    segments: tuple[SlidingSegment, ...],
    degree: int,
    resolution: float,
) -> tuple[list[HoldReading], list[str]]:
    """Holds between two sliding segments, and sentences on holds that cannot be read."""
    holds: list[HoldReading] = []
    unread: list[str] = []
    for k, hold in enumerate(cut.holds):
        if not hold or k in (0, len(cut.holds) - 1):
            continue
        a, b, c, d = bounds[k - 1 : k + 3]
        if min(b - a, d - c) < _FEWEST or c - b < 2:
            continue
        direction = _direction(signals.friction[a:b])
        if direction != _direction(signals.friction[c:d]):
            at = cut.cuts[k - 1].time
            unread.append(f"after the hold at {at:.6g} s the slider turns: it has no healing")
            continue
        # Sliding may settle from the hold before it; the first sliding may begin with the loading.
        begin = a + int(_SETTLING * (b - a))
        if k == 1:
            steady = int(np.searchsorted(signals.time, segments[0].steady.start))
            begin = min(steady, (a + b) // 2)
        holds.append(
            read_hold(
                signals.time,
                direction * signals.friction,
                signals.displacement,
                (begin, d),
                (cut.cuts[k - 1], cut.cuts[k]),
                cut.velocities[k + 1],
                degree=degree,
                resolution=resolution,
            )
        )
    return holds, unread


def _direction(friction: Float) -> float:
    """Sign that makes the friction of a segment count against the motion."""
    return -1.0 if np.median(friction) < 0 else 1.0


def _hidden_peaks(time: Float, holds: list[HoldReading]) -> list[str]:
    """Sentences on gaps of the recording in which the peak after a hold may lie."""
    usual, doubts = float(np.median(np.diff(time))), []
    for hold in holds:
        since = hold.peak_time - hold.end
        first, last = np.searchsorted(time, [hold.end, hold.peak_time + since])
        gap = float(np.diff(time[max(first - 1, 0) : last + 1]).max(initial=0.0))
        if gap > max(_GAP * usual, _GAP_SHARE * since):
            doubts.append(
                f"the peak after the hold at {hold.start:.6g} s may lie in a gap of {gap:.3g} s"
            )
    return doubts


def _other_holds(time: Float, given: Partition, seen: Partition) -> list[str]:
    """A sentence on holds of the displacement within sliding of the user, whose peaks mislead."""

    def holds(cut: Partition) -> list[tuple[float, float]]:
        edges = [float(time[0]), *(c.time for c in cut.cuts), float(time[-1])]
        return [ends for ends, hold in zip(pairwise(edges), cut.holds, strict=True) if hold]

    inner = [(a, b) for a, b in holds(seen) if time[0] < a and b < time[-1]]
    other = [(a, b) for a, b in inner if not any(c < b and a < d for c, d in holds(given))]
    if not other:
        return []
    (start, end), more = other[0], len(other) - 1
    also = f" (and {more} more)" if more else ""
    return [f"the displacement stands still from {start:.6g} to {end:.6g} s, no given hold{also}"]


def _rates(time: Float) -> tuple[tuple[float, float], ...]:
    """Sampling rates in use, commonest first."""
    steps = np.diff(time)
    # Two digits distinguish rates, but not jitter.
    digit = 10.0 ** (np.floor(np.log10(steps) + 1e-9) - 1)
    values, counts = np.unique(np.rint(steps / digit) * digit, return_counts=True)
    order = np.argsort(-counts)[:5]
    return tuple((float(1 / values[i]), float(counts[i] / steps.size)) for i in order)


def _exchanged(signals: SlidingSignals, spread: float) -> str:
    """A question where the larger of two signals is called shear and varies less than the load."""
    borne, friction = signals.load, signals.friction
    if borne is None or borne.size != friction.size or abs(friction.mean()) < 1:
        return ""
    shear = friction * borne
    steadier = shear.std() < spread * abs(shear.mean())
    return "; the shear is larger and steadier: are their columns exchanged?" if steadier else ""


def _checks(
    signals: SlidingSignals,
    segments: tuple[SlidingSegment, ...],
    steps: list[VelocityStep],
    doubts: list[str],
) -> list[Check]:
    checks = [friction(float(np.abs(signals.friction).mean()))]

    def ask(name: str, number: float, sentence: str) -> None:
        checks.append(SLIDING.check(name, number, sentence))

    borne, mean = signals.load, max(abs(float(signals.friction.mean())), 1e-300)
    if borne is not None and borne.size:
        spread = float(borne.std() / abs(borne.mean())) if borne.mean() else np.inf
        text = f"the load's standard deviation is {100 * spread:.2g} % of its mean"
        limit, _ = SLIDING["load"]
        advice = (
            f"; read a part under one load ({Argument('measure.window')}), or fit a law, whose "
            "motion follows it"
        )
        ask("load", spread, text + (_exchanged(signals, spread) or advice * (spread > limit)))
    sliding = [s for s in segments if not s.hold] or list(segments)
    drift = max(abs(p.slope * (p.end - p.steady.start)) for p in sliding) / mean
    text = f"within its steady parts friction drifts by up to {100 * drift:.2g} % of its mean"
    ask("drift", drift, text)
    if signals.turned:
        ask("sign", 1.0, "friction is recorded as negative; its sign was reversed")
    text = "; ".join(doubts) or "the recording can be cut in one way only"
    ask("segments", float(len(doubts)), text)
    if steps:
        slow = max(steps, key=lambda s: s.settling_slip / s.choices[0].window)
        share = slow.settling_slip / slow.choices[0].window
        text = (
            f"after the step at {slow.time:.6g} s the transient takes {100 * share:.2g} % of the "
            "slip that can be compared; a slower one cannot be distinguished from the trend"
        )
        ask("settling", share, text)
    return checks
