"""Closed forms for velocity steps, holds and healing.

Lengths in m, stiffness over the normal load, k = K/W0, in 1/m. Phi is the age, D0 the memory
length, V the velocity, u the slip at constant V. With x = V Phi/D0 three laws have closed forms:

==================  ==========================  ================================================
law                 state                       after a step of the velocity by the factor r
==================  ==========================  ================================================
rice-ruina          dPhi/dt = 1 - x             x = 1 + (r - 1) exp(-u/D0)
ruina-slip          dPhi/dt = -x ln x           ln x = ln r exp(-u/D0)
perrin-rice-zheng   dPhi/dt = 1 - (x/2)^2       x/2 = (r + T)/(1 + r T),  T = tanh(u/(2 D0))
==================  ==========================  ================================================

All three relax as exp(-u/D0) near steady sliding. They differ in what a hold does.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.errors import require
from asperity.laws import PerrinRiceZheng, RiceRuina, RuinaSlip
from asperity.parameters import obeying

_DECADE = math.log(10)


def state_after_step(law: RiceRuina, ratio: ArrayLike, slip: ArrayLike | str) -> Array:
    """ln(Phi/Phi_ss) after a slip at constant velocity that follows a step by the factor `ratio`.

    Parameters
    ----------
    law : RiceRuina, RuinaSlip or PerrinRiceZheng
        RiceRuina (ageing), RuinaSlip or PerrinRiceZheng.
    ratio : array
        New velocity over the old one, positive.
    slip : array or str
        Slip since the step (m).
    """
    _require_closed_form(law)
    r = jnp.asarray(obeying(ratio, "state_after_step.ratio", "dimensionless", "positive"))
    u = obeying(slip, "state_after_step.slip", "length", "not negative") / law.D0
    if type(law) is RiceRuina:
        return jnp.log1p((r - 1) * jnp.exp(-u))
    if type(law) is RuinaSlip:
        return jnp.log(r) * jnp.exp(-u)
    T = jnp.tanh(u / 2)
    return jnp.log((r + T) / (1 + r * T))


class LongHold(NamedTuple):
    """Healing of the ageing law after a long hold: leading and next order.

    Attributes
    ----------
    leading : array
        Leading term of contacts that only age in the hold.
    renewal : array
        Next order: reduction by the slip in the hold, negative. It falls with the hold time as
        t^(-(B - A)/A) if B > A, slowly where A and B are close.
    """

    leading: Array
    renewal: Array

    @property
    def healing(self) -> Array:
        """Sum of both orders."""
        return self.leading + self.renewal


def ageing_long_hold(
    law: RiceRuina, *, velocity: ArrayLike | str, hold_time: ArrayLike | str, stiffness: Any
) -> LongHold:
    """Healing of the ageing law after a long hold, in closed form.

    Parameters
    ----------
    law : RiceRuina
    velocity : array or str
        Before and after the hold (m/s).
    hold_time : array or str
        Seconds; V t/D0 is large.
    stiffness : array or str
        K/W0 (1/m).

    Returns
    -------
    LongHold

    Notes
    -----
    With y = V t/D0, kappa = k D0 and q = (B - A)/A, contacts that only age give, from
    A ln(v/V) + B ln y = -k x, the slip x of the hold,

        exp(k x/A) = 1 + kappa (1 - y^-q)/(B - A),    s = v Phi/D0 = y^-q / exp(k x/A),

    and reloading, in which they are only renewed, takes the slip A D0 ln(kappa/B)/(kappa - B) to
    the maximum:

        leading = B ln y - B A ln(kappa/B)/(kappa - B),   renewal = B ln(1 - mean of s over t).
    """
    rule, got = "be the ageing law 'rice-ruina'", getattr(law, "name", type(law))
    advice = "asperity.experiment.hold_response takes any law"
    require(type(law) is RiceRuina, "law", rule, got, advice)
    V = obeying(velocity, "ageing_long_hold.velocity", "velocity", "positive")
    t = obeying(hold_time, "ageing_long_hold.hold_time", "time", "positive")
    k = obeying(stiffness, "ageing_long_hold.stiffness", "per_length", "positive")
    return _long_hold(law.A, law.B, k * law.D0, V * t / law.D0)


# As one program: compiling each operation takes ten times as long.
@jax.jit
def _long_hold(*numbers: ArrayLike) -> LongHold:
    A, B, kappa, y = jnp.broadcast_arrays(*numbers)
    way = jnp.where(
        jnp.abs(kappa / B - 1) < 1e-6,
        A / B * (1 - 0.5 * (kappa / B - 1)),
        A * jnp.log(kappa / B) / jnp.where(kappa == B, 1.0, kappa - B),
    )
    # The mean of s over y from the steady state on, by Gauss-Legendre in ln y.
    nodes, weights = np.polynomial.legendre.leggauss(64)
    log_z = 0.5 * jnp.log(y)[..., None] * (nodes + 1)
    a, q = A[..., None], ((B - A) / A)[..., None]
    grown = jnp.where(jnp.abs(q) < 1e-9, log_z / a, -jnp.expm1(-q * log_z) / (a * q))
    s = jnp.exp(-q * log_z) / (1 + kappa[..., None] * grown)
    mean = 0.5 * jnp.log(y) * ((s * jnp.exp(log_z)) @ weights) / y
    return LongHold(B * (jnp.log(y) - way), B * jnp.log1p(-mean))


def healing_rate_limit(law: RiceRuina) -> Array:
    """Healing per decade of hold time to which a law tends as the hold gets long.

    Parameters
    ----------
    law : RiceRuina, RuinaSlip or PerrinRiceZheng

    Notes
    -----
    ==================  ==========================  ==============================================
    law                 limit over ln 10            how slowly
    ==================  ==========================  ==============================================
    rice-ruina          B                           t^(-(B - A)/A) if B > A
    ruina-slip          the smaller of A and B      1/ln t, with a factor that grows with k D0
    perrin-rice-zheng   B - A/2, if B > A/2         t^(-1/2)
    ==================  ==========================  ==============================================

    Ageing: contacts age by t, and reloading takes a slip that does not depend on the hold. Slip law
    with B > A: ln(v/V) = X - ln(Phi/Phi_ss), where -X grows as the exponential of the slip, so that
    ln(Phi/Phi_ss) = (A/B) ln t, and reloading takes off its logarithm only. PRZ: contacts age by t;
    in reloading they are renewed from v/V = y^(-1/2) on, y = V t/D0, where v Phi^(B/A) stays
    constant, which takes the share A/(2 B) of ln t.
    """
    _require_closed_form(law)
    A, B = jnp.asarray(law.A), jnp.asarray(law.B)
    if type(law) is RiceRuina:
        return _DECADE * B
    if type(law) is RuinaSlip:
        return _DECADE * jnp.minimum(A, B)
    holds, rule = np.all(B > A / 2), "be above law.A / 2 for a healing rate in closed form"
    require(holds, "law.B", rule, "less", "integrate with asperity.experiment.hold_response")
    return _DECADE * (B - A / 2)


def _require_closed_form(law: Any) -> None:
    rule = "be rice-ruina, ruina-slip or perrin-rice-zheng"
    got = getattr(law, "name", type(law).__name__)
    advice = "asperity.experiment has the same for any law by integration"
    require(type(law) in (RiceRuina, RuinaSlip, PerrinRiceZheng), "law", rule, got, advice)
