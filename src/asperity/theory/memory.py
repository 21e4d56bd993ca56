"""Closed forms for velocity steps, holds, healing and critical stiffness.

Lengths in m, stiffness over the normal load, k = K/W0, in 1/m. Phi is the age, D0 the memory
length, V the velocity, u the slip at constant V. With x = V Phi/D0 three laws have closed forms:

==================  ==========================  ================================================
law                 state                       after a step of the velocity by the factor r
==================  ==========================  ================================================
rice-ruina          dPhi/dt = 1 - x             x = 1 + (r - 1) exp(-u/D0)
ruina-slip          dPhi/dt = -x ln x           ln x = ln r exp(-u/D0)
perrin-rice-zheng   dPhi/dt = 1 - (x/2)^2       x/2 = (r + T)/(1 + r T),  T = tanh(u/(2 D0))
==================  ==========================  ================================================

All three relax as exp(-u/D0) near steady sliding, and lose its stability at k = (B - A)/D0. They
differ in what a hold does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity._jax import jit_large
from asperity.algebra.small_systems import spectral_abscissa
from asperity.arrays import Complex, Float
from asperity.errors import require
from asperity.laws import Law, PerrinRiceZheng, RiceRuina, RuinaSlip
from asperity.parameters import law_parameters, obeying
from asperity.parameters.arguments import number, typed
from asperity.slider import Motion, QuasiStatic, Slider
from asperity.slider.problem import require_even_track

#: Stiffnesses of the stability scan: decades below and above those at which the spring is as fast
#: as the slowest and the fastest state, and number of points.
_DECADES, _POINTS = 8, 400
_REFINEMENTS = 8
_DECADE = math.log(10)


@typed
def decay_rates(law: Law, velocity: float | str) -> Complex:
    """Rates per slip (1/m) at which states relax to steady sliding at imposed velocity.

    Parameters
    ----------
    law : Law
        With one number for each parameter.
    velocity : float or str
        m/s.

    Returns
    -------
    array, shape (states,)
        Eigenvalues of -d(state rate)/d(state) over the velocity, by rising real part: 1/D0 of the
        three laws above.

    Raises
    ------
    InputError
        If a parameter of the law is an array, or mu0 varies along a track.
    """
    for name, parameter in law_parameters(type(law)).items():
        value = getattr(law, parameter.path.rsplit(".", 1)[-1])
        number(value, f"law.{name}", parameter.kind, parameter.rule)
    require_even_track(law, "a decay of its states")
    V = jnp.asarray(number(velocity, "decay_rates.velocity", "velocity", "positive"))
    one = jnp.ones(())

    def rates(states: Array) -> Array:
        return jnp.stack(jnp.broadcast_arrays(*law.state_rate(V, V, tuple(states), one)))

    steady = jnp.stack(jnp.broadcast_arrays(*law.steady_state(V)))
    return np.sort_complex(-np.linalg.eigvals(np.asarray(jax.jacfwd(rates)(steady)))) / float(V)


@typed
def critical_stiffness(law: Law, velocity: float | str) -> float:
    """Largest stiffness K/W0 (1/m) at which steady sliding is unstable, without inertia.

    Parameters
    ----------
    law, velocity
        As in `decay_rates`. Any law; elastic asperities count.

    Returns
    -------
    float
        (B - A)/D0 of the three laws above; 0 where steady sliding is stable at any stiffness,
        infinite where it is unstable at any.
    """
    rates = np.abs(decay_rates(law, velocity))
    V = number(velocity, "critical_stiffness.velocity", "velocity", "positive")
    state = law.steady_state(jnp.asarray(V))
    _, direct = jax.jvp(
        lambda log_v: law.friction(jnp.exp(log_v), state, jnp.ones(())),
        (jnp.log(jnp.asarray(V)),),
        (jnp.ones(()),),
    )
    scales = float(direct) * rates[rates > 0]
    rule = "have a state that relaxes and a direct effect"
    require(np.any(scales > 0), "law", rule, law.name, "its sliding has no critical stiffness")
    k = np.geomspace(scales.min() / 10**_DECADES, scales.max() * 10**_DECADES, _POINTS)
    low = 0.0
    for refinement in range(_REFINEMENTS):
        unstable = np.flatnonzero(_growth(law, V, k) > 0)
        if not unstable.size:
            break
        if refinement == 0 and unstable[-1] == _POINTS - 1:
            return math.inf
        low, high = (float(k[i]) for i in (unstable[-1], min(unstable[-1] + 1, _POINTS - 1)))
        k = np.geomspace(low, high, _POINTS)
    return low


class SlidingThreshold(NamedTuple):
    """Where unmodulated sliding on rigid asperities loses stability, without inertia.

    Attributes
    ----------
    stiffness : array
        K/W0 (1/m); not positive where sliding is stable at any stiffness.
    wavenumber : array
        Of the oscillation there, its pulsation over V (1/m); 0 where the stiffness is not positive.
    """

    stiffness: Float
    wavenumber: Float


def sliding_threshold(p: Mapping[str, Any]) -> SlidingThreshold:
    """The threshold of a law with A, B and D0, and with B2 and D2 if it has a second state.

    Parameters
    ----------
    p : mapping of str to array
        Parameters of the law by name; NaN for the B2 and D2 of a point without a second state.

    Notes
    -----
    A disturbance that grows as exp(s u) over the slip u changes the logarithm of the velocity by x
    and friction by (A - B/(1 + s D0) - B2/(1 + s D2)) x, which the spring follows by -k x/s:

        A s + k - s [B/(1 + s D0) + B2/(1 + s D2)] = 0.

    With one state this gives k = (B - A)/D0 and s^2 = -(B - A)/(A D0^2), Eqs. (18) and (19) of
    Bureau et al. (2000). With two states it is a cubic a3 s^3 + a2 s^2 + a1 s + k, which has an
    imaginary pair where a1 a2 = a3 k (Hurwitz): a quadratic for k, whose larger root counts.
    """
    A, B, D0 = (np.asarray(p[name], float) for name in ("A", "B", "D0"))
    B2, D2 = (np.asarray(p.get(name, np.nan), float) for name in ("B2", "D2"))
    two = np.isfinite(B2) & np.isfinite(D2)
    B2, D2 = np.where(two, B2, 0.0), np.where(two, D2, D0)
    product, total = D0 * D2, D0 + D2
    a1, a2 = (
        A - B - B2,
        A * total - B * D2 - B2 * D0,
    )  # at k = 0; they rise by these lengths times k
    linear = a2 * total + (a1 - A) * product
    with np.errstate(all="ignore"):
        root = np.sqrt(linear**2 - 4 * product * total * a1 * a2)
        # Without cancellation; no real root, or none above zero, is stable sliding.
        larger = np.where(
            linear < 0, (root - linear) / (2 * product * total), -2 * a1 * a2 / (linear + root)
        )
    k = np.where(two, np.nan_to_num(larger), -a1 / D0)
    square = np.maximum((a1 + k * total) / (A * product), 0.0)
    return SlidingThreshold(k, np.where(k > 0, np.sqrt(square), 0.0))


def _growth(law: Law, V: float, k: Float) -> Float:
    """Growth rate of a small disturbance of steady sliding, at stiffnesses `k`."""
    wide = jax.tree.map(lambda a: np.broadcast_to(np.asarray(a, float), k.shape), law)
    slider = Slider(wide, spring=k, load=np.ones_like(k))
    return np.asarray(steady_growth(QuasiStatic(slider, np.full(k.shape, V), 1.0)))


@typed
@jit_large
def steady_growth(motion: Motion) -> Array:
    """Growth rate of a small disturbance of steady sliding.

    Parameters
    ----------
    motion : Motion
        Numbers of shape (points,). At 1 rad/s the rate is one per second.
    """
    return spectral_abscissa(motion.steady_jacobian())


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
