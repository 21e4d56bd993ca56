"""Limit cycles of a slider that is pulled at a constant velocity: periodic stick-slip.

The motion begins far outside the cycle, as after slow sliding, or on the cycle of a slider with
similar parameters. It is integrated from one fall of the spring force through its level of steady
sliding to the next such fall. In every cycle the force passes that level: its extrema are at
instants at which the slider moves with the velocity V of the drive, and there the force differs
from that of steady sliding only by the state of the interface, upwards at a peak and downwards at a
trough. The states at the falls form a return map s -> P(s), whose fixed point is computed by
Newton's method with the derivatives of `asperity.transients.variational_equations`:

    (1 - P_s) ds = P(s) - s,      P_s = (1 - f q^T / (q f)) D_s,

with D_s the derivatives of the states at the end to those at the beginning, f the rates at the end
and q the gradient of the force. The eigenvalues of P_s are the multipliers of the cycle; only a
stable cycle is accepted. The same equation with P_p in the place of P(s) - s gives the derivatives
to the parameters.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010),
chapter 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.arrays import Float
from asperity.loads import Excitation, Programme, Slide
from asperity.slider import Motion, Slider
from asperity.slider.parameters import equation_parameters
from asperity.transients.dense_output import DenseOutput
from asperity.transients.equations import MotionSamples, motion_samples
from asperity.transients.inputs import checked_integration, steady_start
from asperity.transients.integration import Checkpoint, Integration, SegmentPart
from asperity.transients.variational_equations import stage_times, variations

#: Velocities of sliding before the first cycle, over that of the drive. The second is used where
#: the first slip after the slower sliding is too large for the law.
_SLOWER = (1e-3, 0.3)
#: Difference of F/W0 between peak and trough below which sliding is steady.
_STEADY = 1e-6
#: Largest number of slips in a period, and of slips that are integrated.
_MOST_SLIPS, _MOST_CYCLES = 8, 400
#: Longest cycles that are followed at once.
_CYCLES = 10
#: Newton's method ends where the change of every logarithm is below this multiple of the tolerance
#: of a step: the errors of the steps of a cycle add up to less.
_CLOSED = 100.0
#: Newton's method is abandoned, and the motion integrated further, where the change of a logarithm
#: is larger than this or after this number of steps.
_NEAR, _PASSES = 0.5, 8
#: Length of the motion that is integrated for one cycle, over the latest estimate of its period.
_LONGER = 1.2
#: Largest number of steps in a cycle.
_MOST_STEPS = 200_000
_TOO_MANY = (
    f"more than {_MOST_STEPS} steps do not end one; on elastic asperities the slider rings between "
    "slips, undamped: take the law without them, such as 'rice-ruina', or a faster drive"
)


class CycleEnd(Enum):
    """Outcome of a motion, as a text for the user."""

    REPEATS = "stick-slip"
    STEADY = "no stick-slip: the slider reaches steady sliding"
    IRREGULAR = (
        f"irregular: the motion does not repeat itself after up to {_MOST_SLIPS} slips, within "
        f"{_MOST_CYCLES}, or is too close to the onset of stick-slip"
    )
    STOPPED = "no cycle: "


@dataclass(frozen=True)
class LimitCycle:
    """A periodic motion, or the reason why there is none; numbers are then NaN.

    Attributes
    ----------
    end : CycleEnd
    result : str
        The same as a sentence.
    slips : int
        Number of slips in a period; 0 without stick-slip.
    period, stick_duration, slip_duration : float
        Seconds. The force falls in a slip, from a peak to a trough; sums over the slips of a
        period.
    peak, lowest : float
        Largest and smallest F/W0.
    """

    end: CycleEnd
    result: str
    slips: int = 0
    period: float = np.nan
    stick_duration: float = np.nan
    slip_duration: float = np.nan
    peak: float = np.nan
    lowest: float = np.nan
    _orbit: _Orbit | None = None
    _peak: float = 0.0

    @property
    def drop(self) -> float:
        """Largest less smallest F/W0."""
        return self.peak - self.lowest

    @cached_property
    def peak_velocity(self) -> float:
        """Largest velocity of the slider (m/s): the motion between steps is smooth."""
        # Imported here because the module loads slowly.
        from scipy.optimize import minimize_scalar

        if self._orbit is None:
            return np.nan
        run = self._orbit.run
        times = run.nodes(self._orbit.begin, self._orbit.end)
        at = int(np.argmax(run.samples(times).velocity))
        around = times[max(at - 1, 0)], times[min(at + 1, len(times) - 1)]
        scale = around[1] - around[0]
        best = minimize_scalar(
            lambda share: -float(run.samples(np.array([around[0] + share * scale])).velocity[0]),
            bounds=(0.0, 1.0),
            method="bounded",
        )
        return float(self._orbit.motion.V) * float(-best.fun)

    def force(self, t: Float) -> Float:
        """F/W0 at times (s) counted from a peak, of any period."""
        return self.force_and_rate(t)[0]

    def force_and_rate(self, t: Float) -> tuple[Float, Float]:
        """F/W0 and its rate, K (V - v)/W0 (1/s), at times (s) from a peak, of any period."""
        assert self._orbit is not None  # where the motion repeats itself
        orbit = self._orbit
        since, _ = orbit.within(self._peak + np.asarray(t))
        now = orbit.run.samples(since)
        later = orbit.step @ orbit.force_slopes.evaluate(since)[: len(orbit.first)]
        return now.force + later, float(orbit.motion.kappa) * (1 - now.velocity)

    def derivatives(self, t: Float, names: Sequence[str]) -> tuple[Float, Float]:
        """Derivatives of the force and of the period to parameters, with inertia.

        Parameters
        ----------
        t : array, shape (n,)
            As in `force`.
        names : sequence of str
            Parameters of the law, K, W0, M or eta.

        Returns
        -------
        force : array, shape (n, parameters)
            Derivatives of F/W0 per SI unit, at fixed times after a fall through the level of steady
            sliding; derivatives at fixed times after a peak differ by a shift in time.
        period : array, shape (parameters,)
        """
        assert self._orbit is not None  # where the motion repeats itself
        orbit, size = self._orbit, len(self._orbit.first)
        columns = [size + orbit.names.index(name) for name in names]
        first = orbit.solve(orbit.map[:, columns])
        period = orbit.duration[:size] @ first + orbit.duration[columns]
        since, number = orbit.within(self._peak + np.asarray(t))
        slopes = orbit.force_slopes.evaluate(since)
        force = slopes[:size].T @ first + slopes[columns].T
        return force - (number * self.force_and_rate(t)[1])[:, None] * period, period


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

    def nodes(self, begin: float, end: float) -> Float:
        """Beginnings of the steps between two times (s), with these."""
        times = np.concatenate([part.dense_output.begin for part in self.parts])
        return np.concatenate([[begin], times[(times > begin) & (times < end)], [end]])


@dataclass(frozen=True)
class _Orbit:
    """A motion from one fall to another, with the derivatives of the return map.

    The force and the period are those of the motion with Newton's step to first order, so that they
    do not depend on where the motion began.

    Attributes
    ----------
    run : _Run
    begin, end : float
        Seconds.
    first, last : array, shape (size,)
        States at the falls.
    names : tuple of str
        Parameters.
    force_slopes : DenseOutput
        Derivatives of F/W0 to the first states and to the parameters, at all times.
    map : array, shape (size, size + parameters)
        Derivatives of the last states, on the section, to the first states and to the parameters.
    duration : array, shape (size + parameters,)
        Derivatives of the time between the falls (s).
    """

    run: _Run
    begin: float
    end: float
    first: Float
    last: Float
    names: tuple[str, ...]
    force_slopes: DenseOutput
    map: Float
    duration: Float

    @classmethod
    def of(cls, run: _Run, begin: float, end: float) -> _Orbit:
        """With derivatives by all parameters of the equations."""
        motion = run.parts[0].system.motion
        names = tuple(equation_parameters(motion))
        first, last = run.states(np.array([begin, end]))[:-1].T
        nodes = run.nodes(begin, end)
        steps = nodes[:-1], np.diff(nodes)
        times = stage_times(*steps)
        states = run.states(times.ravel())[:-1].reshape(-1, *times.shape)
        ends, slopes = variations(motion, *steps, states, names)
        rates, gradient = (np.asarray(a) for a in _rates_and_gradient(motion, last))
        later = gradient @ ends / (gradient @ rates)
        return cls(
            run, begin, end, first, last, names, slopes, ends - np.outer(rates, later), -later
        )

    @property
    def motion(self) -> Motion:
        """The equation of motion."""
        return self.run.parts[0].system.motion

    @cached_property
    def step(self) -> Float:
        """Newton's step of the first states."""
        return self.solve(self.last - self.first)

    @property
    def period(self) -> float:
        """Seconds."""
        return float(self.end - self.begin + self.duration[: len(self.first)] @ self.step)

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie within the unit circle."""
        size = len(self.first)
        return bool(np.abs(np.linalg.eigvals(self.map[:, :size])).max() < 1)

    def solve(self, change: Float) -> Float:
        """Changes of the first states that compensate changes of the last states."""
        size = len(self.first)
        return np.asarray(np.linalg.solve(np.eye(size) - self.map[:, :size], change))

    def within(self, t: Float) -> tuple[Float, Float]:
        """Times of the motion at times (s) of any period, and the number of the period."""
        number = np.floor((t - self.begin) / self.period)
        return t - number * self.period, number


@jax.jit
def _rates_and_gradient(motion: Motion, Y: Array) -> tuple[Array, Array]:
    """Rates (1/s) and the gradient of F/W0 at states, shapes (size,)."""
    at = Excitation(jnp.ones(()))
    return motion.rates(Y, at), jax.grad(lambda Y: jnp.reshape(motion.force(Y, at), ()))(Y)


def limit_cycle(
    slider: Slider,
    V: float,
    *,
    inertia: bool = True,
    radiation_damping: float | None = None,
    rtol: float = 1e-9,
    near: LimitCycle | None = None,
) -> LimitCycle:
    """The final motion of a slider that is pulled at a constant velocity.

    Parameters
    ----------
    slider : Slider
        With one number for each parameter.
    V : float
        Velocity of the drive (m/s), positive.
    inertia, radiation_damping, rtol
        As in `asperity.transients.transient`.
    near : LimitCycle, optional
        Cycle of a slider with similar parameters and the same law, used as the initial guess.

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
    if near is not None and near._orbit is not None:
        cycle = _closed(integration, near._orbit.first, near.slips, near.period)
        if cycle is not None:
            return cycle
    before = (Programme(slide, load=W0, velocity=share * V) for share in _SLOWER)
    cycle = _followed(integration, steady_start(motion, next(before))[:-1])
    if cycle.end is CycleEnd.STOPPED and _TOO_MANY not in cycle.result:
        smaller = _followed(integration, steady_start(motion, next(before))[:-1])
        if smaller.end is CycleEnd.STEADY:
            smaller = replace(smaller, result=f"{smaller.result}; from farther off {cycle.result}")
        cycle = cycle if smaller.end is CycleEnd.STOPPED else smaller
    return cycle


