"""Shear strength times real contact area: the product whose eta*m term Rice-Ruina drops.

Bureau et al. (2000), Eqs. (3)-(5)::

    F_fr    = sigma_s(v) Sigma_r(Phi, W)
    sigma_s = sigma_s0 [1 + eta ln(v / V0)],       eta = A / mu0
    Sigma_r = Sigma_0(W) [1 + m ln(V0 Phi / D0)],  m   = B / mu0,   sigma_s0 Sigma_0 = mu0 W

so F_fr / W = mu0 [1 + eta ln(v/V0)] [1 + m ln(V0 Phi/D0)].
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.rice_ruina import RiceRuina


class StrengthArea(RiceRuina):
    """Product form of Rice-Ruina friction; parameters and state as `RiceRuina`."""

    name: ClassVar[str] = "strength-area"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=\mu_0W\left[1+\frac{A}{\mu_0}\ln\frac{\dot x}{V_0}\right]"
        r"\left[1+\frac{B}{\mu_0}\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot\Phi=1-\frac{\dot x\Phi}{D_0}",
    )

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Eqs. (3)-(5)."""
        strength = 1 + self.A / self.mu0 * jnp.log(v / self.V0)
        return self.mu0 * strength * self._area(state, w)

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Eqs. (3)-(5) solved for the velocity."""
        strength = friction / (self.mu0 * self._area(state, w))
        return jnp.log(self.V0) + self.mu0 / self.A * (strength - 1)

    def _area(self, state: State, w: ArrayLike) -> Array:
        """Real contact area over its value at the age D0/V0 under the same load."""
        return 1 + self.B / self.mu0 * self.log_age(state, w)
