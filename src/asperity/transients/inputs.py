"""Checked arguments of a transient in SI, and its initial states."""

from __future__ import annotations

from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.errors import Argument, InputError, require
from asperity.loads import Excitation, Programme
from asperity.parameters.arguments import number, shown, typed
from asperity.slider import Motion, Slider, equation_of_motion, reversing
from asperity.transients.equations import SegmentEquations, Tolerances, states_after_jump
from asperity.transients.events import EventThresholds
from asperity.transients.integration import NO_LOAD, Checkpoint, Integration


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
        If the start is steady sliding at rest, states have the wrong number, they or their rates
        are not finite, the interface force is negative and the law is not defined there, or there
        is no contact at the beginning.
    """
    require_contact(programme, float(motion.slider.W0))
    if isinstance(initial, str):
        rule, advice = "be 'steady' or an array of states", "leave it out to begin steadily"
        require(initial == "steady", "initial", rule, f"'{initial}'", advice)
        return Checkpoint(0, 0.0, steady_start(motion, programme))
    try:
        states = np.asarray(initial, float)
    except (TypeError, ValueError, OverflowError):
        states = np.array(np.nan)
    names = ", ".join((*motion.mechanical, *motion.slider.law.state_names))
    holds = states.shape == (motion.size,) and bool(np.all(np.isfinite(states)))
    advice = "take them from a trajectory or begin in steady sliding"
    rule = f"be {motion.size} finite states ({names})"
    got = states.tolist() if 0 < states.size < 20 and states.ndim else shown(initial)
    require(holds, "initial", rule, got, advice)
    _require_motion(motion, programme, states)
    return Checkpoint(0, 0.0, np.append(states, 0.0))


def _require_motion(motion: Motion, programme: Programme, states: np.ndarray) -> None:
    """Refuse states from which the equations of motion give no motion."""
    first = SegmentEquations(motion, programme.segments[0])
    rates, friction, margin = map(np.asarray, _beginning(first, np.append(states, 0.0)))
    names = (*motion.mechanical, *motion.slider.law.state_names, "displacement")
    listed = f"[{', '.join(f'{s:.4g}' for s in states)}]"
    lost = [name for name, rate in zip(names, rates, strict=True) if not np.isfinite(rate)]
    if lost:
        steady = ", ".join(f"{s + 0.0:.4g}" for s in np.asarray(motion.steady()))
        got = f"{listed}, of which that of {lost[0]} is not finite"
        advice = f"begin nearer to steady sliding, at {steady}"
        raise InputError("initial", "be states whose rates are numbers", got, advice)
    # With ln v as a state the slider always moves forwards, even at the smallest velocity.
    defined = margin >= 0 or "log_velocity" in motion.mechanical
    law, advice = motion.slider.law.name, "take a law that is, such as 'regularised'"
    got = f"{listed} and F_i/W = {friction:.4g}, for which '{law}' is not defined"
    require(defined, "initial", "leave an interface force that is not negative", got, advice)


@jit_large
def _beginning(first: SegmentEquations, Y: Array) -> tuple[Array, Array, Array]:
    """Rates (1/s), F_i/W and reversal margin at the beginning of a segment."""
    at, motion, states = first.at(jnp.zeros(())), first.motion, Y[:-1]
    return first.rates(at, Y), motion.friction(states, at), motion.reversal_margin(states, at)


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
        rule = f"press the slider on, at more than {NO_LOAD:g} of W0 = {W0:g} N"
        got, advice = f"{load:g} N {moment}", "begin with the interface in contact"
        require(load > NO_LOAD * W0, "programme.load", rule, got, advice)


def require_sliding(programme: Programme) -> None:
    """Refuse a programme that cannot begin in steady sliding: its first velocity is not positive.

    Raises
    ------
    InputError
    """
    velocity = programme.level.velocity
    rule = "be positive for a start in steady sliding"
    advice = f"give it, or the states at rest as {Argument('initial')}"
    require(velocity > 0, "programme.velocity", rule, f"{velocity:g} m/s", advice)


def steady_start(motion: Motion, programme: Programme) -> np.ndarray:
    """States of steady sliding under the load and at the velocity before the programme.

    With x K / W0 as the last; a step of the load at the very beginning is included.
    """
    require_sliding(programme)
    level = programme.level
    first = SegmentEquations(motion, programme.segments[0])
    w = level.load / np.asarray(motion.slider.W0)
    return np.asarray(_steady(first, jnp.asarray(level.velocity), jnp.asarray(w)))


@jit_large
def _steady(first: SegmentEquations, v: Array, w: Array) -> Array:
    """States from `v` (m/s) under the load `w`, over W0, at the beginning of a segment."""
    motion = first.motion
    at = Excitation(w, pull=v / motion.V)
    states = jnp.append(motion.steady_under(at), 0.0)
    return states_after_jump(motion, at, first.at(jnp.zeros(())), states)


#: A slider slips if its velocity exceeds this multiple of the fastest drive.
_SLIPS = 30.0

#: Without inertia: a velocity, and a multiple of the fastest drive, that only a runaway reaches.
_RUNAWAY, _RUNAWAY_RATIO = 1.0, 1e3

#: Steps that an integration may take: half an hour to a few hours of work.
MOST_STEPS = 200_000_000


@typed
def checked_integration(
    slider: Slider,
    programme: Programme,
    *,
    inertia: bool = False,
    radiation_damping: float | str | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    slip_velocity: float | str | None = None,
    runaway_velocity: float | str | None = None,
    steady_tolerance: float = 1e-4,
    method: Literal["auto", "explicit", "implicit"] = "auto",
    most_steps: float = MOST_STEPS,
) -> Integration:
    """An integration before its first step; parameters as in `transient`.

    Raises
    ------
    InputError
        If a value breaks its rule.
    """
    fastest = programme.fastest_pull
    V = abs(programme.level.velocity) or fastest or 1e-6
    fastest = fastest or V

    def positive(name: str, value: Any, default: Any, kind: str = "dimensionless") -> Any:
        return default if value is None else number(value, name, kind, "positive")

    eta = positive("radiation_damping", radiation_damping, None, "damping")
    rtol = positive("rtol", rtol, None)
    rule, advice = "lie between 1e-13 and 0.01", "give one such as 1e-8"
    require(1e-13 <= rtol <= 1e-2, "rtol", rule, f"{rtol:g}", advice)
    law, advice = slider.law, "take a rate-and-state law"
    got = f"'{law.name}', whose force follows the load without dynamics"
    require(law.rate_dependent, "law", "depend on velocity for a transient", got, advice)
    scalar = jax.tree.map(_scalar, slider)
    motion = equation_of_motion(
        scalar, jnp.asarray(V), jnp.asarray(1.0), inertia=inertia,
        eta=None if eta is None else jnp.asarray(eta),
    )  # fmt: skip
    motion = reversing(motion)
    runs = max(_RUNAWAY, _RUNAWAY_RATIO * fastest)
    thresholds = EventThresholds(
        positive("slip_velocity", slip_velocity, _SLIPS * fastest, "velocity"),
        positive("runaway_velocity", runaway_velocity, runs, "velocity"),
        positive("steady_tolerance", steady_tolerance, None),
    )
    tolerances = Tolerances(rtol, positive("atol", atol, rtol / 100))
    most, nowhere = positive("most_steps", most_steps, None), Checkpoint(0, 0.0, np.empty(0))
    return Integration(motion, programme, nowhere, tolerances, thresholds, method, most)


def _scalar(value: Any) -> jnp.ndarray:
    got, advice = f"parameters of shape {np.shape(value)}", "call it once for each"
    require(np.size(value) == 1, "slider", "be a single one for a transient", got, advice)
    return jnp.asarray(value, float).reshape(())
