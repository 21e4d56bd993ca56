"""Rice-Ruina friction with the slip law: the state changes only while the interface slips.

Ruina (1983); friction as in Bureau et al. (2000), Eq. (1)::

    F_i / W = mu0 + A ln(v / V0) + B ln(V0 Phi / D0)
    dPhi/dt = -(v Phi / D0) ln(v Phi / D0)

Near steady sliding it is the ageing law; contacts at rest do not age.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.rice_ruina import RiceRuina


class RuinaSlip(RiceRuina):
    """Rice-Ruina friction with the slip law; parameters and state as `RiceRuina`."""

    name: ClassVar[str] = "ruina-slip"
    source: ClassVar[str] = "ruina1983"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x}{V_0}+B\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot\Phi=-\frac{\dot x\Phi}{D_0}\ln\frac{\dot x\Phi}{D_0}",
    )

    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """The slip law, divided by Phi, with the velocity in the logarithm of friction."""
        return (self.approach(v_plastic, state[0], self.D0),)

    def approach(self, v: ArrayLike, log_age: Array, length: ArrayLike) -> Array:
        """-(v / length) (phi - phi_ss) (1/s): relaxation to steady sliding over a slip `length`."""
        # At rest the rate is zero, and the logarithm, which has no value, is replaced.
        log_v = jnp.log(jnp.where(jnp.asarray(v) > 0, v, self.V0) / self.V0)
        return -(v / length) * (log_age + log_v)
