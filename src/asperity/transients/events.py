"""Events: detected between points of a step, located on the dense output.

`Termination` is the reason why an integration ends before its programme.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asperity.slider import Motion, QuasiStatic, StiffInertial
from asperity.transients.dense_output import DenseOutput
from asperity.transients.equations import MotionSamples, SegmentEquations, motion_samples

_SENTENCES = {
    "loss of contact": (
        "contact was lost at t = {time:.9g} s: the programme takes the normal load to zero, and "
        "friction is defined under a positive load only; lower the modulation or raise the load"
    ),
    "runaway": (
        "the slider ran away at t = {time:.9g} s: without inertia nothing bounds its velocity "
        "where the spring is softer than the critical stiffness; switch inertia on, give a "
        "radiation damping, or stiffen the spring"
    ),
    "reversal": (
        "slip would reverse at t = {time:.9g} s, under a negative interface force, for which this "
        "law is not defined; take one that is, such as 'regularised'"
    ),
    "rest": (
        "the slider came to rest at t = {time:.9g} s, where its velocity has no logarithm: "
        "inertia without elastic asperities takes it as a state; take a law that is smooth at "
        "rest, such as 'regularised' with A above mu0/700, or leave inertia out"
    ),
    "no accurate step": (
        "no step however short was accurate at t = {time:.9g} s; the equations of motion change "
        "abruptly there or have no solution beyond"
    ),
    "too many steps": (
        "the integration gave up at t = {time:.9g} s: {detail} to the end of this part of the "
        "programme; shorten the programme, or raise most_steps and wait"
    ),
}


@dataclass(frozen=True)
class Termination:
    """End of an integration before that of its programme.

    Attributes
    ----------
    kind : str
        "loss of contact", "runaway", "reversal", "rest", "no accurate step" or
        "too many steps".
    time : float
        Seconds.
    detail : str
        Further text of the sentence.
    """

    kind: str
    time: float
    detail: str = ""

    def __str__(self) -> str:
        return _SENTENCES[self.kind].format(time=self.time, detail=self.detail)


#: Tolerances of the time of a root, relative, and of the distance at the root.
_ROOT = {"xatol": 0.0, "xrtol": 4e-16, "fatol": 1e-13, "frtol": 0.0}

#: v/V below which a slider whose velocity is about to vanish counts as at rest.
_REST = 1e-9


@dataclass(frozen=True)
class Event:
    """Slip, steadiness, reversal or termination at an instant.

    Attributes
    ----------
    time : float
        Seconds.
    kind : str
        "slip start", "slip end", "steady", "reversal", or the kind of a `Termination`. If
        `EventThresholds.level` is set, "fall" (through the level), "peak" and "trough" (of the
        force) take the place of "slip start" and "slip end".
    """

    time: float
    kind: str


@dataclass(frozen=True)
class EventThresholds:
    """Limits at whose crossing an event occurs.

    Attributes
    ----------
    slip : float
        Plastic velocity (m/s) of either sign above which the slider slips.
    runaway : float
        Plastic velocity (m/s) of either sign above which a slider without inertia counts as running
        away.
    steady : float
        Relative deviation below which sliding counts as steady, or change of a state over a period
        below which the response to a modulation counts as steady.
    level : float or None
        Value of F/W0: falls of the force through it, and extrema of the force under a steady drive,
        are events.
    """

    slip: float
    runaway: float
    steady: float
    level: float | None = None


#: Signed distance from a threshold; an event is a change of its sign.
Distance = Callable[[MotionSamples], np.ndarray]


class EventDetector:
    """Detects events, chunk by chunk.

    Parameters
    ----------
    motion : Motion
    thresholds : EventThresholds

    Attributes
    ----------
    steady : bool
        Whether the event "steady" of the current segment has been detected.
    """

    def __init__(self, motion: Motion, thresholds: EventThresholds) -> None:
        self._may_run_away = isinstance(motion, QuasiStatic)
        self._reverses = motion.signed
        self._may_come_to_rest = motion.signed and isinstance(motion, StiffInertial)
        V = float(motion.V)

        def log_speed(velocity: np.ndarray, threshold: float) -> np.ndarray:
            # The velocity of a slider that runs away may overflow.
            with np.errstate(over="ignore"):
                return np.log(np.maximum(np.abs(velocity * V), 1e-300)) - np.log(threshold)

        level = thresholds.level
        #: Events are changes of the sign of these distances.
        self._distances: dict[str, Distance] = {
            "slip": lambda r: log_speed(r.slip, thresholds.slip),
            "runaway": lambda r: log_speed(r.slip, thresholds.runaway),
            "unsteadiness": lambda r: np.log(r.unsteadiness / thresholds.steady),
            "backward slip": lambda r: r.reversal_margin,
            "above level": lambda r: r.force - level,
            # The drive moves at V where a level is given.
            "ahead of the drive": lambda r: r.velocity - 1,
        }
        self._has_level = level is not None
        self._tolerance = thresholds.steady
        self._before: dict[str, float] = {}

    def enter(self, system: SegmentEquations, start: float, steady: bool) -> None:
        """Begin a segment, or continue one that was `steady`; slip before it continues."""
        self._system, self._start, self.steady = system, start, steady
        self._periodic = _PeriodicSteadiness(system.segment.period, self._tolerance)

    def underflow(self, t: float, states: np.ndarray) -> Termination:
        """Why no step was accurate at the time `t` of the segment, from `states` (size + 1,)."""
        now = motion_samples(self._system, np.array([t]), states[:, None])
        kind = "no accurate step"
        if self._may_run_away and not self._distances["slip"](now)[0] < 0:
            kind = "runaway"
        if self._may_come_to_rest and now.velocity[0] < _REST:
            kind = "rest"
        return Termination(kind, self._start + t)

    def detect(
        self, dense_output: DenseOutput, samples: MotionSamples
    ) -> tuple[list[Event], Termination | None]:
        """Events of the steps in the order of time, and the first termination, if any.

        `samples` are those at the times `dense_output.refined`.
        """
        if len(dense_output.begin) == 0:
            return [], None
        times = dense_output.refined()

        def crossings(name: str) -> list[tuple[float, bool]]:
            return self._crossings(name, times, samples, dense_output)

        if self._has_level:
            result = [Event(t, "fall") for t, up in crossings("above level") if not up]
            extrema = crossings("ahead of the drive")
            result += [Event(t, "peak" if up else "trough") for t, up in extrema]
        else:
            slips = crossings("slip")
            result = [Event(t, "slip start" if up else "slip end") for t, up in slips]
        terminations = []
        if self._may_run_away:
            crossed = crossings("runaway")
            terminations += [
                Termination("runaway", t) for t, up in crossed if up and t > self._start
            ]
        reversals = crossings("backward slip")
        if self._reverses:
            result += [Event(t, "reversal") for t, _ in reversals]
        else:
            terminations += [Termination("reversal", t) for t, up in reversals if not up]
        result += self._steadiness(times, samples, dense_output)
        termination = min(terminations, key=lambda s: s.time, default=None)
        return sorted(result, key=lambda e: e.time), termination

    def _steadiness(
        self, times: np.ndarray, samples: MotionSamples, dense_output: DenseOutput
    ) -> list[Event]:
        """Steady sliding, or a steady response to a modulation, at most once in a segment."""
        if self.steady:
            return []
        t = self._periodic.detect(dense_output)
        if t is None:
            if not self._system.segment.constant:
                return []
            if samples.unsteadiness[0] < self._tolerance and dense_output.begin[0] == 0:
                t = 0.0
        if t is not None:
            self.steady = True
            return [Event(self._start + t, "steady")]
        self._before.pop("unsteadiness", None)
        crossed = self._crossings("unsteadiness", times, samples, dense_output)
        down = [t for t, up in crossed if not up][:1]
        self.steady = bool(down)
        return [Event(t, "steady") for t in down]

    def _crossings(
        self, name: str, times: np.ndarray, samples: MotionSamples, dense_output: DenseOutput
    ) -> list[tuple[float, bool]]:
        """Times (s) at which a distance changes its sign, and whether it rises."""
        distance = self._distances[name]
        with np.errstate(divide="ignore", invalid="ignore"):
            values = distance(samples)
        before = self._before.get(name)
        self._before[name] = float(values[-1])
        crossings = []
        # A step of the load crosses the threshold at the break point itself.
        if before is not None and np.sign(before) * np.sign(values[0]) < 0:
            crossings.append((self._start + float(times[0]), bool(values[0] > 0)))
        change = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
        if change.size:
            # Imported here because the module loads slowly.
            from scipy.optimize.elementwise import find_root

            def between(t: np.ndarray) -> np.ndarray:
                with np.errstate(divide="ignore", invalid="ignore"):
                    return distance(motion_samples(self._system, t, dense_output.evaluate(t)))

            ends = times[change], times[change + 1]
            roots = find_root(between, ends, tolerances=_ROOT).x
            # Within a step shorter than the spacing of doubles there is one time only.
            roots = np.where(np.isnan(roots), ends[1], roots)
            crossings += [
                (self._start + float(t), bool(values[i] < 0))
                for t, i in zip(roots, change, strict=True)
            ]
        return crossings


class _PeriodicSteadiness:
    """Compares the states once a period of a modulation: steady when they repeat themselves."""

    def __init__(self, period: float | None, tolerance: float) -> None:
        self._period, self._tolerance = period, tolerance
        self._last: np.ndarray | None = None
        self._change = np.inf
        self._next = 0

    def detect(self, dense_output: DenseOutput) -> float | None:
        """Time of the segment at which the response has become steady, once."""
        if self._period is None:
            return None
        # A resumed integration begins within the segment.
        self._next = max(self._next, int(np.ceil(dense_output.begin[0] / self._period)))
        last = int(np.floor(dense_output.end / self._period))
        times = self._period * np.arange(self._next, last + 1)
        times = times[times <= dense_output.end]
        self._next += len(times)
        if times.size == 0:
            return None
        # The displacement is left out, because it grows from period to period.
        states = dense_output.evaluate(times)[:-1]
        before = states[:, :1] if self._last is None else self._last
        changes = np.abs(np.diff(np.concatenate([before, states], axis=1))).max(0)
        if self._last is None:
            changes[0] = np.inf
        # Sum of the changes still to come if they fall geometrically. Changes that no longer fall
        # are errors of the steps: the factor is then the largest that is allowed.
        previous = np.append(self._change, changes[:-1])
        known = np.isfinite(previous) & (changes < previous)
        ratios = np.where(known, changes / np.where(known, previous, 1.0), 1.0)
        left = changes * np.minimum(ratios / np.maximum(1 - ratios, 1e-12), 1e3)
        self._last, self._change = states[:, -1:], changes[-1]
        steady = np.flatnonzero(left < self._tolerance)
        return float(times[steady[0]]) if steady.size else None
