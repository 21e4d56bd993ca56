"""Limit cycles of a slider that is pulled at one velocity: stick-slip, as the motion repeats it.

The motion begins far outside the cycle, as after slow sliding, and is followed from one fall of the
spring force through its level of steady sliding to the next: under a drive of velocity V the force
has its extrema where the slider moves at V, where only its state can make it differ from steady
sliding, to both sides of it. The states at these falls are a return map. Stick-slip forgets the
cycle before within a few cycles; close to the onset of stick-slip, where it does not, the states
are extrapolated to where the changes of the last cycles tend (Aitken's method).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from asperity.loads import Excitation, Programme, Slide
from asperity.slider import Slider
from asperity.transients.equations import MotionSamples, motion_samples
from asperity.transients.inputs import checked_integration, steady_start
from asperity.transients.integration import Checkpoint, Integration, SegmentPart

Float = NDArray[np.float64]

#: Velocities of the sliding before the first cycle, over that of the drive: the second where the
#: first slip from the first is too large for the law.
_SLOWER = (1e-3, 0.3)
#: Change of the states (logarithms, or relative) left to come at which a motion repeats itself, and
#: the smallest change that is none of the errors of the steps.
_REPEATED, _ERRORS = 1e-8, 1e-7
#: Change over which two slips are two of one period, and not one that still changes.
_SAME = 1e-5
#: Difference of F/W0 between peak and trough below which sliding is steady.
_STEADY = 1e-6
#: Slips in a period, and slips that are followed, at most.
_MOST_SLIPS, _MOST_CYCLES = 8, 400
#: Longest cycles that are followed at once.
_CYCLES = 10
#: Cosine between two changes, and the ratio of them, from which they are extrapolated; and how far.
_ALIGNED, _SLOW, _FAR = 0.95, 0.2, 0.5
#: Steps in a cycle, at most.
_MOST_STEPS = 200_000
_TOO_MANY = (
    f"more than {_MOST_STEPS} steps do not end one; on elastic asperities the slider rings between "
    "slips, undamped: take the law without them, such as 'rice-ruina', or a faster drive"
)
#: Points between two samples among which the fastest is looked for, and how often.
_FINER, _ROUNDS = 17, 3


class CycleEnd(Enum):
    """What becomes of a motion; the text is what a user reads."""

    REPEATS = "stick-slip"
    STEADY = "no stick-slip: the slider comes to slide steadily"
    IRREGULAR = (
        f"irregular: the motion does not repeat itself after up to {_MOST_SLIPS} slips, within "
        f"{_MOST_CYCLES}"
    )
    SLOW = (
        f"not converged: the motion still changes after {_MOST_CYCLES} slips; the operating point "
        "is too close to the onset of stick-slip"
    )
    STOPPED = "no cycle: "


@dataclass(frozen=True)
class LimitCycle:
    """A motion that repeats itself, or why there is none; numbers are NaN then.

    Attributes
    ----------
    end : CycleEnd
    result : str
        The same as a sentence.
    slips : int
        In a period; 0 without stick-slip.
    period, stick_duration, slip_duration : float
        Seconds. The force falls in a slip, from a peak to a trough; sums over the slips of a
        period.
    peak, lowest : float
        Largest and smallest F/W0.
    peak_velocity : float
        Largest velocity of the slider (m/s).
    """

    end: CycleEnd
    result: str
    slips: int = 0
    period: float = np.nan
    stick_duration: float = np.nan
    slip_duration: float = np.nan
    peak: float = np.nan
    lowest: float = np.nan
    peak_velocity: float = np.nan
    _run: _Run | None = None
    _peak: float = 0.0
    _begin: float = 0.0

    @property
    def drop(self) -> float:
        """Largest less smallest F/W0."""
        return self.peak - self.lowest

    def force(self, t: Float) -> Float:
        """F/W0 at times (s) counted from a peak, of any period."""
        assert self._run is not None  # where the motion repeats itself
        since = np.mod(self._peak - self._begin + np.asarray(t, float), self.period)
        return self._run.samples(self._begin + since).force


class _Cycle(NamedTuple):
    """Times (s) of the falls about a cycle, and of its trough and peak in between."""

    begin: float
    trough: float
    peak: float
    end: float


@dataclass
class _Run:
    """Some cycles of the motion, with the events of its force.

    Attributes
    ----------
    fall : float or None
        Time (s) of the last fall through the level; None before the first.
    """

    fall: float | None
    parts: list[SegmentPart] = field(default_factory=list)
    cycles: list[_Cycle] = field(default_factory=list)
    _turns: dict[str, list[float]] = field(default_factory=lambda: {"trough": [], "peak": []})

    def add(self, part: SegmentPart) -> None:
        """Add steps, and the cycles that they complete."""
        self.parts.append(part)
        turns = self._turns
        for event in part.events:
            if event.kind in turns:
                turns[event.kind].append(event.time)
            elif event.kind == "fall":
                # Before the first fall there may be no trough.
                if self.fall is not None and all(turns.values()):
                    lows, highs = (np.array(turns[kind]) for kind in ("trough", "peak"))
                    low = lows[np.argmin(self.samples(lows).force)]
                    high = highs[np.argmax(self.samples(highs).force)]
                    self.cycles.append(_Cycle(self.fall, float(low), float(high), event.time))
                self.fall = event.time
                for times in turns.values():
                    times.clear()

    def samples(self, t: Float) -> MotionSamples:
        """Forces and velocities at times (s)."""
        # Under a constant drive the excitation does not depend on time.
        return motion_samples(self.parts[0].system, t, self.states(t))

    def states(self, t: Float) -> Float:
        """States with the displacement at times (s), shape (size + 1, n)."""
        Y = np.empty((len(self.parts[0].checkpoint.states), len(t)))
        ends = [part.end for part in self.parts]
        which = np.minimum(np.searchsorted(ends, t), len(ends) - 1)
        for i in np.unique(which):
            Y[:, which == i] = self.parts[i].dense_output.evaluate(t[which == i])
        return Y

    def fastest(self, begin: float, end: float) -> float:
        """Largest velocity over V between two times (s)."""
        times = np.concatenate([part.dense_output.refined() for part in self.parts])
        times = np.concatenate([[begin], times[(times > begin) & (times < end)], [end]])
        for _ in range(_ROUNDS):
            at = int(np.argmax(self.samples(times).velocity))
            around = times[max(at - 1, 0)], times[min(at + 1, len(times) - 1)]
            times = np.linspace(*around, _FINER)
        return float(self.samples(times).velocity.max())


def limit_cycle(
    slider: Slider,
    V: float,
    *,
    inertia: bool = True,
    radiation_damping: float | None = None,
    rtol: float = 1e-9,
) -> LimitCycle:
    """The motion that a slider pulled at a constant velocity comes to.

    Parameters
    ----------
    slider : Slider
        With one number for each parameter.
    V : float
        Velocity of the drive (m/s), positive.
    inertia, radiation_damping, rtol
        As in `asperity.transients.transient`.

    Returns
    -------
    LimitCycle

    Raises
    ------
    InputError
        If a value breaks its rule.
    """
    K, W0, M = (float(np.asarray(a)) for a in (slider.K, slider.W0, slider.M))
    # Longer than a cycle, in which the spring cannot be loaded far beyond steady sliding.
    longest = 2 * float(slider.law.mu_ss(V)) * W0 / (K * V) + 2 * np.pi * np.sqrt(M / K)
    slide = Slide(_CYCLES * longest)
    integration = checked_integration(
        slider, Programme(slide, load=W0, velocity=V), inertia=inertia,
        radiation_damping=radiation_damping, rtol=rtol, steady_tolerance=_STEADY,
    )  # fmt: skip
    motion = integration.motion
    level = float(motion.force(motion.steady(), Excitation(jnp.ones(()))))
    thresholds = replace(integration.thresholds, level=level)
    integration = replace(integration, thresholds=thresholds)
    before = (Programme(slide, load=W0, velocity=share * V) for share in _SLOWER)
    cycle = _followed(integration, steady_start(motion, next(before)))
    if cycle.end is CycleEnd.STOPPED and _TOO_MANY not in cycle.result:
        smaller = _followed(integration, steady_start(motion, next(before)))
        if smaller.end is CycleEnd.STEADY:
            smaller = replace(smaller, result=f"{smaller.result}; from farther off {cycle.result}")
        cycle = cycle if smaller.end is CycleEnd.STOPPED else smaller
    return cycle


def _followed(integration: Integration, Y: Float) -> LimitCycle:
    """The cycle that a motion from the states comes to."""
    motion = integration.motion
    sections = _Sections(motion.mechanical)
    needed, count = 2, 0
    run = _Run(None)
    while count < _MOST_CYCLES:
        following = replace(integration, checkpoint=Checkpoint(0, 0.0, Y))
        for part in following.segment_parts():
            run.add(part)
            if part.termination is not None:
                many = part.termination.kind == "too many steps"
                return _stopped(_TOO_MANY if many else str(part.termination))
            if any(event.kind == "steady" for event in part.events):
                return LimitCycle(CycleEnd.STEADY, CycleEnd.STEADY.value)
            if len(run.cycles) >= needed:
                break
            if following.steps > _MOST_STEPS:
                return _stopped(_TOO_MANY)
        if not run.cycles:
            return _stopped("the force does not come back to that of steady sliding")
        count += len(run.cycles)
        highs, lows = (np.array([c[i] for c in run.cycles]) for i in (2, 1))
        amplitude = (run.samples(highs).force - run.samples(lows).force)[-1]
        if amplitude < _STEADY:
            return LimitCycle(CycleEnd.STEADY, CycleEnd.STEADY.value)
        sections.add(run.states(np.array([c.end for c in run.cycles]))[:-1].T)
        slips = sections.repeated()
        if slips and slips <= len(run.cycles):
            return _described(run, slips, float(motion.V))
        needed = max(slips, 1)
        Y = np.append(sections.next(), 0.0)
        run = _Run(0.0)
    end = CycleEnd.SLOW if sections.tends else CycleEnd.IRREGULAR
    return LimitCycle(end, end.value)


def _stopped(why: str) -> LimitCycle:
    return LimitCycle(CycleEnd.STOPPED, CycleEnd.STOPPED.value + why)


def _described(run: _Run, slips: int, V: float) -> LimitCycle:
    """The last period of a motion."""
    cycles = run.cycles[-slips:]
    begin, end = cycles[0].begin, cycles[-1].end
    lows, highs = (np.array([getattr(c, name) for c in cycles]) for name in ("trough", "peak"))
    stick = float(np.sum(highs - lows))
    peak = float(run.samples(highs).force.max())
    lowest = float(run.samples(lows).force.min())
    sentence = CycleEnd.REPEATS.value + (f", {slips} slips in a period" if slips > 1 else "")
    return LimitCycle(
        CycleEnd.REPEATS, sentence, slips, end - begin, stick, end - begin - stick, peak, lowest,
        V * run.fastest(begin, end), run, float(highs[-1]), begin,
    )  # fmt: skip


class _Sections:
    """States at the falls of the force, one after the other."""

    def __init__(self, mechanical: tuple[str, ...]) -> None:
        self._linear = [i for i, name in enumerate(mechanical) if name == "velocity"]
        self._states: list[Float] = []
        #: Ratio of changes over so many slips, as they showed it last.
        self._ratios: dict[int, float] = {}
        self.tends = False

    def add(self, states: Float) -> None:
        """Add states, shape (n, size)."""
        self._states += list(states)

    def _change(self, slips: int, before: int = 0) -> Float | None:
        """Change over so many slips, the last of them or so many before."""
        if len(self._states) <= slips + before:
            return None
        new, old = self._states[-1 - before], self._states[-1 - before - slips]
        change = new - old
        # A velocity counts relatively.
        change[self._linear] /= np.abs(new[self._linear])
        return np.asarray(change)

    def repeated(self) -> int:
        """After how many slips the motion repeats itself; 0 where it does not."""
        for slips in range(1, _MOST_SLIPS + 1):
            last, before = self._change(slips), self._change(slips, slips)
            if last is None or before is None:
                return 0
            size, old = np.abs(last).max(), np.abs(before).max()
            if old > _ERRORS:
                self._ratios[slips] = size / old
            # Where no change was larger the cycle before is forgotten within one.
            ratio = self._ratios.get(slips, 0.0)
            if ratio < 1 and size * max(ratio / (1 - ratio), 1.0) < _REPEATED:
                return slips
            if size < _SAME:
                return 0
        return 0

    def next(self) -> Float:
        """States from which to go on: the last ones, or those to which the changes tend."""
        last, before = self._change(1), self._change(1, 1)
        self.tends = False
        if last is None or before is None:
            return self._states[-1]
        ratio = float(last @ before / (before @ before))
        cosine = float(last @ before / (np.linalg.norm(last) * np.linalg.norm(before)))
        self.tends = cosine > _ALIGNED and _SLOW < ratio < 1
        if not self.tends:
            return self._states[-1]
        left = (self._states[-1] - self._states[-2]) * (ratio / (1 - ratio))
        size = np.abs(left).max()
        ahead = self._states[-1] + left * min(1.0, _FAR / size)
        self._states = [ahead]
        return ahead
