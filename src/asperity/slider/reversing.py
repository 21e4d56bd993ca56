"""Inertia on rigid asperities through rest and reversal, for laws that are smooth there.

    M dv/dt = F + S - F_i - eta v,      dF/dt = K (V p - v),      v = v(F_i/W, state, W)

where the law gives v, which has a sign. ln v exists on one side of rest only; the friction F_i/W
has a value everywhere, and takes the place of ln v among the states:

    d(F_i/W)/dt = [dv/dt - dv/dstate dstate/dt - dv/dw dw/dt] / [dv/d(F_i/W)].

For the regularised law F_i/(A W) = asinh[v / (2 V*)], V* = V0 exp[-(mu0 + B phi) / A]: the state is
proportional to v near rest and linear in ln v in sliding. A slider at rest creeps at the velocity
at which friction balances the spring; its velocity relaxes to this one within M V* / (A W).
"""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws import Law
from asperity.loads import Excitation
from asperity.slider.inertial import Damped, StiffInertial
from asperity.slider.motion import Motion


class ReversingInertial(Damped):
    """Inertia without asperities, signed; states Y = (F/W0, F_i/W, *law states)."""

    name: ClassVar[str] = "inertial"
    mechanical: ClassVar[tuple[str, ...]] = ("force", "friction")
    logarithmic: ClassVar[tuple[bool, ...]] = (False, False)

    def friction(self, Y: Array, at: Excitation) -> Array:
        """F_i/W."""
        return Y[1]

    def slider_velocity(self, Y: Array, at: Excitation) -> Array:
        """dx/dt over V."""
        return self.slip_velocity(self.friction(Y, at), Y, at)

    def friction_jump(self, Y: Array, before: Excitation, after: Excitation) -> Array:
        """Change of F_i/W where the load steps: the velocity is continuous."""
        law, state = self.slider.law, self.law_state(Y)
        v = self.V * self.slider_velocity(Y, before)
        return law.friction(v, state, after.w) - law.friction(v, state, before.w)

    def rates(self, Y: Array, at: Excitation) -> Array:
        """dY/dtheta."""
        friction, state = Y[1], self.law_state(Y)
        v = self.slider_velocity(Y, at)
        state_rates = self._law_rates(v, v, Y, at)
        _, drift = jax.jvp(
            lambda *a: self.slider.law.velocity(friction, *a) / self.V,
            (state, at.w),
            (tuple(r * jnp.ones_like(v) for r in state_rates), at.w_slope * jnp.ones_like(at.w)),
        )
        slope = _velocity_slope(self.slider.law, friction, state, at.w) / self.V
        change = (self.mobility * self._net_force(friction, v, Y, at) - drift) / slope
        rates = [self.kappa * (at.pull - v), change, *state_rates]
        return jnp.stack(jnp.broadcast_arrays(*rates))

    def inertness(self, Y: Array, at: Excitation) -> Array:
        """As in `Motion`; friction relaxes fast where the velocity depends on it weakly."""
        one = jnp.ones_like(Y[0])
        slope = _velocity_slope(self.slider.law, Y[1], self.law_state(Y), at.w) / self.V
        return jnp.stack([one, slope, *(one for _ in Y[2:])])


def _velocity_slope(law: Law, friction: Array, state: tuple[Array, ...], w: ArrayLike) -> Array:
    """Derivative of the velocity of the law with respect to F_i/W."""
    one = jnp.ones_like(friction)
    return jax.jvp(lambda g: law.velocity(g, state, w), (friction,), (one,))[1]


def reversing(motion: Motion) -> Motion:
    """The motion in states that are regular at rest, if its law allows rest.

    A law allows rest if its velocity rises with the force at rest, too. That of `regularised` is
    below the range of doubles there if A is below about mu0/700: a motion that comes to rest then
    ends, with the reason.
    """
    if not (isinstance(motion, StiffInertial) and motion.signed):
        return motion
    law, V = motion.slider.law, motion.V
    rest = _velocity_slope(law, jnp.zeros(()), law.steady_state(V), jnp.ones(()))
    if not bool(jnp.all(rest > 0)):
        return motion
    return ReversingInertial(motion.slider, V, motion.omega, motion.eta)
