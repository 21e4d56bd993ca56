"""Rate-and-state friction with two state variables, each with its memory length.

Ruina (1983); Gu, Rice, Ruina and Tse (1984)::

    F_i / W   = mu0 + A ln(v / V0) + B phi + B2 phi2
    dphi/dt   = -(v / D0) [phi  + ln(v / V0)]
    dphi2/dt  = -(v / D2) [phi2 + ln(v / V0)]

the slip law for both, as published; phi = theta_1 / B and phi2 = theta_2 / B2 in their letters.
"""

from __future__ import annotations

from typing import ClassVar

from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import State
from asperity.laws.parameter import parameter
from asperity.laws.ruina_slip import RuinaSlip


class TwoState(RuinaSlip):
    """Slip law with two states (phi, phi2).

    Parameters
    ----------
    B2 : float
        Coefficient of the second state (dimensionless), of either sign; B2 -> 0 is `RuinaSlip`.
    D2 : float
        Memory length of the second state (m).
    mu0, A, B, D0, V0 : float
        As in `RiceRuina`; B and D0 belong to the first state.
    """

    name: ClassVar[str] = "two-state"
    source: ClassVar[str] = "ruina1983, gu1984"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x}{V_0}+B\phi+B_2\phi_2\right]",
        r"\dot\phi=-\frac{\dot x}{D_0}\left(\phi+\ln\frac{\dot x}{V_0}\right)",
        r"\dot\phi_2=-\frac{\dot x}{D_2}\left(\phi_2+\ln\frac{\dot x}{V_0}\right)",
    )
    state_names: ClassVar[tuple[str, ...]] = ("log_age", "log_age2")
    exchangeable: ClassVar[tuple[tuple[str, ...], ...]] = (("D0", "B"), ("D2", "B2"))

    B2: ArrayLike = parameter(
        "law.B2",
        "dimensionless",
        "finite",
        symbol="B_2",
        meaning="coefficient of the second state",
        geophysics="$b_2$",
    )
    D2: ArrayLike = parameter(
        "law.D2",
        "length",
        symbol="D_2",
        meaning="memory length of the second state",
        geophysics="$L_2$, $D_{c2}$",
    )

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """Both states add to friction."""
        return super().friction(v, state, w) + self.B2 * state[1]

    def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
        """`friction` solved for the velocity."""
        return super().log_velocity(friction - self.B2 * state[1], state, w)

    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """The slip law over either length."""
        first = self.approach(v_plastic, state[0], self.D0)
        return first, self.approach(v_plastic, state[1], self.D2)

    def steady_state(self, v: ArrayLike) -> State:
        """Both states at -ln(v/V0)."""
        return super().steady_state(v) * 2
