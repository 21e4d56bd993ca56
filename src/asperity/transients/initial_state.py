"""States from which an integration starts."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.small_systems import jacobian_columns, solve_points
from asperity.errors import InputError
from asperity.laws import Law, State
from asperity.loads import Excitation, Programme
from asperity.slider import Motion
from asperity.transients.discontinuities import states_after_jump
from asperity.transients.equations import SegmentEquations
from asperity.transients.integration import NO_LOAD, Checkpoint

#: Newton steps for the states of the law under another load, and the longest of them.
_STEPS, _LEAP = 30, 2.0


def first_checkpoint(motion: Motion, programme: Programme, initial: Any) -> Checkpoint:
    """The beginning of a programme.

    Parameters
    ----------
    motion : Motion
    programme : Programme
    initial : "steady" or array, shape (size,)
        Steady sliding under the programme's load and velocity before its first step, or
        states of the motion.

    Returns
    -------
    Checkpoint
        The displacement is zero before the first step.

    Raises
    ------
    InputError
        If steady sliding is asked for at rest, states have the wrong number, they or their rates
        are not finite, the interface force is negative and the law is not defined there, or there
        is no contact at the beginning.
    """
    require_contact(programme, float(motion.slider.W0))
    if isinstance(initial, str):
        if initial != "steady":
            raise InputError(
                f"initial must be 'steady' or an array of states, got '{initial}'; "
                "leave it out to begin in steady sliding"
            )
        return Checkpoint(0, 0.0, steady_start(motion, programme))
    states = np.asarray(initial, float)
    if states.shape != (motion.size,) or not np.all(np.isfinite(states)):
        names = ", ".join((*motion.mechanical, *motion.slider.law.state_names))
        raise InputError(
            f"initial must be {motion.size} finite states ({names}), got {states.tolist()}; "
            "take them from a trajectory or begin in steady sliding"
        )
    _require_motion(motion, programme, states)
    return Checkpoint(0, 0.0, np.append(states, 0.0))


def _require_motion(motion: Motion, programme: Programme, states: np.ndarray) -> None:
    """Refuse states from which the equations of motion give no motion."""
    first = SegmentEquations(motion, programme.segments[0])
    rates, friction = (np.asarray(a) for a in _rates_and_friction(first, np.append(states, 0.0)))
    names = (*motion.mechanical, *motion.slider.law.state_names, "displacement")
    lost = [name for name, rate in zip(names, rates, strict=True) if not np.isfinite(rate)]
    if lost:
        steady = ", ".join(f"{s + 0.0:.4g}" for s in np.asarray(motion.steady()))
        raise InputError(
            f"initial must be states whose rates are numbers, got {_listed(states)}, of which that "
            f"of {lost[0]} is not finite; begin nearer to steady sliding, at {steady}"
        )
    # Where ln v is a state the slider goes forwards whatever the law says of so small a velocity.
    if friction < 0 and not (motion.signed or "log_velocity" in motion.mechanical):
        raise InputError(
            f"initial must leave an interface force that is not negative, got {_listed(states)} "
            f"and F_i/W = {friction:.4g}, for which '{motion.slider.law.name}' is not defined; "
            "take a law that is, such as 'regularised'"
        )


def _listed(states: np.ndarray) -> str:
    return f"[{', '.join(f'{s:.4g}' for s in states)}]"


@jax.jit
def _rates_and_friction(first: SegmentEquations, Y: Array) -> tuple[Array, Array]:
    """Rates (1/s) and F_i/W at the beginning of a segment."""
    at = first.at(jnp.zeros(()))
    return first.rates(at, Y), first.friction(at, Y[:-1])


def require_contact(programme: Programme, W0: float) -> None:
    """Refuse a programme that begins without contact.

    Parameters
    ----------
    programme : Programme
    W0 : float
        Mean load of the slider (N).

    Raises
    ------
    InputError
        If the load before the first step, or at its beginning, is not above 1e-6 of W0.
    """
    first = float(programme.load(0.0))
    for moment, load in (("before the first step", programme.level.load), ("at t = 0", first)):
        if not load > NO_LOAD * W0:
            raise InputError(
                f"programme.load must press the slider on, at more than {NO_LOAD:g} of W0 = "
                f"{W0:g} N, got {load:g} N {moment}; begin with the interface in contact"
            )


def steady_start(motion: Motion, programme: Programme) -> np.ndarray:
    """States after steady sliding under the load and at the velocity before the programme.

    With x K / W0 as the last; a step of the load at the very beginning is included.
    """
    level = programme.level
    if not level.velocity > 0:
        raise InputError(
            f"programme.velocity must be positive for a start in steady sliding, got "
            f"{level.velocity:g} m/s; give it, or the states at rest as initial"
        )
    first = SegmentEquations(motion, programme.segments[0])
    w = level.load / np.asarray(motion.slider.W0)
    return np.asarray(_steady(first, jnp.asarray(level.velocity), jnp.asarray(w)))


@jax.jit
def _steady(first: SegmentEquations, v: Array, w: Array) -> Array:
    """States from `v` (m/s) under the load `w`, over W0, at the beginning of a segment."""
    motion, law = first.motion, first.motion.slider.law
    state = _steady_state(law, v, w)
    pull = v / motion.V
    at = Excitation(w, pull=pull)
    friction = law.friction(v, state, w)
    mechanical = motion.mechanical_states(friction, pull, jnp.log(pull), at)
    states = jnp.stack(jnp.broadcast_arrays(*mechanical, *state, jnp.zeros(())))
    return states_after_jump(motion, at, first.at(jnp.zeros(())), states)


def _steady_state(law: Law, v: Array, w: Array) -> State:
    """States of the law at `v` under the load `w`, by Newton's method from those under w = 1."""
    start = jnp.stack([jnp.asarray(s, float) for s in law.steady_state(v)])

    def rates(packed: Array) -> Array:
        return jnp.stack(law.state_rate(v, v, tuple(packed), w))

    def step(_: int, packed: Array) -> Array:
        value, columns = jacobian_columns(rates, packed)
        change = solve_points(jnp.stack(columns, axis=1), -value)
        return packed + jnp.clip(change, -_LEAP, _LEAP)

    # Under w = 1 the initial guess is exact to the last digit.
    found = jax.lax.fori_loop(0, _STEPS, step, start)
    return tuple(jnp.where(w == 1, start, found))
