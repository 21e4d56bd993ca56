"""Rate-and-state friction with a cut-off velocity in the rate term and one in the state term.

A logarithm of 1 plus a ratio bounds both terms: the rate term below V1, as in Bar-Sinai et al.
(2014), and the state term for ages below D0/V2, as in Okubo (1989) and Bar-Sinai et al. (2014)::

    F_i / W = f0 + A ln(1 + v / V1) + B ln(1 + V2 Phi / D0)
    dPhi/dt = 1 - v Phi / D0

With f0 such that mu0 is, as in the other laws, the friction of steady sliding at V0::

    F_i / W = mu0 + A ln[(v + V1) / (V0 + V1)]
                  + B ln[(V0 Phi / D0 + V0 / V2) / (1 + V0 / V2)]

At rest friction is finite: below it the interface sticks. Above V2 it strengthens with velocity.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.parameter import parameter
from asperity.laws.rice_ruina import RiceRuina


class CutOff(RiceRuina):
    """Rate-and-state law with cut-off velocities; state as `RiceRuina`.

    Reversed motion mirrors the force, ``F_i(-v) = -F_i(v)``. At rest `friction` is the largest
    force at which the interface sticks.

    Parameters
    ----------
    V1 : float
        Cut-off velocity of the rate term (m/s), not negative: no rate dependence far below it.
    V2 : float
        Cut-off velocity of the state term (m/s): no dependence on the age far above it.
        V1 -> 0 with V2 -> infinity is Rice-Ruina.
    mu0, A, B, D0, V0 : float
        As in `RiceRuina`.
    """

    name: ClassVar[str] = "cut-off"
    source: ClassVar[str] = "okubo1989, barsinai2014"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x+V_1}{V_0+V_1}"
        r"+B\ln\frac{V_0\Phi/D_0+V_0/V_2}{1+V_0/V_2}\right]",
        r"\dot\Phi=1-\frac{\dot x\Phi}{D_0}",
    )

    V1: ArrayLike = parameter(
        "law.V1",
        "velocity",
        "not negative",
        symbol="V_1",
        meaning="cut-off velocity of the rate term",
    )
    V2: ArrayLike = parameter(
        "law.V2",
        "velocity",
        symbol="V_2",
        meaning="cut-off velocity of the state term",
        geophysics="$V_2$",
    )

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Odd in `v`, with a jump at rest."""
        rate = self.A * jnp.log((jnp.abs(v) + self.V1) / (self.V0 + self.V1))
        return jnp.where(jnp.asarray(v) < 0, -1.0, 1.0) * (self._strength(state, w) + rate)

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """ln(v); -inf where the interface sticks."""
        log_sum = self._log_sum(friction, state, w)  # of v + V1
        slips = log_sum > jnp.log(self.V1)
        share = self.V1 * jnp.exp(-jnp.where(slips, log_sum, 0.0))
        share = jnp.where(slips, share, 0.0)
        return jnp.where(slips, log_sum + jnp.log1p(-share), -jnp.inf)

    def velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Signed; zero where the interface sticks."""
        fastest = jnp.exp(self._log_sum(jnp.abs(friction), state, w)) - self.V1
        return jnp.sign(friction) * jnp.maximum(fastest, 0.0)

    def ageing(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Slip renews the contacts in either direction."""
        return super().ageing(jnp.abs(v), state, w)

    def _log_sum(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """ln(v + V1) of forward sliding."""
        return jnp.log(self.V0 + self.V1) + (friction - self._strength(state, w)) / self.A

    def _strength(self, state: State, w: ArrayLike) -> Array:
        """Friction at v = V0."""
        youngest = self.V0 / self.V2
        age = jnp.logaddexp(self.log_age(state, w), jnp.log(youngest)) - jnp.log1p(youngest)
        return self.mu0 + self.B * age
