"""Rice-Ruina friction that remembers the normal load: it follows a change of W gradually.

After Prakash (1998), in the form of Cochard and Rice (2000): the interface force is that of a load
W_e, which relaxes to the applied one over a slip of length L, or a time L/V_star at rest::

    F_i      = W_e [mu0 + A ln(v / V0) + B ln(V0 Phi / D0)]
    dW_e/dt  = -(|v| + V_star) / L  (W_e - W)
    dPhi/dt  = 1 - v Phi / D0

State: ``m = ln(W_e / W0)``, with dm/dt = (|v| + V_star)/L (W/W_e - 1). A step of the load leaves
the force unchanged at first. Under constant load the law is Rice-Ruina.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.parameter import parameter
from asperity.laws.rice_ruina import RiceRuina


class PrakashClifton(RiceRuina):
    """Rice-Ruina law with memory of the normal load; states: (phi, m).

    Parameters
    ----------
    L : float
        Slip over which the force follows the load (m).
    V_star : float
        Velocity that is added to the slip velocity in the relaxation (m/s), not negative: at rest
        the relaxation takes the time L/V_star. With 0 there is no relaxation without slip.
    mu0, A, B, D0, V0 : float
        As in `RiceRuina`.
    """

    name: ClassVar[str] = "prakash-clifton"
    source: ClassVar[str] = "prakash1998, cochard2000"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W_e\left[\mu_0+A\ln\frac{\dot x}{V_0}+B\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot W_e=-\frac{|\dot x|+V_*}{L}\,(W_e-W)",
        r"\dot\Phi=1-\frac{\dot x\Phi}{D_0}",
    )
    state_names: ClassVar[tuple[str, ...]] = ("log_age", "log_load")

    L: ArrayLike = parameter(
        "law.L",
        "length",
        meaning="slip over which the force follows the load",
        geophysics="$L$",
    )
    V_star: ArrayLike = parameter(
        "law.V_star",
        "velocity",
        "not negative",
        symbol="V_*",
        meaning="velocity that stands for time while the force follows the load",
        geophysics="$V^*$",
    )

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Rice-Ruina friction times W_e/W."""
        return super().friction(v, state, w) * jnp.exp(state[1]) / w

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """`friction` solved for the velocity."""
        return super().log_velocity(friction * w * jnp.exp(-state[1]), state, w)

    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """Ageing, and relaxation of the load."""
        relaxation = (jnp.abs(v) + self.V_star) / self.L
        return self.ageing(v, state, w), relaxation * (w * jnp.exp(-state[1]) - 1)

    def steady_state(self, v: ArrayLike) -> State:
        """Phi = D0/v, W_e = W0."""
        (log_age,) = super().steady_state(v)
        return log_age, jnp.zeros_like(log_age)