def _followed(integration: Integration, Y: Float) -> LimitCycle:
    """The cycle that a motion from the given states reaches."""
    falls: list[Float] = []
    count = 0
    while count < _MOST_CYCLES:
        run = _motion(integration, Y, 0.0 if falls else None, 1 if falls else 2)
        if isinstance(run, LimitCycle):
            return run
        if not run.cycles:
            return _stopped("the force does not come back to that of steady sliding")
        count += len(run.cycles)
        falls += list(run.states(np.array([c.end for c in run.cycles]))[:-1].T)
        Y = falls[-1]
        sizes = [
            _size(integration.motion, Y - before, Y) for before in falls[-2 : -2 - _MOST_SLIPS : -1]
        ]
        slips = int(np.argmin(sizes)) + 1
        last = run.cycles[-min(slips, len(run.cycles)) :]
        period = (last[-1].end - last[0].begin) * slips / len(last)
        cycle = _closed(integration, Y, slips, period)
        if cycle is not None:
            return cycle
    return LimitCycle(CycleEnd.IRREGULAR, CycleEnd.IRREGULAR.value)


def _motion(
    integration: Integration, Y: Float, fall: float | None, needed: int
) -> _Run | LimitCycle:
    """The motion from states over a number of cycles, or where it ends before."""
    following = replace(integration, checkpoint=Checkpoint(0, fall or 0.0, np.append(Y, 0.0)))
    run = _Run(fall)
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
    if run.cycles:
        highs, lows = (np.array([c[i] for c in run.cycles]) for i in (2, 1))
        if (run.samples(highs).force - run.samples(lows).force)[-1] < _STEADY:
            return LimitCycle(CycleEnd.STEADY, CycleEnd.STEADY.value)
    return run


