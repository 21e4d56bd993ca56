"""Integration through the segments of a programme, one compiled chunk of steps at a time.

The implicit method replaces the explicit one where stability limits the explicit steps.

A slider on elastic asperities rings at sqrt(W0 / (lambda M)). In a hold the slip that damps the
ringing becomes slower and slower, so that the ringing never ends, and steps that resolve it never
become longer. If the number of such steps is too large, the velocity of the slider is integrated
with the error that corresponds to the tolerated error of the force on the asperities,

    |dv| = sqrt(lambda W0 / M) |d(F_i/W)|,

the velocity with which the slider rings while F_i/W swings by its tolerated error. The implicit
method then takes steps longer than a period and damps the remaining ringing. All other states keep
their tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import ModuleType

import jax
import numpy as np

from asperity.loads import Programme
from asperity.loads.programme.segment import ProgrammeSegment, load_of
from asperity.slider import Inertial, Motion, RadiatingAsperities, ReversingInertial, StiffInertial
from asperity.transients import explicit, implicit
from asperity.transients.dense_output import STEPS, UNDERFLOW, DenseOutput, Interval, StepChunk
from asperity.transients.equations import (
    MotionSamples,
    SegmentEquations,
    Tolerances,
    states_across_break,
    step_samples,
)
from asperity.transients.events import Event, EventDetector, EventThresholds, Termination

#: Number of remaining steps above which ringing may be left out: some ten seconds of work.
_MANY_STEPS = 1_000_000

#: Factor by which the steps must then become longer.
_GAIN = 50.0

#: Number of consecutive chunks that must predict too many steps before the integration stops.
_HOPELESS_CHUNKS = 20


def _length(chunk: StepChunk, t: float) -> float:
    """Mean length of the steps of a chunk that begins at `t` (s)."""
    return (float(chunk.t) - t) / max(int(chunk.taken), 1)


def _steps_left(chunk: StepChunk, t: float, end: float) -> float:
    """Number of steps of the chunk's mean length from the end of the chunk to `end`."""
    left = end - float(chunk.t)
    if left <= 0 or not chunk.taken:
        return 0.0
    length = _length(chunk, t)
    # Steps below the spacing of doubles do not move the time.
    return left / length if length > 0 else math.inf


#: Names of the methods in results.
NAMES = {explicit: "explicit", implicit: "implicit"}

#: Share of doubtful steps in a chunk from which the other method is tried.
_MOST = 0.6

#: Cost of an implicit step in explicit steps.
_COST = 2.5


class MethodChoice:
    """The explicit or the implicit method, chosen by the last steps.

    Each method marks a step as doubtful if the other method could have taken it at lower cost. When
    the explicit method is at its limit of stability, the implicit method is tried. If its steps are
    not longer by more than the ratio of the costs, the next trial waits twice as long. Measured
    computing times are not used, so that the same input gives the same result.

    Parameters
    ----------
    motion : Motion
    method : str
        "auto", "explicit" or "implicit".
    """

    def __init__(self, motion: Motion, method: str) -> None:
        stiff = isinstance(motion, StiffInertial | ReversingInertial | RadiatingAsperities)
        self._free = method == "auto"
        self._implicit = stiff if self._free else method == "implicit"
        self._explicit_length = 0.0  # mean step before a trial; 0 where none is under way
        self._wait, self._waited = 1, 0

    @property
    def method(self) -> ModuleType:
        """The module whose `advance` takes the next steps."""
        return implicit if self._implicit else explicit

    def learn(self, chunk: StepChunk, many: bool) -> None:
        """Choose the method of the next chunk from the chunk of steps just taken.

        Parameters
        ----------
        chunk : StepChunk
        many : bool
            Whether many such steps remain: the implicit method is then tried in any case, because
            near a steady state the steps do not show the limit of stability.
        """
        # A chunk that ends early, at a break point, has too few steps to judge.
        if not self._free or int(chunk.taken) < STEPS:
            return
        doubtful = int(chunk.doubtful) > _MOST * STEPS
        length = float(chunk.length.mean())
        if not self._implicit:
            self._waited += 1
            if (doubtful or many) and self._waited >= self._wait:
                self._implicit, self._explicit_length = True, length
        elif self._explicit_length and length < _COST * self._explicit_length:
            self._implicit, self._waited = False, 0
            self._wait *= 2
        else:
            self._explicit_length = 0.0
            if doubtful:
                self._implicit, self._waited, self._wait = False, 0, 1


#: Share of the mean load at which contact counts as lost: friction is F_i/W.
NO_LOAD = 1e-6


@dataclass
class Checkpoint:
    """State of an integration from which it can be resumed.

    Attributes
    ----------
    segment : int
        Segment of the programme.
    t : float
        Time of that segment (s).
    states : ndarray, shape (size + 1,)
        States of the motion, and x K / W0.
    length : float
        Step to try next (s); 0 for none.
    sampled : float
        Time of the programme up to which, inclusive, samples have been yielded (s).
    ringless : bool
        Whether ringing of the slider on its asperities is left out from here to the end of
        the segment.
    steady : bool
        Whether the motion has become steady in the segment.
    """

    segment: int
    t: float
    states: np.ndarray
    length: float = 0.0
    sampled: float = -np.inf
    ringless: bool = False
    steady: bool = False


