"""Rice-Ruina rate-and-state friction with the ageing law ("RR").

Bureau et al. (2000), Eqs. (1) and (2)::

    F_fr / W = mu0 + A ln(v / V0) + B ln(V0 Phi / D0)
    dPhi/dt  = 1 - v Phi / D0
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import Law, State
from asperity.laws.parameter import parameter


class RiceRuina(Law):
    """Rice-Ruina law; state: ``phi = ln(V0 Phi / D0)``.

    Parameters
    ----------
    mu0 : float
        Friction coefficient in steady sliding at V0 (dimensionless).
    A, B : float
        Rate and state coefficients (dimensionless; a and b in geophysics).
    D0 : float
        Memory length (m; D_c in geophysics).
    V0 : float
        Reference velocity (m/s).
    """

    name: ClassVar[str] = "rice-ruina"
    source: ClassVar[str] = "dieterich1979, ruina1983"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x}{V_0}+B\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot\Phi=1-\frac{\dot x\Phi}{D_0}",
    )
    state_names: ClassVar[tuple[str, ...]] = ("log_age",)

    mu0: ArrayLike = parameter("law.mu0", "dimensionless")
    A: ArrayLike = parameter("law.A", "dimensionless")
    B: ArrayLike = parameter("law.B", "dimensionless", "not negative")
    D0: ArrayLike = parameter("law.D0", "length")
    V0: ArrayLike = parameter("law.V0", "velocity")

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Eq. (1)."""
        return self.mu0 + self.A * jnp.log(v / self.V0) + self.B * self.log_age(state, w)

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Eq. (1) solved for the velocity."""
        excess = friction - self.mu0 - self.B * self.log_age(state, w)
        return jnp.log(self.V0) + excess / self.A

    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """Eq. (2), divided by Phi."""
        return (self.ageing(v, state, w),)

    def steady_state(self, v: ArrayLike) -> State:
        """Phi = D0/v."""
        return (-jnp.log(v / self.V0),)

    def log_age(self, state: State, w: ArrayLike) -> Array:
        """ln(V0 Phi / D0): here the state variable itself."""
        return state[0]

    def age(self, state: State, w: ArrayLike) -> Array:
        """Phi (s)."""
        return self.D0 / self.V0 * jnp.exp(self.log_age(state, w))

    def ageing(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Rate d ln(Phi)/dt = 1/Phi - v/D0 (1/s); `v` is what renews the contacts."""
        return (self.V0 * jnp.exp(-self.log_age(state, w)) - v) / self.D0
