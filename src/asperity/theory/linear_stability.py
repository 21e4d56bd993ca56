"""Linear stability of steady sliding without inertia: decay of the states, critical stiffness.

Stiffness is over the normal load, k = K/W0, in 1/m. B and A are the state and rate coefficients of
a law, D0 is its memory length; one state gives the critical stiffness k = (B - A)/D0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import spectral_abscissa
from asperity.arrays import Complex, Float
from asperity.errors import require
from asperity.laws import Law
from asperity.parameters import law_parameters
from asperity.parameters.arguments import number, typed
from asperity.slider import Motion, QuasiStatic, Slider
from asperity.slider.problem import require_even_track

#: Stiffnesses of the stability scan: decades below and above those at which the spring is as fast
#: as the slowest and the fastest state, and number of points.
_DECADES, _POINTS = 8, 400
_REFINEMENTS = 8


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
        Eigenvalues of -d(state rate)/d(state) over the velocity, by rising real part: 1/D0 of
        rice-ruina, ruina-slip and perrin-rice-zheng.

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
        (B - A)/D0 of these three laws; 0 where steady sliding is stable at any stiffness,
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
