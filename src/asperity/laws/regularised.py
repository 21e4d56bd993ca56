"""Rice-Ruina friction with a regularised rate term, defined at rest and in reversed motion.

Rice, Lapusta and Ranjith (2001); Lapusta, Rice, Ben-Zion and Zheng (2000)::

    F_i / W  = A asinh[ v / (2 V0) exp( (mu0 + B ln(V0 Phi / D0)) / A ) ]
    dPhi/dt  = 1 - |v| Phi / D0

Thermally activated jumps against the force, which the logarithm of Rice-Ruina friction neglects,
are kept: the force is odd in v and vanishes with it. In forward sliding the two laws differ by
A exp(-2 F_i / (A W)).
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.rice_ruina import RiceRuina

#: Largest exponent for which e^x is computed.
_LARGEST = 700.0


class Regularised(RiceRuina):
    """Regularised rate-and-state law; parameters and state as `RiceRuina`."""

    name: ClassVar[str] = "regularised"
    source: ClassVar[str] = "rice2001, lapusta2000"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=WA\,\mathrm{arsinh}"
        r"\left[\frac{\dot x}{2V_0}\exp\frac{\mu_0+B\ln(V_0\Phi/D_0)}{A}\right]",
        r"\dot\Phi=1-\frac{|\dot x|\Phi}{D_0}",
    )

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Odd in `v`, zero at rest."""
        return self.A * _asinh_of_product(v / (2 * self.V0), self._log_strength(state, w))

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Logarithm of `velocity` for friction > 0; -inf at 0, not a number below."""
        exponent = friction / self.A
        # ln(2 sinh x) without overflow
        return (
            jnp.log(self.V0)
            + (exponent - self._log_strength(state, w))
            + jnp.log(-jnp.expm1(-2 * exponent))
        )

    def velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """2 V0 sinh(F_i / (A W)) exp(-(mu0 + B phi) / A), signed."""
        exponent, strength = friction / self.A, self._log_strength(state, w)
        small = jnp.abs(exponent) < 1  # where the difference of exponentials would cancel
        gentle = 2 * jnp.sinh(jnp.where(small, exponent, 0.0)) * jnp.exp(-strength)
        steep = jnp.exp(exponent - strength) - jnp.exp(-exponent - strength)
        return self.V0 * jnp.where(small, gentle, steep)

    def ageing(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Slip renews the contacts in either direction."""
        return super().ageing(jnp.abs(v), state, w)

    def _log_strength(self, state: State, w: ArrayLike) -> Array:
        """Logarithm of the factor at v / (2 V0)."""
        return (self.mu0 + self.B * self.log_age(state, w)) / self.A


def _asinh_of_product(x: ArrayLike, log_factor: Array) -> Array:
    """asinh(x e^log_factor) for a factor beyond the range of doubles, differentiable at x = 0."""
    size = jnp.abs(x)
    log = jnp.log(jnp.where(size > 0, size, 1.0)) + log_factor
    large = (size > 0) & (log > 0)
    log = jnp.where(large, log, 0.0)
    # asinh(e^y) = y + ln(1 + sqrt(1 + e^-2y))
    steep = jnp.sign(x) * (log + jnp.log1p(jnp.sqrt(1 + jnp.exp(-2 * log))))
    factor = jnp.exp(jnp.where(large, 0.0, jnp.minimum(log_factor, _LARGEST)))
    return jnp.where(large, steep, jnp.arcsinh(jnp.where(large, 0.0, x) * factor))
