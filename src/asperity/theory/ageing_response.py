"""Exact response to second order in eps of the laws built on Eqs. (1) and (2), at any frequency.

Closed forms for Rice-Ruina friction with rigid or elastic asperities (lambda), Linker-Dieterich
ageing (alpha) and inertia (M). The approximations of Bureau et al. (2000), section III, are limits
of these forms. They are an independent check of `asperity.theory.perturbation`, which uses
automatic differentiation. Dimensionless, theta = omega t, per eps and eps^2; n is the harmonic::

    kappa = V K/(omega W0)      nu = V/(omega D0)          q = omega lambda/V
    r_n = 1 - n^2 M omega^2/K   beta_n = B nu/(n i + nu)   S_n = A - beta_n
    D_n = 1 + n i q S'_n        S'_n = A, or S_n if the age law has the plastic velocity too

The interface carries r_n F_n; the spring gives the velocity v_n = -n i F_n/kappa; the asperities
leave the plastic velocity p_n = v_n - n i q G_n, with G the interface force over the load. From
G = mu + A ln p + B phi, with phi' = nu (e^(-phi) - u) - (alpha/B) w'/w and u = v or p::

    G_n D_n = S_n v_n + N_n,    N_1 = -i alpha/(i + nu)
                                N_2 = -A p_1^2/4 + (B nu phi_1^2/4 + i alpha/2)/(2i + nu)

F = w G then gives a linear equation for F_1 = H = c1/eps and for F_2 = c2/eps^2. The mean needs
none: <p> = 1 and <e^(-phi)> = 1 hold exactly, so

    (mean - mu)/eps^2 = Re(G_1)/2 - A |p_1|^2/4 + B |phi_1|^2/4.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.parameters.arguments import typed
from asperity.theory.closed_forms import AgeVelocity, SmallModulation


class AgeingResponse(NamedTuple):
    """Coefficients of the expansion of F/W0 = mean + sum Re(c_n e^{i n theta}).

    Attributes
    ----------
    transfer : complex array
        c1 / eps.
    mean_curvature : array
        (mean - mu) / eps^2.
    second_harmonic : complex array
        c2 / eps^2.
    slip, log_age : complex array
        First-order amplitudes, per eps, of the plastic velocity over V and of ln(Phi).
    """

    transfer: Array
    mean_curvature: Array
    second_harmonic: Array
    slip: Array
    log_age: Array


class _Order(NamedTuple):
    """The coefficients of the module's docstring at one harmonic n."""

    n: int
    balance: Array  # r_n
    stiffness: Array  # S_n
    series: Array  # D_n
    relaxation: Array  # n i + nu


@typed
def ageing_response(p: SmallModulation, age_velocity: AgeVelocity = "slider") -> AgeingResponse:
    """Exact first- and second-order response; equations in the module's docstring.

    Parameters
    ----------
    p : SmallModulation
        B must not be zero where alpha is not.
    age_velocity : {"slider", "plastic"}
        Velocity that renews the contacts: the slider's, as printed in Eq. (2), or the plastic one.

    Returns
    -------
    AgeingResponse

    Raises
    ------
    InputError
        If `age_velocity` is neither of the two.
    """
    return _response(p, age_velocity == "plastic")


# As one program: compiling each operation takes ten times as long.
@partial(jax.jit, static_argnames="plastic")
def _response(p: SmallModulation, plastic: bool) -> AgeingResponse:
    one, two = _order(p, 1, plastic), _order(p, 2, plastic)
    nu = p.V / (p.omega * p.D0)

    H = _solve(p, one, exchange=p.mu, source=-1j * p.alpha / one.relaxation)
    G1 = one.balance * H - p.mu
    velocity = -1j * H / p.kappa
    slip = velocity - 1j * p.omega * p.lambda_ / p.V * G1
    # alpha/B, and zero rather than 0/0 for a law without either.
    jump = jnp.where(p.alpha == 0, 0.0, p.alpha / jnp.where(p.alpha == 0, 1.0, p.B))
    log_age = -(nu * (slip if plastic else velocity) + 1j * jump) / one.relaxation

    source = (p.B * nu * log_age**2 / 4 + 1j * p.alpha / 2) / two.relaxation - p.A * slip**2 / 4
    return AgeingResponse(
        transfer=H,
        mean_curvature=G1.real / 2 - p.A * jnp.abs(slip) ** 2 / 4 + p.B * jnp.abs(log_age) ** 2 / 4,
        second_harmonic=_solve(p, two, exchange=G1 / 2, source=source),
        slip=slip,
        log_age=log_age,
    )


def _order(p: SmallModulation, n: int, plastic: bool) -> _Order:
    nu = p.V / (p.omega * p.D0)
    relaxation = 1j * n + nu
    stiffness = p.A - p.B * nu / relaxation
    q = p.omega * p.lambda_ / p.V
    return _Order(
        n=n,
        balance=1 - n**2 * p.M * p.omega**2 / p.K,
        stiffness=stiffness,
        series=1 + 1j * n * q * (stiffness if plastic else p.A),
        relaxation=relaxation,
    )


def _solve(p: SmallModulation, order: _Order, exchange: Array, source: Array) -> Array:
    """F_n from r_n F_n = G_n + exchange and G_n D_n = S_n v_n + source, v_n = -n i F_n/kappa."""
    left = order.balance * order.series + 1j * order.n * order.stiffness / p.kappa
    return (exchange * order.series + source) / left
