"""Slide-hold-slide and velocity-step tests of an interface, from steady sliding.

In both the spring force has an extremum where the plastic velocity equals that of the drive, since
dF/dt = K (V - v_pl) up to a positive factor. That instant is located, not sampled.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from asperity._jax import jit_large
from asperity.slider import QuasiStatic, Slider
from asperity.transients.constant_drive import ConstantDrive, Drive, End, Reached, drive_many

#: Sliding counts as steady within this share of the change of force from the extremum.
SETTLED = 0.05
#: Sum of the distances from steady sliding, in logarithms, below which a motion ends that has not
#: reached the velocity of the drive.
_STEADY = 1e-9


class SettlingDistance(NamedTuple):
    """Displacements from an extremum to steady sliding; arrays of shape (points,).

    Attributes
    ----------
    end : array
        `End` of the motion.
    distance, slip : array
        Displacement of the drive and of the slider (m) from the beginning of reloading, or from the
        step, to the point from which the force stays within `SETTLED` of the change from its
        extremum. NaN if the motion does not reach this point.
    """

    end: Array
    distance: Array
    slip: Array


class HoldResponse(NamedTuple):
    """Observables of a hold; arrays of shape (points,).

    Attributes
    ----------
    level, minimum, maximum : array
        F/W0 in steady sliding, at the end of the hold, and at the maximum after it.
    hold_slip : array
        Displacement of the slider in the hold (m).
    velocity, velocity_at_maximum : array
        Plastic velocity at the end of the hold and at the maximum, over that of the drive.
    states, states_at_maximum : array, shape (points, size)
        States of the quasi-static motion at the end of the hold and at the maximum.
    distance, slip : array
        Displacement of the drive and of the slider (m) from the end of the hold to the maximum.
    end : array
        `End`: CROSSING where there is a maximum; STEADY where the force rises to its steady value
        without one, which is then the supremum.
    """

    level: Array
    minimum: Array
    maximum: Array
    hold_slip: Array
    velocity: Array
    velocity_at_maximum: Array
    states: Array
    states_at_maximum: Array
    distance: Array
    slip: Array
    end: Array


def hold(slider: Slider, V: Array, hold_time: Array) -> tuple[HoldResponse, Reached]:
    """Hold the drive of steadily sliding interfaces, and move it again until the maximum.

    Parameters
    ----------
    slider : Slider
        Its parameters, `V` (m/s) and `hold_time` (s) of shape (points,).

    Returns
    -------
    (HoldResponse, Reached)
        Observables of the hold, and the motion at the maximum, for `settle`.
    """
    steady = _steady(slider, V)
    holding = drive_many(slider, V, Drive(pull=0.0, until=hold_time), steady)
    reloaded = drive_many(slider, V, Drive(up=1.0, steady=_STEADY), holding.Y)
    return _after_hold(slider, V, steady, holding, reloaded)


@jit_large
def _steady(slider: Slider, V: Array) -> Array:
    """States of steady sliding with no displacement yet, shape (points, size + 1)."""
    return _undisplaced(QuasiStatic(slider, V, 1.0).steady())


@jit_large
def _after_hold(
    slider: Slider, V: Array, steady: Array, holding: Reached, reloaded: Reached
) -> tuple[HoldResponse, Reached]:
    motion = QuasiStatic(slider, V, 1.0)
    level = _force(motion, steady)
    lost = (holding.end != End.TIME) | (reloaded.end == End.TOO_MANY_STEPS)
    end = jnp.where(lost, End.TOO_MANY_STEPS, reloaded.end)
    maximum = _force(motion, reloaded.Y)
    maximum = jnp.where(end == End.STEADY, jnp.maximum(maximum, level), maximum)
    length_scale = slider.W0 / slider.K
    at_end, at_maximum = (
        jnp.exp(ConstantDrive(motion, None).log_slip(end_of.Y.T)) for end_of in (holding, reloaded)
    )
    response = HoldResponse(
        level,
        _force(motion, holding.Y),
        jnp.where(lost, jnp.nan, maximum),
        holding.Y[:, -1] * length_scale,
        at_end,
        at_maximum,
        holding.Y[:, :-1],
        reloaded.Y[:, :-1],
        jnp.where(lost, jnp.nan, reloaded.t * V),
        jnp.where(lost, jnp.nan, (reloaded.Y[:, -1] - holding.Y[:, -1]) * length_scale),
        end,
    )
    # The displacement counts from the beginning of reloading.
    from_there = reloaded.Y.at[:, -1].add(-holding.Y[:, -1])
    return response, reloaded._replace(Y=from_there, end=end)


class StepResponse(NamedTuple):
    """Observables of a velocity step; arrays of shape (points,).

    Attributes
    ----------
    before, extremum, after : array
        F/W0 in steady sliding before the step, at its first extremum after it, and in steady
        sliding at the new velocity.
    distance, slip : array
        Displacement of the drive and of the slider (m) from the step to the extremum.
    states_at_extremum : array, shape (points, size)
    end : array
        `End`: CROSSING where there is an extremum.
    """

    before: Array
    extremum: Array
    after: Array
    distance: Array
    slip: Array
    states_at_extremum: Array
    end: Array


def step(slider: Slider, V_before: Array, V: Array) -> tuple[StepResponse, Reached]:
    """Step the velocity of the drive (m/s) of steadily sliding interfaces, until the extremum.

    Shapes and the second result as of `hold`.
    """
    start = _steady(slider, V_before)
    drive = Drive(up=jnp.where(V_before < V, 1.0, -1.0), steady=_STEADY)
    reached = drive_many(slider, V, drive, start)
    return _after_step(slider, V, start, reached), reached


@jit_large
def _after_step(slider: Slider, V: Array, start: Array, reached: Reached) -> StepResponse:
    motion = QuasiStatic(slider, V, 1.0)
    lost = reached.end == End.TOO_MANY_STEPS
    length_scale = slider.W0 / slider.K
    return StepResponse(
        _force(motion, start),
        jnp.where(lost, jnp.nan, _force(motion, reached.Y)),
        _force(motion, _undisplaced(motion.steady())),
        jnp.where(lost, jnp.nan, reached.t * V),
        jnp.where(lost, jnp.nan, reached.Y[:, -1] * length_scale),
        reached.Y[:, :-1],
        reached.end,
    )


def settle(slider: Slider, V: Array, extremum: Reached, runaway: Array) -> SettlingDistance:
    """Integrate from an extremum to steady sliding, or until the slider runs away.

    Parameters
    ----------
    slider, V
        As in `hold`.
    extremum : Reached
        The second result of `hold` or `step`.
    runaway : array, shape (points,)
        ln(v_pl / V) at which a motion counts as a runaway.
    """
    settled = drive_many(slider, V, _settling_drive(slider, V, extremum, runaway), extremum.Y)
    return _settling(slider, V, extremum, settled)


@jit_large
def _settling_drive(slider: Slider, V: Array, extremum: Reached, runaway: Array) -> Drive:
    """The drive from an extremum on."""
    motion = QuasiStatic(slider, V, 1.0)
    level = _force(motion, _undisplaced(motion.steady()))
    width = SETTLED * jnp.abs(_force(motion, extremum.Y) - level)
    # Where all logarithms are this close to steady sliding the force stays within the width.
    close = jnp.minimum(1e-3, 0.05 * width)
    return Drive(level=level, width=width, runaway=runaway, steady=close)


@jit_large
def _settling(slider: Slider, V: Array, extremum: Reached, settled: Reached) -> SettlingDistance:
    crossing = extremum.end == End.CROSSING
    steady = crossing & (settled.end == End.STEADY)
    length_scale = slider.W0 / slider.K
    return SettlingDistance(
        jnp.where(crossing, settled.end, extremum.end),
        jnp.where(steady, (extremum.t + settled.last) * V, jnp.nan),
        jnp.where(steady, settled.last_Y[:, -1] * length_scale, jnp.nan),
    )


def _undisplaced(states: Array) -> Array:
    """States, shape (size, points), as Y, shape (points, size + 1), with no displacement yet."""
    return jnp.append(states, jnp.zeros((1, states.shape[1])), axis=0).T


def _force(motion: QuasiStatic, Y: Array) -> Array:
    at = ConstantDrive(motion, None).at(jnp.zeros(Y.shape[0]))
    return motion.force(Y[:, :-1].T, at)
