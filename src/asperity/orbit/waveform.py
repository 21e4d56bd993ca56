"""Force, velocities and age over one period of an orbit."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.arrays import Float
from asperity.errors import require
from asperity.laws import Law, LinkerDieterich
from asperity.loads import Harmonic
from asperity.orbit.response import PeriodicResponse
from asperity.parameters.arguments import typed

#: Newton steps for the state; friction is affine in the state for most laws.
_STEPS = 12


class Period(NamedTuple):
    """One period of the motion, each array of shape (samples,).

    Attributes
    ----------
    phase : array
        Time over the period, 0 at theta = 0: under a harmonic load where that is largest.
    load : array
        W/W0.
    force : array
        F/W0, the force of the pulling spring.
    velocity : array
        Velocity of the slider over the pulling velocity.
    plastic_velocity : array
        Velocity of slip over the pulling velocity; differs where asperities are elastic. 1 for a
        law without rate dependence, which does not determine it.
    age : array or None
        Age of the contacts over that of steady sliding, V Phi/D0; None where the law's state is no
        age, or the load is not harmonic; NaN while the interface sticks, where the force does not
        tell the age.
    """

    phase: Float
    load: Float
    force: Float
    velocity: Float
    plastic_velocity: Float
    age: Float | None


@typed
def over_a_period(response: PeriodicResponse) -> Period:
    """Force, velocities and age over one period.

    Parameters
    ----------
    response : PeriodicResponse
        Response of a single point, with a waveform.

    Raises
    ------
    InputError
        If the response has several points or no waveform.

    Notes
    -----
    The slider's velocity is that of the pulling point, V p with p = 1 unless the pull is modulated,
    less the rate of the spring's stretch, (dF/dt)/K, by Fourier differentiation. The interface
    carries the spring's force less what accelerates the slider and what it radiates; the state is
    the one at which the law carries that force at that slip velocity.
    """
    samples, points = response.waveform.shape[-1], np.size(response.outcome)
    rule, got = "be of one point, with a waveform", f"{points} points of {samples} samples"
    advice = "solve one point, and ask for a waveform of 256 samples"
    require(points == 1 and samples > 0, "response", rule, got, advice)
    motion, slider = response.motion, response.slider
    V, omega = float(np.ravel(motion.V)[0]), float(np.ravel(motion.omega)[0])
    K, W0, M = (float(np.ravel(getattr(slider, n))[0]) for n in ("K", "W0", "M"))
    force, log_slip = response.waveform.reshape(2, -1)
    slip = np.exp(log_slip)
    at = jax.tree.map(np.ravel, response.load.at(response.theta))
    slips_with_slider = slider.law.rate_dependent and not np.any(
        np.asarray(slider.law.elastic_length) > 0
    )
    stretching = omega * W0 / (K * V) * _derivative(force)
    velocity = slip if slips_with_slider else at.pull - stretching
    friction = force - float(np.ravel(motion.damping)[0]) * velocity
    if "inertial" in motion.name:
        friction = friction - M * V * omega / W0 * _derivative(velocity)
    load = at.w * np.ones(len(force))
    age = None
    has_age = slider.law.state_names == ("log_age",) or isinstance(slider.law, LinkerDieterich)
    if isinstance(response.load, Harmonic) and has_age:
        age = np.asarray(_relative_age(slider.law, V, V * slip, friction / load, load)).reshape(-1)
    return Period(response.theta / (2 * np.pi), load, force, velocity, slip, age)


@jax.jit
def _relative_age(law: Law, V: Array, v: Array, friction: Array, w: Array) -> Array:
    """Age over that of steady sliding at `V` where the law carries F_i/W = `friction` at `v`."""

    def excess(state: Array) -> Array:
        return law.friction(v, (state,), w) - friction

    def step(_: int, state: Array) -> Array:
        value, slope = jax.jvp(excess, (state,), (jnp.ones_like(state),))
        return state - value / slope

    first = jnp.broadcast_to(law.steady_state(v)[0], friction.shape)
    state: Array = jax.lax.fori_loop(0, _STEPS, step, first)
    log_age = law.log_age((state,), w) if isinstance(law, LinkerDieterich) else state
    result: Array = jnp.exp(log_age - law.steady_state(V)[0])
    return result


def _derivative(values: Float) -> Float:
    """Derivative by the phase (rad) of a periodic function on a uniform grid."""
    orders = np.fft.rfftfreq(len(values), 1 / len(values))
    slope: Float = np.fft.irfft(1j * orders * np.fft.rfft(values), len(values))
    return slope