@dataclass(frozen=True)
class SegmentPart:
    """Consecutive steps of a segment, with their events.

    Attributes
    ----------
    system : SegmentEquations
    start : float
        Time of the programme at which the segment begins (s).
    dense_output : DenseOutput
    end : float
        Time of the segment up to which the steps are valid (s).
    events : list of Event
    termination : Termination or None
        Reason why the integration ends here; None if it continues.
    closes : bool
        Whether the end of the segment is reached.
    checkpoint : Checkpoint
        From where the integration continues.
    """

    system: SegmentEquations
    start: float
    dense_output: DenseOutput
    end: float
    events: list[Event]
    termination: Termination | None
    closes: bool
    checkpoint: Checkpoint


@dataclass
class Integration:
    """Integration of one programme.

    Attributes
    ----------
    motion : Motion
        With scalar parameters and omega = 1 rad/s.
    programme : Programme
    checkpoint : Checkpoint
    tolerances : Tolerances
    thresholds : EventThresholds
    method : str
        "explicit", "implicit", or "auto" for whichever suits the equations.
    most_steps : float
        Number of steps at which the integration stops, or earlier, when they are foreseeable.
    unresolved : float
        Velocity (m/s) below which ringing has been left out; 0 if it has been resolved.
    steps, rejected : int
        So far.
    methods : set of str
        Methods used so far.
    """

    motion: Motion
    programme: Programme
    checkpoint: Checkpoint
    tolerances: Tolerances
    thresholds: EventThresholds
    method: str = "auto"
    most_steps: float = np.inf
    unresolved: float = 0.0
    steps: int = 0
    rejected: int = 0
    methods: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._choice = MethodChoice(self.motion, self.method)
        self._detector = EventDetector(self.motion, self.thresholds)
        self._ringless = self._may_leave_out = False
        # Velocity (over V) at which the slider rings while F_i/W swings by 1.
        self._ringing = 0.0
        if isinstance(self.motion, Inertial) and self.method != "explicit":
            self._ringing = float(np.sqrt(self.motion.mobility / self.motion.strain))

    def segment_parts(self) -> Iterator[SegmentPart]:
        """Integrate from the checkpoint to the end of the programme, or to a termination."""
        while self.checkpoint.segment < len(self.programme.segments):
            for part in self._segment(self.programme.segments[self.checkpoint.segment]):
                self.checkpoint = part.checkpoint
                yield part
                if part.termination is not None:
                    return
            self._enter(self.checkpoint.segment + 1)

    def last_segment(self) -> tuple[SegmentEquations, DenseOutput] | Termination:
        """Equations and steps of the last segment of the programme, or why the motion ends."""
        steps = []
        for part in self.segment_parts():
            if part.termination is not None:
                return part.termination
            if part.checkpoint.segment == len(self.programme.segments) - 1:
                steps.append(part.dense_output)
        return part.system, DenseOutput.joined(steps)

    def _enter(self, index: int) -> None:
        """Enter the segment `index` across its break point."""
        here = self.checkpoint
        states = here.states
        if index < len(self.programme.segments):
            before = SegmentEquations(self.motion, self.programme.segments[here.segment])
            after = SegmentEquations(self.motion, self.programme.segments[index])
            states = states_across_break(before, here.t, after, states)
        self.checkpoint = Checkpoint(index, 0.0, states)

    def _segment(self, segment: ProgrammeSegment) -> Iterator[SegmentPart]:
        here = self.checkpoint
        self._ringless = here.ringless
        system = self._system(segment)
        start = float(self.programme.starts[here.segment])
        end, lost = _contact(segment, float(self.motion.slider.W0))
        if lost is not None and lost <= here.t:
            yield self._standstill(system, start, Termination("loss of contact", start + lost))
            return
        self._detector.enter(system, start, here.steady)
        # The break point before a segment may make the slider ring anew.
        self._may_leave_out, self._hopeless = self._ringing > 0, 0
        t, Y, length = here.t, here.states, here.length
        while t < end:
            chunk, samples = self._advance(segment, t, Y, length, end)
            dense_output, reached = DenseOutput.of(chunk), float(chunk.t)
            events, termination = self._detector.detect(dense_output, samples)
            if termination is None and lost is not None and reached >= end:
                termination = Termination("loss of contact", start + lost)
            if termination is None and int(chunk.status) == UNDERFLOW:
                termination = self._detector.underflow(reached, chunk.Y)
            if termination is None:
                termination = self._out_of_reach(chunk, t, end, start)
            t, Y, length = reached, np.asarray(chunk.Y), float(chunk.next_length)
            ends_at, states = reached, Y
            if termination is not None:
                events = [e for e in events if e.time <= termination.time]
                events.append(Event(termination.time, termination.kind))
                ends_at = min(termination.time - start, reached)
                if len(dense_output.begin):
                    states = dense_output.evaluate(np.array([ends_at]))[:, 0]
            mark = Checkpoint(
                here.segment, ends_at, states, length,
                ringless=self._ringless, steady=self._detector.steady,
            )  # fmt: skip
            system, closes = self._system(segment), termination is None and reached >= end
            yield SegmentPart(
                system, start, dense_output, ends_at, events, termination, closes, mark
            )
            if termination is not None:
                return

    def _advance(
        self, segment: ProgrammeSegment, t: float, Y: np.ndarray, length: float, end: float
    ) -> tuple[StepChunk, MotionSamples]:
        """The next steps; they leave ringing out where too many of them would resolve it."""
        interval = Interval(t, Y, length, end, segment.longest_step)
        method = implicit if self._ringless else self._choice.method
        chunk, samples = self._steps(method, segment, interval)
        if not self._ringless:
            many = _steps_left(chunk, t, end) >= _MANY_STEPS
            if many and self._may_leave_out:
                self._may_leave_out, self._ringless = False, True
                trial = self._steps(implicit, segment, interval)
                if _length(trial[0], t) > _GAIN * _length(chunk, t):
                    method, (chunk, samples) = implicit, trial
                else:
                    self._ringless = False
        if not self._ringless:
            self._choice.learn(chunk, many)
        self.steps += int(chunk.taken)
        self.rejected += int(chunk.rejected)
        self.methods.add(NAMES[method])
        if self._ringless:
            rtol, atol = self.tolerances
            error = atol + rtol * float(np.abs(samples.friction).max())
            velocity = float(self.motion.V) * self._ringing * error
            self.unresolved = max(self.unresolved, velocity)
        return chunk, samples

    def _out_of_reach(
        self, chunk: StepChunk, t: float, end: float, start: float
    ) -> Termination | None:
        """The termination, if the end of the segment is too many steps away.

        Parameters
        ----------
        chunk : StepChunk
            The last steps, which begin at `t` (s).
        end, start : float
            End of the segment, and its beginning in the programme (s).
        """
        left = _steps_left(chunk, t, end)
        self._hopeless = self._hopeless + 1 if self.steps + left > self.most_steps else 0
        if left and (self.steps >= self.most_steps or self._hopeless >= _HOPELESS_CHUNKS):
            detail = f"its steps of {_length(chunk, t):.3g} s would take {left:.3g} more"
            return Termination("too many steps", start + float(chunk.t), detail)
        return None

    def _standstill(
        self, system: SegmentEquations, start: float, termination: Termination
    ) -> SegmentPart:
        """A segment part without steps: a termination before the first one."""
        size = self.motion.size + 1
        nothing = DenseOutput(np.empty(0), np.empty(0), np.empty((2, size, 0)))
        here = self.checkpoint
        events = [Event(termination.time, termination.kind)]
        return SegmentPart(system, start, nothing, here.t, events, termination, False, here)

    def _system(self, segment: ProgrammeSegment) -> SegmentEquations:
        return SegmentEquations(self.motion, segment, self._ringing if self._ringless else 0.0)

    def _steps(
        self, method: ModuleType, segment: ProgrammeSegment, interval: Interval
    ) -> tuple[StepChunk, MotionSamples]:
        system = self._system(segment)
        chunk = method.advance(system, interval, self.tolerances)
        samples, chunk = step_samples(system, chunk), jax.device_get(chunk)
        return chunk, samples


