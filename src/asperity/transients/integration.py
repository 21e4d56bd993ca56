"""Integration through the segments of a programme, one compiled chunk of steps at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from types import ModuleType
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from asperity.loads import Programme
from asperity.loads.programme.segment import ProgrammeSegment
from asperity.slider import Motion
from asperity.transients import implicit
from asperity.transients.dense_output import UNDERFLOW, DenseOutput, StepChunk
from asperity.transients.discontinuities import states_across_break
from asperity.transients.equations import MotionSamples, SegmentEquations, step_samples
from asperity.transients.events import Event, EventDetector, EventThresholds
from asperity.transients.method_choice import NAMES, MethodChoice
from asperity.transients.pace import Pace, ringing_velocity
from asperity.transients.termination import Termination

#: Share of the mean load at which contact counts as lost: friction is F_i/W.
NO_LOAD = 1e-6


class Tolerances(NamedTuple):
    """Tolerated error of one step.

    Attributes
    ----------
    rtol : float
        Relative error; absolute for states that are logarithms.
    atol : float
        Absolute error of F/W0, v/V and F_i/W.
    """

    rtol: float
    atol: float


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
        Whether the ringing of the slider on its asperities is left out from here to the end of
        the segment.
    """

    segment: int
    t: float
    states: np.ndarray
    length: float = 0.0
    sampled: float = -np.inf
    ringless: bool = False


@dataclass(frozen=True)
class SegmentPart:
    """Some steps of one segment, with their events.

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
        Why the integration ends here; None where it goes on.
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
        self._ringing = 0.0 if self.method == "explicit" else ringing_velocity(self.motion)
        self._pace = Pace(self._ringing > 0, self.most_steps)

    def segment_parts(self) -> Iterator[SegmentPart]:
        """Integrate from the checkpoint to the end of the programme, or to a termination."""
        while self.checkpoint.segment < len(self.programme.segments):
            for part in self._segment(self.programme.segments[self.checkpoint.segment]):
                self.checkpoint = part.checkpoint
                yield part
                if part.termination is not None:
                    return
            self._enter(self.checkpoint.segment + 1)

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
        ringless = here.ringless
        system = self._system(segment, ringless)
        start = float(self.programme.starts[here.segment])
        end, lost = _contact(segment, float(self.motion.slider.W0))
        if lost is not None and lost <= here.t:
            yield self._standstill(system, start, Termination("loss of contact", start + lost))
            return
        self._detector.enter(system, start)
        self._pace.enter()
        t, Y = here.t, here.states
        length = here.length
        while t < end:
            method = implicit if ringless else self._choice.method
            chunk, samples = self._advance(method, system, t, Y, length, end)
            if not ringless and self._pace.worth_trying(chunk, t, end):
                without = self._system(segment, True)
                trial, trial_samples = self._advance(implicit, without, t, Y, length, end)
                if self._pace.gained(chunk, trial, t):
                    chunk, samples, system, ringless = trial, trial_samples, without, True
            if not ringless:
                self._choice.learn(chunk, self._pace.many(chunk, t, end))
            self._count(chunk, implicit if ringless else method, samples if ringless else None)
            dense_output = DenseOutput.of(chunk)
            reached = float(chunk.t)
            events, termination = self._detector.detect(dense_output, samples)
            if termination is None and lost is not None and reached >= end:
                termination = Termination("loss of contact", start + lost)
            if termination is None and int(chunk.status) == UNDERFLOW:
                termination = self._detector.underflow(reached, chunk.Y)
            if termination is None:
                termination = self._pace.out_of_reach(chunk, t, end, start, self.steps)
            if termination is not None:
                events = [e for e in events if e.time <= termination.time]
                events.append(Event(termination.time, termination.kind))
            ends_at = reached if termination is None else min(termination.time - start, reached)
            t, Y, length = reached, np.asarray(chunk.Y), float(chunk.next_length)
            states = Y
            if termination is not None and len(dense_output.begin):
                states = dense_output.evaluate(np.array([ends_at]))[:, 0]
            mark = Checkpoint(here.segment, ends_at, states, length, ringless=ringless)
            closes = termination is None and reached >= end
            yield SegmentPart(
                system, start, dense_output, ends_at, events, termination, closes, mark
            )
            if termination is not None:
                return

    def _standstill(
        self, system: SegmentEquations, start: float, termination: Termination
    ) -> SegmentPart:
        """A segment part without steps: a termination before the first one."""
        size = self.motion.size + 1
        nothing = DenseOutput(np.empty(0), np.empty(0), np.empty((2, size, 0)))
        here = self.checkpoint
        events = [Event(termination.time, termination.kind)]
        return SegmentPart(system, start, nothing, here.t, events, termination, False, here)

    def _system(self, segment: ProgrammeSegment, ringless: bool) -> SegmentEquations:
        return SegmentEquations(self.motion, segment, self._ringing if ringless else 0.0)

    def _advance(
        self,
        method: ModuleType,
        system: SegmentEquations,
        t: float,
        Y: np.ndarray,
        length: float,
        end: float,
    ) -> tuple[StepChunk, MotionSamples]:
        chunk = method.advance(system, t, Y, length, end, *self.tolerances)
        samples, chunk = step_samples(system, chunk), jax.device_get(chunk)
        return chunk, samples

    def _count(
        self, chunk: StepChunk, method: ModuleType, without_ringing: MotionSamples | None
    ) -> None:
        """Add the steps of a chunk, and the velocity of the ringing that they leave out."""
        self.steps += int(chunk.taken)
        self.rejected += int(chunk.rejected)
        self.methods.add(NAMES[method])
        if without_ringing is not None:
            rtol, atol = self.tolerances
            error = atol + rtol * float(np.abs(without_ringing.friction).max())
            velocity = float(self.motion.V) * self._ringing * error
            self.unresolved = max(self.unresolved, velocity)


def _contact(segment: ProgrammeSegment, W0: float) -> tuple[float, float | None]:
    """Where integration of a segment has to end, and where the load vanishes, if it does."""
    duration = float(segment.duration)
    floor = NO_LOAD * W0
    if segment.lowest_load > floor:
        return duration, None
    # Imported here because it takes a while to load, and contact is rarely lost.
    from scipy.optimize import brentq

    def load(t: np.ndarray | float) -> np.ndarray:
        return np.asarray(segment.load(jnp.asarray(t))[0])

    spacing = segment.longest_step / 16
    first = segment.surely_above(floor)
    last = duration if segment.period is None else min(duration, 2 * segment.period)
    begin, rounds = first, 0
    while begin < last:
        if first > 0 and rounds > 100:
            # Doubles no longer tell the phases apart: the envelope decides.
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
