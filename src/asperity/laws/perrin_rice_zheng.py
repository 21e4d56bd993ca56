"""Rate-and-state friction with the ageing law of Perrin, Rice and Zheng (1995).

The law has true stationary contact, like the ageing law, and is quadratic in the velocity::

    F_i / W = mu0 + A ln(v / V0) + B ln(V0 Phi / (2 D0))
    dPhi/dt = 1 - [v Phi / (2 D0)]^2

The factor 2 makes it the ageing law near steady sliding, where Phi = 2 D0 / v.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.rice_ruina import RiceRuina


class PerrinRiceZheng(RiceRuina):
    """Perrin-Rice-Zheng law; parameters as `RiceRuina`, state: ``phi = ln(V0 Phi / (2 D0))``."""

    name: ClassVar[str] = "perrin-rice-zheng"
    source: ClassVar[str] = "perrin1995"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x}{V_0}+B\ln\frac{V_0\Phi}{2D_0}\right]",
        r"\dot\Phi=1-\left(\frac{\dot x\Phi}{2D_0}\right)^2",
    )

    def age(self, state: State, w: ArrayLike) -> Array:
        """Phi (s), over 2 D0/V0 in the state."""
        return 2 * super().age(state, w)

    def ageing(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Rate d ln(Phi)/dt = 1/Phi - (v / (2 D0))^2 Phi (1/s)."""
        growth = self.V0 * jnp.exp(-self.log_age(state, w))  # 2 D0 / Phi
        return (growth - v**2 / growth) / (2 * self.D0)
