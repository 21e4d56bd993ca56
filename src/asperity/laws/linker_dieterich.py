"""Linker-Dieterich extension of the ageing law ("LD").

Bureau et al. (2000), Eq. (6), after Linker and Dieterich (1992)::

    dPhi/dt = 1 - v Phi / D0 - (alpha / B) (dW/dt / W) Phi

With ``s = ln(V0 Phi / D0) + (alpha / B) ln(W / W0)`` the load rate cancels and
``ds/dt = 1/Phi - v / D0``: the age jumps with the load, s does not, and a step of W is exact.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.parameter import parameter
from asperity.laws.rice_ruina import RiceRuina


class LinkerDieterich(RiceRuina):
    """Rice-Ruina friction with Linker-Dieterich ageing; state: ``s`` above.

    Parameters
    ----------
    alpha : float
        Linker-Dieterich coefficient (dimensionless): a load step changes F/W by
        -alpha ln(W_after / W_before) at constant velocity.
    mu0, A, B, D0, V0 : float
        As in `RiceRuina`, but B > 0.
    """

    name: ClassVar[str] = "linker-dieterich"
    source: ClassVar[str] = "linker1992, bureau2000"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x}{V_0}+B\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot\Phi=1-\frac{\dot x\Phi}{D_0}-\frac{\alpha}{B}\frac{\dot W}{W}\Phi",
    )
    state_names: ClassVar[tuple[str, ...]] = ("log_age_plus_load",)

    B: ArrayLike = parameter("law.B", "dimensionless")  # alpha / B: zero has no limit
    alpha: ArrayLike = parameter(
        "law.alpha",
        "dimensionless",
        "finite",
        symbol=r"\alpha",
        meaning="Linker-Dieterich coefficient",
        geophysics=r"$\alpha$",
    )

    def log_age(self, state: State, w: ArrayLike) -> Array:
        """ln(V0 Phi / D0) = s - (alpha / B) ln w."""
        return state[0] - self.alpha / self.B * jnp.log(w)
