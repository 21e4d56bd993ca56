"""Rate-and-state friction with weakening by shear stress.

Nagata, Nakatani and Yoshida (2012)::

    F_i / W = mu0 + A ln(v / V0) + B ln(V0 Phi / D0)
    dPhi/dt = 1 - v Phi / D0 - (c / B) Phi (dF_i/dt) / W0

The authors kept the load constant. Here the rate of the shear force is taken over the mean load
W0: under a changing load that is their term dF_i / W to first order in the modulation, and a load
step that leaves the shear force unchanged leaves the age unchanged. With::

    s = ln(V0 Phi / D0) + (c / B) F_i / W0

the force rate cancels, ds/dt = 1/Phi - v / D0, and friction becomes explicit in s::

    F_i / W = [mu0 + A ln(v / V0) + B s] / (1 + c W / W0) .

A velocity step under constant load shows a direct effect of A / (1 + c) only.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.parameter import parameter
from asperity.laws.rice_ruina import RiceRuina


class Nagata(RiceRuina):
    """Law of Nagata et al. (2012); state: ``s`` above.

    Parameters
    ----------
    c : float
        Weakening by shear stress (dimensionless), not negative; c -> 0 is Rice-Ruina.
    mu0, A, B, D0, V0 : float
        As in `RiceRuina`, but B > 0.
    """

    name: ClassVar[str] = "nagata"
    source: ClassVar[str] = "nagata2012"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x}{V_0}+B\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot\Phi=1-\frac{\dot x\Phi}{D_0}-\frac{c}{B}\frac{\dot F_i}{W_0}\Phi",
    )
    state_names: ClassVar[tuple[str, ...]] = ("log_age_plus_force",)

    B: ArrayLike = parameter("law.B", "dimensionless")  # c / B: zero has no limit
    c: ArrayLike = parameter(
        "law.c",
        "dimensionless",
        "not negative",
        meaning="weakening by shear stress",
        geophysics="$c$",
    )

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Rice-Ruina friction with the age expressed by s and the force itself."""
        return super().friction(v, state, w) / (1 + self.c * w)

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """`friction` solved for the velocity."""
        return super().log_velocity(friction * (1 + self.c * w), state, w)

    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """1/Phi - v/D0."""
        force = w * self.friction(v_plastic, state, w)
        log_age = state[0] - self.c / self.B * force
        return ((self.V0 * jnp.exp(-log_age) - v_plastic) / self.D0,)

    def steady_state(self, v: ArrayLike) -> State:
        """Phi = D0/v."""
        log_v = jnp.log(v / self.V0)
        force = self.mu0 + (self.A - self.B) * log_v
        return (self.c / self.B * force - log_v,)
