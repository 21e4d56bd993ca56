"""Many motions at once, each under constant load and drive: to a time, or to a crossing.

Each motion has its own step length; steps are those of the explicit method of order 8. A crossing
is located by repeating the step that contains it with other lengths, so that the states at the
crossing have the accuracy of a step and not that of an interpolation. Derivatives with respect to
the parameters are those of the steps at fixed lengths.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.lax import stop_gradient
from jax.typing import ArrayLike

from asperity.loads import Excitation
from asperity.slider import QuasiStatic, Slider
from asperity.transients.equations import SegmentEquations, Tolerances
from asperity.transients.explicit import LIMITS, attempt_step
from asperity.transients.step_size import next_length

#: Tolerated error of a step: of logarithms and relative error of forces; absolute error of forces.
_TOLERANCES = Tolerances(rtol=1e-11, atol=1e-13)

#: Largest number of steps of a motion, with rejected ones.
MOST_STEPS = 60_000
_ROOT_STEPS = 60


class End(IntEnum):
    """Why a motion ended."""

    TIME = 0  # at the time that it was integrated to
    CROSSING = 1  # where the distance rises through zero
    STEADY = 2  # close to steady sliding, without a crossing
    RUNAWAY = 3  # beyond the velocity to which a slider without inertia can only run away
    TOO_MANY_STEPS = 4


class ConstantDrive(SegmentEquations):
    """Equations under the mean load, the drive moving at `pull` times V of the motion."""

    pull: ArrayLike = 1.0

    def at(self, t: Array) -> Excitation:
        """The excitation, the same at all times."""
        one = jnp.ones(jnp.shape(t))
        return Excitation(one, pull=self.pull * one)

    def log_slip(self, Y: Array) -> Array:
        """ln(v_pl / V) of the states Y, shape (size + 1, ...)."""
        return self.motion.log_slip(Y[:-1], self.at(jnp.zeros(Y.shape[1:])))


class Drive(NamedTuple):
    """The drive of a motion, and the conditions that end it; arrays of one shape.

    Attributes
    ----------
    pull : array
        Velocity of the drive over V.
    until : array
        Time (s) at which the motion ends at the latest.
    up : array
        The motion ends where this times ln(v_pl / V) rises through zero; 0 for never.
    level, width : array
        The last time at which F/W0 comes within `width` of `level` is located.
    steady : array
        The motion ends where ln(v_pl / V) and the distances of the law's states from steady sliding
        sum up to less than this; 0 for never.
    runaway : array
        ln(v_pl / V) at which the motion ends as a runaway.
    """

    pull: ArrayLike = 1.0
    until: ArrayLike = jnp.inf
    up: ArrayLike = 0.0
    level: ArrayLike = 0.0
    width: ArrayLike = jnp.inf
    steady: ArrayLike = 0.0
    runaway: ArrayLike = jnp.inf


class Reached(NamedTuple):
    """The end of a motion; arrays of one shape.

    Attributes
    ----------
    t : array
        Seconds.
    Y : array, shape (..., size + 1)
        States, and x K/W0.
    end : array
        `End`.
    steps : array
        Steps taken, rejected ones among them.
    last, last_Y : array
        Time at which the force last came within `Drive.width` of `Drive.level`, 0 if it was never
        farther from the level; and the states at that time.
    """

    t: Array
    Y: Array
    end: Array
    steps: Array
    last: Array
    last_Y: Array


def drive_many(slider: Slider, V: Array, drive: Drive, Y: Array) -> Reached:
    """Integrate many motions without inertia, each from its states.

    Parameters
    ----------
    slider : Slider
        Its parameters of shape (points,) or (), as `V` (m/s) and the arrays of `drive`.
    Y : array, shape (points, size + 1)
    """

    # All arrays get the same type and shape, so that one program serves all drives.
    def wide(a: ArrayLike) -> Array:
        return jnp.broadcast_to(jnp.asarray(a, jnp.float64), jnp.shape(V))

    return _drive_many(*jax.tree.map(wide, (slider, V, drive)), jnp.asarray(Y, jnp.float64))


@jax.jit
def _drive_many(slider: Slider, V: Array, drive: Drive, Y: Array) -> Reached:
    def one(slider: Slider, V: Array, drive: Drive, Y: Array) -> Reached:
        motion = QuasiStatic(slider, V, jnp.ones(()))
        system = ConstantDrive(motion, None, pull=drive.pull)
        return _DrivenMotion(system, drive, motion.steady()).from_states(Y)

    return jax.vmap(one)(slider, V, drive, Y)


class _Step(NamedTuple):
    """The beginning of a step, and its length."""

    t: Array
    Y: Array
    slope: Array
    h: Array


class _Progress(NamedTuple):
    """State of the loop over the steps."""

    next: _Step
    before: Array  # the two distances at the beginning of the next step
    crossed: tuple[_Step, _Step]  # the last steps in which they rose through zero
    end: Array
    steps: Array


class _DrivenMotion(NamedTuple):
    """One motion under its drive, with the states of steady sliding."""

    system: ConstantDrive
    drive: Drive
    steady: Array

    def from_states(self, Y: Array) -> Reached:
        """Integrate to the end, and locate both crossings."""
        zero, system = jnp.zeros(()), self.system
        length = stop_gradient(system.first_length(zero, Y))
        first = _Step(zero, Y, system.rates(system.at(zero), Y), length)
        none = first._replace(h=zero)
        start = _Progress(first, self.distances(Y), (none, none), jnp.asarray(-1), jnp.asarray(0))
        ended = jax.lax.while_loop(lambda run: run.end < 0, self.step, start)
        # One loop locates both crossings.
        steps = jax.tree.map(lambda a, b: jnp.stack([a, b]), *ended.crossed)
        s, there = jax.vmap(lambda step, n: _located(system, step, lambda Y: self.distances(Y)[n]))(
            steps, jnp.arange(2)
        )
        crossing = ended.end == End.CROSSING
        return Reached(
            jnp.where(crossing, steps.t[0] + s[0], ended.next.t),
            jnp.where(crossing, there[0], ended.next.Y),
            ended.end,
            ended.steps,
            steps.t[1] + s[1],
            there[1],
        )

    def distances(self, Y: Array) -> Array:
        """Numbers that rise through zero at the crossing, and where F/W0 comes near `level`."""
        system, drive = self.system, self.drive
        off = jnp.abs(system.motion.force(Y[:-1], system.at(jnp.zeros(()))) - drive.level)
        return stop_gradient(jnp.stack([drive.up * system.log_slip(Y), drive.width - off]))

    def step(self, run: _Progress) -> _Progress:
        """Try one step; the next begins at its end, or is shorter if its error was too large."""
        until, (t, Y, slope, h) = self.drive.until, run.next
        cut = t + h >= until
        h = jnp.where(cut, until - t, stop_gradient(h))
        trial = attempt_step(self.system, t, Y, h, slope, _TOLERANCES, rolled=True)
        good = trial.error < 1
        h_next = stop_gradient(next_length(h, trial, LIMITS))

        def accepted(new: Array, old: Array) -> Array:
            return jnp.where(good, new, old)

        now = self.distances(trial.end)
        rising = good & (run.before < 0) & (now >= 0)
        crossed = tuple(
            jax.tree.map(lambda a, b, r=r: jnp.where(r, a, b), _Step(t, Y, slope, h), step)
            for r, step in zip(rising, run.crossed, strict=True)
        )
        log_slip = stop_gradient(self.system.log_slip(trial.end))
        off = jnp.abs(trial.end[:-1] - self.steady)[1:].sum()
        lost = ~good & ~(t + h_next > t)
        ends = {
            End.CROSSING: rising[0],
            End.RUNAWAY: good & (log_slip > self.drive.runaway),
            End.TIME: good & cut,
            End.STEADY: good & (jnp.abs(log_slip) + off < self.drive.steady),
            End.TOO_MANY_STEPS: lost | (run.steps >= MOST_STEPS),
        }
        end = jnp.select(list(ends.values()), list(ends), -1)
        next_step = _Step(
            accepted(jnp.where(cut, until, t + h), t),
            accepted(trial.end, Y),
            accepted(trial.memory, slope),
            h_next,
        )
        return _Progress(next_step, accepted(now, run.before), crossed, end, run.steps + 1)


def _located(
    system: ConstantDrive, step: _Step, rising: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Length of the step that ends where `rising` crosses zero, and the states there (Illinois)."""
    h = stop_gradient(step.h)

    def body(carry: tuple) -> tuple:
        left, f_left, right, f_right, _, _, n = carry
        middle = right - f_right * (right - left) / (f_right - f_left)
        # The first length to try is that of the whole step.
        middle = jnp.where(n == 0, h, jnp.where(jnp.isfinite(middle), middle, 0.5 * (left + right)))
        Y = attempt_step(system, step.t, step.Y, middle, step.slope, _TOLERANCES, rolled=True).end
        value = rising(Y)
        beyond = (value * f_right < 0) | (n == 0)
        left_new = jnp.where(beyond, right, left)
        f_left_new = jnp.where(beyond, f_right, 0.5 * f_left)
        change = jnp.where(n == 0, h, jnp.abs(middle - right))
        return left_new, f_left_new, middle, value, change, Y, n + 1

    def unfinished(carry: tuple) -> Array:
        *_, change, _, n = carry
        return (n < _ROOT_STEPS) & (change > 1e-15 * h)

    zero, at_start = jnp.zeros(()), rising(step.Y)
    start = (zero, at_start, zero, at_start, h, step.Y, 0)
    _, _, s, _, _, Y, _ = jax.lax.while_loop(unfinished, body, start)
    return stop_gradient(s), Y
