"""Marching through the segments of a programme, one compiled chunk of steps after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from asperity.loads import Programme
from asperity.loads.programme_segments import Segment
from asperity.slider import Motion
from asperity.solve.transients.breaks import across
from asperity.solve.transients.choice import Choice
from asperity.solve.transients.equations import Reading, System, read_steps
from asperity.solve.transients.events import Event, Thresholds, Watch
from asperity.solve.transients.pieces import UNDERFLOW, Chunk, Pieces
from asperity.solve.transients.stops import Stop

#: Share of the mean load at which contact counts as lost: friction is F_i/W.
_NO_LOAD = 1e-6


class Tolerances(NamedTuple):
    """Of the error of one step.

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
    """Where a march has come to: all that is needed to go on from there.

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
        Time of the programme up to which, inclusive, samples have been handed out (s).
    """

    segment: int
    t: float
    states: np.ndarray
    length: float = 0.0
    sampled: float = -np.inf


@dataclass(frozen=True)
class Stretch:
    """Some steps of one segment, and what happened on them.

    Attributes
    ----------
    system : System
    start : float
        Time of the programme at which the segment begins (s).
    pieces : Pieces
    end : float
        Time of the segment up to which the pieces count (s).
    events : list of Event
    stop : Stop or None
        Why nothing follows.
    closes : bool
        Whether the end of the segment is reached.
    checkpoint : Checkpoint
        Where it goes on.
    """

    system: System
    start: float
    pieces: Pieces
    end: float
    events: list[Event]
    stop: Stop | None
    closes: bool
    checkpoint: Checkpoint


@dataclass
class March:
    """One integration.

    Attributes
    ----------
    motion : Motion
        With scalar parameters and omega = 1 rad/s.
    programme : Programme
    checkpoint : Checkpoint
    tolerances : Tolerances
    thresholds : Thresholds
    method : str
        "explicit", "implicit", or "auto" for whichever suits the equations.
    steps, rejected : int
        So far.
    methods : set of str
        Those used so far.
    """

    motion: Motion
    programme: Programme
    checkpoint: Checkpoint
    tolerances: Tolerances
    thresholds: Thresholds
    method: str = "auto"
    steps: int = 0
    rejected: int = 0
    methods: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._choice = Choice(self.motion, self.method)
        self._watch = Watch(self.motion, self.thresholds)

    def stretches(self) -> Iterator[Stretch]:
        """Go on from the checkpoint to the end of the programme, or to where it stops."""
        while self.checkpoint.segment < len(self.programme.segments):
            for stretch in self._segment(self.programme.segments[self.checkpoint.segment]):
                self.checkpoint = stretch.checkpoint
                yield stretch
                if stretch.stop is not None:
                    return
            self._enter(self.checkpoint.segment + 1)

    def _enter(self, index: int) -> None:
        """Cross a break point."""
        here = self.checkpoint
        states = here.states
        if index < len(self.programme.segments):
            before = System(self.motion, self.programme.segments[here.segment])
            after = System(self.motion, self.programme.segments[index])
            states = across(before, here.t, after, states)
        self.checkpoint = Checkpoint(index, 0.0, states)

    def _segment(self, segment: Segment) -> Iterator[Stretch]:
        here = self.checkpoint
        system = System(self.motion, segment)
        start = float(self.programme.starts[here.segment])
        end, lost = _contact(segment, float(self.motion.slider.W0))
        if lost is not None and lost <= here.t:
            yield self._standstill(system, start, Stop("loss of contact", start + lost))
            return
        self._watch.enter(system, start)
        t, Y = here.t, here.states
        length = here.length
        while t < end:
            chunk, reading = self._advance(system, t, Y, length, end)
            pieces = Pieces.of(chunk)
            reached = float(chunk.t)
            events, stop = self._watch.look(pieces, reading)
            if stop is None and lost is not None and reached >= end:
                stop = Stop("loss of contact", start + lost)
            if stop is None and int(chunk.status) == UNDERFLOW:
                stop = self._watch.underflow(reached, chunk.Y)
            if stop is not None:
                events = [e for e in events if e.time <= stop.time]
                events.append(Event(stop.time, stop.kind))
            stops_at = reached if stop is None else min(stop.time - start, reached)
            t, Y, length = reached, np.asarray(chunk.Y), float(chunk.next_length)
            states = Y
            if stop is not None and len(pieces.begin):
                states = pieces.evaluate(np.array([stops_at]))[:, 0]
            mark = Checkpoint(here.segment, stops_at, states, length)
            closes = stop is None and reached >= end
            yield Stretch(system, start, pieces, stops_at, events, stop, closes, mark)
            if stop is not None:
                return

    def _standstill(self, system: System, start: float, stop: Stop) -> Stretch:
        """A stop before the first step of a segment."""
        size = self.motion.size + 1
        nothing = Pieces(np.empty(0), np.empty(0), np.empty((2, size, 0)))
        here = self.checkpoint
        events = [Event(stop.time, stop.kind)]
        return Stretch(system, start, nothing, here.t, events, stop, False, here)

    def _advance(
        self, system: System, t: float, Y: np.ndarray, length: float, end: float
    ) -> tuple[Chunk, Reading]:
        choice = self._choice
        chunk = choice.method.advance(system, t, Y, length, end, *self.tolerances)
        reading, chunk = read_steps(system, chunk), jax.device_get(chunk)
        self.steps += int(chunk.taken)
        self.rejected += int(chunk.rejected)
        self.methods.add(choice.name)
        choice.learn(chunk)
        return chunk, reading


def _contact(segment: Segment, W0: float) -> tuple[float, float | None]:
    """Where integration of a segment has to end, and where the load vanishes, if it does."""
    duration = float(segment.duration)
    floor = _NO_LOAD * W0
    if segment.lowest_load > floor:
        return duration, None
    # SciPy's optimisation takes a while to load, and contact is rarely lost.
    from scipy.optimize import brentq

    def load(t: np.ndarray | float) -> np.ndarray:
        return np.asarray(segment.load(jnp.asarray(t))[0])

    spacing = segment.longest_step / 16
    for begin in np.arange(0, duration, 4096 * spacing):
        times = np.minimum(begin + spacing * np.arange(4097), duration)
        low = np.flatnonzero(load(times) <= floor)
        if low.size == 0:
            continue
        i = int(low[0])
        if i == 0:
            return float(times[0]), float(times[0])
        above, below = float(times[i - 1]), float(times[i])
        end = brentq(lambda t: float(load(t)) - floor, above, below, xtol=1e-15, rtol=1e-14)
        # Where the load only grazes zero, the bottom of it.
        vanishes = float(load(below)) <= 0
        lost = brentq(lambda t: float(load(t)), above, below, xtol=1e-15) if vanishes else below
        return end, lost
    return duration, None