def _contact(segment: ProgrammeSegment, W0: float) -> tuple[float, float | None]:
    """End of the integration of a segment, and the time at which the load vanishes, if any."""
    duration = float(segment.duration)
    floor = NO_LOAD * W0
    if segment.lowest_load > floor:
        return duration, None
    # Imported here because the module loads slowly, and contact is rarely lost.
    from scipy.optimize import brentq

    def load(t: np.ndarray | float) -> np.ndarray:
        return np.asarray(load_of(segment, t))

    spacing = segment.longest_step / 16
    first = segment.surely_above(floor)
    last = duration if segment.period is None else min(duration, 2 * segment.period)
    begin, rounds = first, 0
    while begin < last:
        if first > 0 and rounds > 100:
            # The phases differ by less than the resolution of doubles: the envelope decides.
            return first, first
        rounds += 1
        times = np.minimum(begin + spacing * np.arange(4097), duration)
        low = np.flatnonzero(load(times) <= floor)
        begin += 4096 * spacing
        if low.size == 0:
            continue
        i = int(low[0])
        if i == 0:
            return float(times[0]), float(times[0])
        above, below = float(times[i - 1]), float(times[i])
        end = brentq(lambda t: float(load(t)) - floor, above, below, xtol=1e-15, rtol=1e-14)
        # Where the load falls below the floor without reaching zero, its lowest sample.
        vanishes = float(load(below)) <= 0
        lost = brentq(lambda t: float(load(t)), above, below, xtol=1e-15) if vanishes else below
        return end, lost
    return duration, None
