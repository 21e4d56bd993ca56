"""Measurement of a stick-slip recording: events, regimes, loading, and checks of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from asperity.arrays import Float, Index
from asperity.errors import Argument, InputError
from asperity.measurement.samples import require_stated_load
from asperity.measurement.sliding.signals import (
    SlidingSignals,
    sliding_signals,
    with_normalised_force,
)
from asperity.measurement.stick_slip.checks import checks_of
from asperity.measurement.stick_slip.detection import Falls, find_falls
from asperity.measurement.stick_slip.events import SlipEvents, read_events, steepest_fall
from asperity.measurement.stick_slip.noise import estimate, without_impulses
from asperity.measurement.stick_slip.regimes import Regime, regimes
from asperity.measurement.verdicts.verdict import Check, Judged
from asperity.parameters.parameter import SummaryLine
from asperity.questions.recording import Measurement as Question
from asperity.recording.defects.sampling import even_rate
from asperity.recording.trace import Channel, Trace

_DEFAULTS = Question()
#: With this number of events or fewer there is no regime, and means have no spread.
_FEW = 2
#: The recorded displacement is that of the slider if more than this share of it falls into slips.
SLIDER = 0.5
#: Evidence of `Falls` in a recording of many slips.
_MANY_SLIPS = 3
#: Longest interval between two samples that a straight line bridges, over the usual interval.
_LONGEST_GAP = 4.0
#: Standard gravity (m/s^2), by which F/(m g) is a friction coefficient.
GRAVITY = 9.80665


@dataclass(frozen=True)
class Machine:
    """Numbers of the machine in SI; None where unknown.

    Attributes
    ----------
    stiffness : float or None
        K (N/m).
    velocity : float or None
        V, velocity of the driven end of the spring (m/s).
    mass : float or None
        M (kg).
    load : float or None
        W0 (N).
    """

    stiffness: float | None = None
    velocity: float | None = None
    mass: float | None = None
    load: float | None = None

    @property
    def numbers(self) -> Float:
        """K, V, M and W0; NaN where unknown."""
        return np.array([self.stiffness, self.velocity, self.mass, self.load], float)


@dataclass(frozen=True, eq=False, repr=False)
class StickSlipMeasurement(Judged):
    """Slip events of a recording, and the loading, slips and energies computed from them.

    Attributes
    ----------
    time, friction : array, (n,)
        Seconds and F/W, without impulses.
    events : SlipEvents
        Forces are divided by the load.
    regimes : tuple of Regime
    machine : Machine
        Numbers of the question, completed from the recording.
    loading_slope, loading_slope_uncertainty : float
        Median slope of F/W in the sticks (1/s), and its standard uncertainty; NaN with fewer than
        two events.
    smallest_drop : float
        Smallest drop of F/W that is surely detected, in white noise at the usual loading.
    noise : float
        Standard deviation of a sample of F/W.
    impulses : int array
        Indices of samples that were replaced.
    slip_share : float
        Share of the recorded displacement that falls into the slips: near 1 if the displacement of
        the slider is recorded, small for that of the load point; NaN without a displacement.
    slip, slip_velocity, energy : array, (k,)
        Slip (m), largest slip velocity (m/s) and energy that the spring releases (J), for each
        event. Slip and velocity come from the recorded displacement of the slider, if there is one,
        and otherwise from the force of the spring; NaN if stiffness, velocity or load is unknown.
    names : tuple of str
        Channels that were read.
    checks : tuple of Check
    """

    mode = "stick-slip"
    _drawn_by = "asperity.figures.stick_slip:draw_stick_slip"

    time: Float
    friction: Float
    events: SlipEvents
    regimes: tuple[Regime, ...]
    machine: Machine
    loading_slope: float
    loading_slope_uncertainty: float
    smallest_drop: float
    noise: float
    impulses: Index
    slip_share: float
    slip: Float
    slip_velocity: Float
    energy: Float
    names: tuple[str, ...]
    checks: tuple[Check, ...]

    @property
    def stiffness_from_slope(self) -> tuple[float, float]:
        """K (N/m) from the loading slope, and its standard uncertainty; NaN if unknown."""
        _, V, _, W0 = self.machine.numbers
        return self.loading_slope * W0 / V, self.loading_slope_uncertainty * W0 / V

    @property
    def clear(self) -> bool:
        """Whether stick-slip or oscillations take more than half of the recording."""
        moving = sum(r.end - r.start for r in self.regimes if r.stop - r.first > _FEW)
        return moving > float(self.time[-1] - self.time[0]) / 2

    @property
    def kind(self) -> str:
        """Kinds of the regimes, in their order."""
        return ", then ".join(regime.kind for regime in self.regimes)

    def numbers(self) -> list[SummaryLine]:
        """Regimes, number and mean drop of the events."""
        events = self.events
        lines = [SummaryLine("regime", self.kind), SummaryLine("events", str(len(events)))]
        if len(events):
            lines.append(SummaryLine("drop", f"{np.mean(events.drop):.4g}"))
        return lines


def measure_stick_slip(trace: Trace, question: Question = _DEFAULTS) -> StickSlipMeasurement:
    """Slip events of a recording, its regimes, and its loading.

    Parameters
    ----------
    trace : Trace
    question : asperity.questions.recording.Measurement
        Channels, window and machine; all have defaults. A recorded friction coefficient may take
        the place of load and force.

    Raises
    ------
    InputError
        If neither force and load nor friction is recorded, or there are gaps.

    Notes
    -----
    Samples at uneven times are interpolated to even ones.
    """
    # F/(m g) is recognised only if it is the only channel: this comes before a load is added.
    trace = with_normalised_force(trace)
    if question.normal_load is not None and not trace.has("W"):
        constant = Channel(np.full(len(trace), question.normal_load), "force", "N", "load", "N")
        trace = replace(trace, channels={**trace.channels, "load": constant})
    signals = _at_even_times(sliding_signals(trace, question.load, question.force, question.window))
    time = signals.time
    friction, impulses = without_impulses(signals.friction)
    friction, falls, upside_down = _slips_downwards(friction, signals.turned)
    events = read_events(time, friction, falls)
    machine = _machine(question, signals, events)
    slope, slope_uncertainty = _loading(events)
    smallest = _smallest_drop(falls, slope * float(time[-1] - time[0]) / (time.size - 1))
    K, _, M, _ = machine.numbers
    parts = regimes(
        time,
        friction,
        events,
        smallest,
        falls=len(falls),
        impulses=impulses.size / time.size,
        natural_period=2 * np.pi * float(np.sqrt(M / K)),
    )
    slip_share = _slip_share(signals, events)
    slip, speed, energy = _slip_from_spring(events, machine)
    if signals.displacement is not None and slip_share > SLIDER:
        slip, speed = _recorded_slip(time, signals.displacement, events)
    result = StickSlipMeasurement(
        time=time,
        friction=friction,
        events=events,
        regimes=parts,
        machine=machine,
        loading_slope=slope,
        loading_slope_uncertainty=slope_uncertainty,
        smallest_drop=smallest,
        noise=float(falls.scatter[0]),
        impulses=impulses,
        slip_share=slip_share,
        slip=slip,
        slip_velocity=speed,
        energy=energy,
        names=signals.names,
        checks=(),
    )
    checks = checks_of(result, trace, signals, upside_down=upside_down)
    return replace(result, checks=tuple(checks))


def _slips_downwards(friction: Float, turned: bool) -> tuple[Float, Falls, bool]:
    """Friction that falls in slips, its falls, and whether its sign was reversed for that."""
    noise = estimate(friction)
    falls = find_falls(friction, noise)
    if falls.evidence < _MANY_SLIPS:
        other = find_falls(-friction, noise)
        # A negative mean is due to the sign of the gauge or to its zero; a few slips decide.
        enough = 1 if turned else _MANY_SLIPS - 1
        if other.evidence > max(falls.evidence, enough):
            return -friction, other, True
    return friction, falls, False


def _at_even_times(signals: SlidingSignals) -> SlidingSignals:
    """Signals at even times, linearly interpolated where samples are uneven."""
    time = signals.time
    if even_rate(time) is not None:
        return signals
    steps = np.diff(time)
    usual, widest = float(np.median(steps)), int(steps.argmax())
    if steps[widest] > _LONGEST_GAP * usual:
        rule = f"be without gaps of more than {_LONGEST_GAP:g} samples for slip events"
        got = f"one of {steps[widest]:.4g} s at {time[widest]:.10g} s"
        raise InputError(Argument("measure.trace"), rule, got, "give a window without it")
    even = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / usual) + 1)
    moved = signals.displacement
    # Interpolation would spread an impulse of one sample over two or three samples.
    friction, _ = without_impulses(signals.friction)
    return replace(
        signals,
        time=even,
        friction=np.interp(even, time, friction),
        displacement=None if moved is None else np.interp(even, time, moved),
    )


def _machine(question: Question, signals: SlidingSignals, events: SlipEvents) -> Machine:
    """The machine as stated in the question, completed from the recording."""
    load, velocity = question.normal_load, question.velocity
    if signals.load is not None and signals.load_unit == "N":
        recorded = float(np.mean(signals.load))
        require_stated_load(load, recorded, signals.load_unit)
        load = recorded if load is None else load
    if load is None and signals.load is None and question.mass is not None:
        load = question.mass * GRAVITY
    if velocity is None and signals.displacement is not None:
        # Over whole cycles the slider moves as far as the drive, which may pause before or after.
        ends = events.onset[[0, -1]] if len(events) > 1 else signals.time[[0, -1]]
        first, last = np.interp(ends, signals.time, signals.displacement)
        velocity = abs(float(last - first)) / float(ends[1] - ends[0])
    return Machine(question.stiffness, velocity or None, question.mass, load)


def _loading(events: SlipEvents) -> tuple[float, float]:
    """Median loading slope of the sticks, corrected for drift, and its standard uncertainty.

    The mean force changes if friction varies along the track, which does not change the loading,
    or if the gauge drifts, which adds its rate to the loading. The recording does not show which:
    half of the rate is subtracted, with an uncertainty of half of the rate.
    """
    if len(events) < 2:
        return np.nan, np.nan
    slope, uncertainty = events.loading_slope[1:], events.slope_uncertainty[1:]
    clear = uncertainty < 0.3 * np.abs(slope)
    if not clear.any():
        return np.nan, np.nan
    slope, uncertainty, usual = slope[clear], uncertainty[clear], float(np.median(slope[clear]))
    rate = float(np.polyfit(events.onset, events.force_before + events.force_after, 1)[0]) / 2
    scatter = max(1.4826 * float(np.median(np.abs(slope - usual))), float(np.median(uncertainty)))
    # The median of n normal values scatters by sqrt(pi/(2 n)).
    of_median = scatter * np.sqrt(np.pi / 2 / slope.size)
    bend = float(np.median(events.slope_bend[1:][clear]))
    return usual - rate / 2, float(np.linalg.norm([of_median, bend, rate / 2]))


def _smallest_drop(falls: Falls, slope: float) -> float:
    """Smallest drop that means of any width detect; the loading within the width hides a part."""
    width = 2.0 ** np.arange(falls.thresholds.size)
    rise = slope if np.isfinite(slope) else 0.0
    return float((falls.thresholds + width * max(rise, 0.0)).min())


def _slip_share(signals: SlidingSignals, events: SlipEvents) -> float:
    if signals.displacement is None or not len(events):
        return np.nan
    at = np.interp(np.stack([events.onset, events.end]), signals.time, signals.displacement)
    moved = abs(float(at[1, -1] - at[0, 0]))
    return float(np.abs(at[1] - at[0]).sum()) / moved if moved else np.nan


def _slip_from_spring(events: SlipEvents, machine: Machine) -> tuple[Float, Float, Float]:
    """Slip, largest slip velocity and energy of each event, by F = K (V t - x) without inertia."""
    K, V, _, W0 = machine.numbers
    compliance = W0 / K
    slip = events.drop * compliance + V * events.slip_duration
    speed = V + events.fall_rate * compliance
    energy = W0 * compliance * (events.force_before**2 - events.force_after**2) / 2
    return slip, speed, energy


def _recorded_slip(time: Float, displacement: Float, events: SlipEvents) -> tuple[Float, Float]:
    """Slip and largest slip velocity of each event from the displacement of the slider.

    The slip is the difference between the means after the end and before the onset, each over a
    quarter of the duration of the slip: the slider creeps ever faster before the onset.
    """
    step = float(time[-1] - time[0]) / (time.size - 1)
    forward = displacement * np.sign(displacement[-1] - displacement[0])
    onset, end = ((t - time[0]) / step for t in (events.onset, events.end))
    total = np.concatenate([[0.0], np.cumsum(forward - forward[0])])

    def mean(low: Float, high: Float) -> Float:
        first = np.clip(np.rint(low).astype(np.intp), 0, time.size - 1)
        stop = np.clip(np.rint(high).astype(np.intp), first + 1, time.size)
        return np.asarray((total[stop] - total[first]) / (stop - first))

    width = np.maximum((end - onset) / 4, 1.0)
    slip = mean(end + 1, end + 1 + width) - mean(onset - width, onset)
    return slip, steepest_fall(-forward, onset, end, slip) / step