def _closed(integration: Integration, Y: Float, slips: int, period: float) -> LimitCycle | None:
    """The stable cycle of a given number of slips near states at a fall, by Newton's method."""
    tolerance = _CLOSED * integration.tolerances.rtol
    end = integration.programme.duration
    for _ in range(_PASSES):
        # From where little more than a period is left, so that no steps are wasted.
        run = _motion(integration, Y, max(end - _LONGER * period, 0.0), slips)
        if isinstance(run, LimitCycle) or len(run.cycles) < slips:
            return None
        try:
            orbit = _Orbit.of(run, run.cycles[0].begin, run.cycles[slips - 1].end)
            size = _size(integration.motion, orbit.step, orbit.first)
        except np.linalg.LinAlgError:  # of rates that are not finite, or at a fold
            return None
        if not size < _NEAR:
            return None
        if size < tolerance:
            fewer = _fewer(orbit, slips, tolerance)
            if fewer < slips:
                return _closed(integration, orbit.first, fewer, period * fewer / slips)
            return _described(orbit, slips) if orbit.stable else None
        Y, period = orbit.first + orbit.step, orbit.period
    return None


def _fewer(orbit: _Orbit, slips: int, tolerance: float) -> int:
    """Number of slips after which the states repeat."""
    for count in range(1, slips):
        after = orbit.run.states(np.array([orbit.run.cycles[count - 1].end]))[:-1, 0]
        if slips % count == 0 and _size(orbit.motion, after - orbit.first, after) < 2 * tolerance:
            return count
    return slips


def _size(motion: Motion, change: Float, states: Float) -> float:
    """Largest change of a state: of logarithms and of F/W0, and relative of velocities."""
    scale = np.ones(len(states))
    linear = [i for i, name in enumerate(motion.mechanical) if name == "velocity"]
    scale[linear] = np.abs(states[linear])
    return float(np.abs(change / scale).max())


def _stopped(why: str) -> LimitCycle:
    return LimitCycle(CycleEnd.STOPPED, CycleEnd.STOPPED.value + why)


def _described(orbit: _Orbit, slips: int) -> LimitCycle:
    """A cycle from its orbit."""
    run = orbit.run
    cycles = run.cycles[:slips]
    lows, highs = (np.array([getattr(c, name) for c in cycles]) for name in ("trough", "peak"))
    stick = float(np.sum(highs - lows))
    peak = float(run.samples(highs).force.max())
    lowest = float(run.samples(lows).force.min())
    sentence = CycleEnd.REPEATS.value + (f", {slips} slips in a period" if slips > 1 else "")
    return LimitCycle(
        CycleEnd.REPEATS, sentence, slips, orbit.period, stick, orbit.period - stick, peak, lowest,
        orbit, float(highs[-1]),
    )  # fmt: skip
