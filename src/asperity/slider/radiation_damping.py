"""Radiation damping without asperities and without mass: friction and damping in parallel.

    F + S = W mu(v, state) + eta v

fixes v at every instant (Rice, J. Geophys. Res. 98, 9885, 1993). No law has a closed form for
it: Newton's method on ln v starts at the smaller of the two velocities at which one of the
terms alone would carry the force, from where it converges without ever overshooting.
"""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws import Law, State
from asperity.loads import Excitation
from asperity.slider.inertial import Damped

#: Number of Newton steps. From velocities at which damping carries the whole force to those at
#: which it carries A W the method takes ln(mu / A) steps, of about one unit of ln v each; after
#: that it converges quadratically.
_STEPS = 14


class Radiating(Damped):
    """Radiation damping, no asperities; states Y = (F/W0, *law states)."""

    name: ClassVar[str] = "radiation-damped"
    mechanical: ClassVar[tuple[str, ...]] = ("force",)
    logarithmic: ClassVar[tuple[bool, ...]] = (False,)

    def log_slip(self, Y: Array, at: Excitation) -> Array:
        """ln(v / V)."""
        law, state = self.slider.law, self.law_state(Y)
        return _log_slip(law, self.V, self.damping, Y[0] + at.shear, state, at.w)

    def slider_velocity(self, Y: Array, at: Excitation) -> Array:
        """dx/dt over V."""
        if not self.signed:
            return jnp.exp(self.log_slip(Y, at))
        # Friction and damping are both odd in v.
        force = Y[0] + at.shear
        forward = Y.at[0].set(jnp.abs(force) - at.shear)
        return jnp.sign(force) * jnp.exp(self.log_slip(forward, at))

    def rates(self, Y: Array, at: Excitation) -> Array:
        """dY/dtheta."""
        v = self.slider_velocity(Y, at)
        rates = [self.kappa * (at.pull - v), *self._law_rates(v, v, Y, at)]
        return jnp.stack(jnp.broadcast_arrays(*rates))


def _excess(
    q: Array, law: Law, V: ArrayLike, damping: ArrayLike, force: ArrayLike, state: State, w: Array
) -> Array:
    """Friction plus damping at v = V e^q, minus `force`, over W0."""
    slip = jnp.exp(q)
    return w * law.friction(V * slip, state, w) + damping * slip - force


@jax.custom_jvp
def _log_slip(
    law: Law, V: ArrayLike, damping: ArrayLike, force: ArrayLike, state: State, w: Array
) -> Array:
    parameters = (law, V, damping, force, state, w)
    undamped = law.log_velocity(force / w, state, w) - jnp.log(V)
    frictionless = jnp.log(jnp.maximum(force, 1e-300) / jnp.maximum(damping, 1e-300))
    start = jnp.minimum(undamped, frictionless)

    def step(_: int, q: Array) -> Array:
        value, slope = jax.jvp(lambda x: _excess(x, *parameters), (q,), (jnp.ones_like(q),))
        return q - value / slope

    return jax.lax.fori_loop(0, _STEPS, step, start)


@_log_slip.defjvp
def _log_slip_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    """Implicit function theorem."""
    q = _log_slip(*primals)
    _, change = jax.jvp(lambda *p: _excess(q, *p), primals, tangents)
    _, slope = jax.jvp(lambda x: _excess(x, *primals), (q,), (jnp.ones_like(q),))
    return q, -change / slope
