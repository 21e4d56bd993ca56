"""The perturbation formulas of Bureau et al. (2000), section III, as printed and as derived.

Where a printed formula is a misprint (see the documentation's page on misprints) the function takes
``form``: "derived", the default, or "as_printed". Section III.A expands in the amplitude of
w = W/W0 = 1 + eps cos(omega t) about steady sliding at V, with x and Phi the position and age::

    x - x_st = Re(eps X1 e^{i omega t}),    Phi - D0/V = Re(eps Phi1 e^{i omega t})

F = K (V t - x) is the spring force; F/W0 = mean + sum Re(c_n e^{i n omega t}), mu_n = |c_n|.
Every quantity is in SI and element-wise in arrays. The exact coefficients at any frequency, for
Linker-Dieterich ageing and elastic asperities as well, are in `asperity.theory.ageing_response`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal, TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.errors import InputError
from asperity.laws.parameter import checked
from asperity.parameters.arguments import typed

Form: TypeAlias = Literal["derived", "as_printed"]
#: Velocity that renews the contacts: the slider's, as printed in Eq. (2), or the plastic one.
AgeVelocity: TypeAlias = Literal["slider", "plastic"]

#: Laws whose steady sliding loses stability at a stiffness known in closed form: of rigid
#: asperities, and of elastic ones with the velocity of their age law.
_RIGID = ("rice-ruina", "linker-dieterich", "ruina-slip", "perrin-rice-zheng")
_ELASTIC = {"elasto-plastic": "slider", "elasto-plastic-age": "plastic"}


def _quantity(name: str, kind: str, rule: str = "positive", **options: Any) -> Any:
    """A field that takes SI numbers or texts with units, and refuses what breaks its rule."""
    converter = partial(checked, name=f"SmallModulation.{name}", kind=kind, rule=rule)
    return eqx.field(converter=converter, **options)


class SmallModulation(eqx.Module):
    """Steady sliding at V, of which the formulas describe a small modulation.

    Parameters
    ----------
    mu : array
        Steady friction coefficient at V, mu0 - (B - A) ln(V/V0) (dimensionless).
    A, B : array
        Rate and state coefficients (dimensionless).
    D0 : array
        Memory length (m).
    K : array
        Spring stiffness (N/m).
    W0 : array
        Mean normal load (N).
    V : array
        Pulling velocity (m/s).
    omega : array
        Angular frequency of the modulation (rad/s).
    M : array
        Slider mass (kg); 0 leaves inertia out.
    alpha : array
        Linker-Dieterich coefficient (dimensionless); 0 for the ageing law of Eq. (2).
    lambda_ : array
        Shear elastic length of the asperities (m); 0 for rigid ones.
    """

    mu: Array = _quantity("mu", "dimensionless")
    A: Array = _quantity("A", "dimensionless")
    B: Array = _quantity("B", "dimensionless", "not negative")
    D0: Array = _quantity("D0", "length")
    K: Array = _quantity("K", "stiffness")
    W0: Array = _quantity("W0", "force")
    V: Array = _quantity("V", "velocity")
    omega: Array = _quantity("omega", "angular_frequency")
    M: Array = _quantity("M", "mass", "not negative", default=0.0)
    alpha: Array = _quantity("alpha", "dimensionless", "finite", default=0.0)
    lambda_: Array = _quantity("lambda", "length", "not negative", default=0.0)

    @property
    def kappa(self) -> Array:
        """V K / (omega W0): the scale of the force harmonics (dimensionless)."""
        return self.V * self.K / (self.omega * self.W0)


@typed
def steady_position(p: SmallModulation, t: ArrayLike, form: Form = "derived") -> Array:
    """x_st (m) at the time `t` (s), Eq. (10).

    The spring carries F = mu W0, so that x_st = V t - mu W0 / K; the printed form lacks mu.
    """
    mu = 1.0 if form == "as_printed" else p.mu
    return p.V * t - mu * p.W0 / p.K


@typed
def determinant(p: SmallModulation, form: Form = "derived") -> Array:
    """Delta (kg/s^3), Eq. (17): the determinant of the linear system (13)-(14).

    Derived: (K - M omega^2 + i omega A W0/V)(V/D0 + i omega) - i omega B W0/D0. The printed form
    has K/Kc where factoring this out gives Kc/K, and, like omega_c, needs B > A.
    """
    if form == "derived":
        mechanical = p.K - p.M * p.omega**2 + 1j * p.omega * p.A * p.W0 / p.V
        return mechanical * (p.V / p.D0 + 1j * p.omega) - 1j * p.omega * p.B * p.W0 / p.D0
    ratio = p.K / critical_stiffness(p)
    slow = critical_pulsation(p) / p.omega
    inertia = p.M * p.omega**2 / p.K
    bracket = (
        -ratio
        + (1 - inertia) * slow**2
        - 1j * slow * jnp.sqrt((p.B - p.A) / p.A) * (inertia - (1 - ratio))
    )
    return p.K * p.V / p.D0 * slow**-2 * bracket


@typed
def position_amplitude(p: SmallModulation, form: Form = "derived") -> Array:
    """X1 (m), Eq. (15); the two forms differ by their Delta.

    Eqs. (11) and (12) print X1 as the amplitude of the age and Phi1 as that of the position;
    the linear system (13)-(14) and the units have them the other way round.
    """
    return -p.W0 * p.mu / determinant(p, form) * (1j * p.omega + p.V / p.D0)


@typed
def age_amplitude(p: SmallModulation, form: Form = "derived") -> Array:
    """Phi1 (s), Eq. (16); the two forms differ by their Delta."""
    return 1j * p.omega * p.W0 * p.mu / (p.V * determinant(p, form))


@typed
def critical_stiffness(p: SmallModulation) -> Array:
    """Kc = (B - A) W0 / D0 (N/m), Eq. (18): rigid asperities, no inertia."""
    return (p.B - p.A) * p.W0 / p.D0


@typed
def critical_pulsation(p: SmallModulation) -> Array:
    """omega_c = sqrt((B - A)/A) V/D0 (rad/s), Eq. (19), the pulsation at K = Kc.

    Raises
    ------
    InputError
        If B <= A, where steady sliding is stable at any stiffness.
    """
    if not np.all(p.B > p.A):
        got = f"B - A = {np.min(p.B - p.A):g}"
        advice = "a velocity-strengthening interface has no threshold"
        raise InputError("critical_pulsation.B", "be above A", got, advice)
    return jnp.sqrt((p.B - p.A) / p.A) * p.V / p.D0


@typed
def inertial_pulsation(p: SmallModulation) -> Array:
    """omega_0 = sqrt(K/M) (rad/s), after Eq. (19)."""
    return jnp.sqrt(p.K / p.M)


@typed
def first_harmonic(p: SmallModulation, epsilon: ArrayLike) -> Array:
    """mu1 at high frequency: eps |mu - alpha| V K/(A omega W0), Eqs. (20) and (25)."""
    return epsilon * jnp.abs(p.mu - p.alpha) / p.A * p.kappa


@typed
def second_harmonic(p: SmallModulation, epsilon: ArrayLike, form: Form = "derived") -> Array:
    """mu2 at high frequency, Eq. (21), of alpha = 0.

    Derived: (V K/(omega W0)) mu (mu + 2A)/(8 A^2) eps^2; printed: with mu^2/(2 A^2) in its place.
    """
    factor = p.mu**2 / 2 if form == "as_printed" else p.mu * (p.mu + 2 * p.A) / 8
    return p.kappa * factor / p.A**2 * jnp.square(epsilon)


@typed
def second_harmonic_linker_dieterich(p: SmallModulation, epsilon: ArrayLike) -> Array:
    """mu2 at high frequency with alpha (not in the paper).

    (V K/(omega W0)) [(mu - alpha)^2 + A (2 mu - alpha)]/(8 A^2) eps^2.
    """
    bracket = (p.mu - p.alpha) ** 2 + p.A * (2 * p.mu - p.alpha)
    return p.kappa * jnp.abs(bracket) / (8 * p.A**2) * jnp.square(epsilon)


@typed
def mean_shift(p: SmallModulation, epsilon: ArrayLike) -> Array:
    """Change of the mean friction coefficient at high frequency, Eq. (22), negative.

    It is that of alpha = 0; see `mean_shift_linker_dieterich` for another alpha.
    """
    return -p.mu * (p.mu + 2 * p.A) / (4 * p.A) * jnp.square(epsilon)


@typed
def mean_shift_linker_dieterich(p: SmallModulation, epsilon: ArrayLike) -> Array:
    """Change of the mean friction coefficient at high frequency with alpha (not in the paper).

    -[(mu - alpha)^2/(4A) + mu/2 - alpha^2/(4B)] eps^2.
    """
    # Zero rather than 0/0 for a law without alpha and B.
    age = jnp.where(p.alpha == 0, 0.0, p.alpha**2 / jnp.where(p.alpha == 0, 1.0, 4 * p.B))
    curvature = (p.mu - p.alpha) ** 2 / (4 * p.A) + p.mu / 2 - age
    return -curvature * jnp.square(epsilon)


@typed
def age_to_velocity_ratio(p: SmallModulation, form: Form = "derived") -> Array:
    """Relative modulation of the age over that of the velocity, Eq. (23).

    Derived: 1/sqrt(1 + (omega D0/V)^2), from Eq. (14) alone. Printed: omega_c/omega, which is its
    high-frequency limit only where (B - A)/A = 1, as it is at the paper's central values.
    """
    if form == "derived":
        return 1 / jnp.hypot(1.0, p.omega * p.D0 / p.V)
    return critical_pulsation(p) / p.omega


@typed
def velocity_modulation(p: SmallModulation, epsilon: ArrayLike) -> Array:
    """Relative modulation of the velocity at high frequency, eps mu/A, Eq. (24), of alpha = 0.

    The parameter that has to be small for perturbation theory to hold.
    """
    return epsilon * p.mu / p.A


@typed
def first_harmonic_plateau(p: SmallModulation, epsilon: ArrayLike) -> Array:
    """mu1 of elastic asperities in the limit V -> 0 without inertia (not in the paper).

    eps mu l/(1 + l) with l = K lambda/W0: the slip has stopped, and what remains is the exchange of
    force between the spring and asperities whose stiffness follows the load.
    """
    ratio = p.K * p.lambda_ / p.W0
    return epsilon * p.mu * ratio / (1 + ratio)


@typed
def critical_stiffness_inertial(p: SmallModulation) -> Array:
    """Kc (N/m) of rigid asperities with inertia: Eq. (18) times 1 + M V^2/(A W0 D0).

    Where the derived Delta vanishes on the real frequency axis; the pulsation there stays omega_c.
    """
    return critical_stiffness(p) * (1 + p.M * p.V**2 / (p.A * p.W0 * p.D0))


@typed
def critical_stiffness_elastic(p: SmallModulation, age_velocity: AgeVelocity = "slider") -> Array:
    """Kc (N/m) of elastic asperities without inertia (not in the paper).

    Parameters
    ----------
    p : SmallModulation
    age_velocity : {"slider", "plastic"}
        Velocity in the age law. "slider", as printed: (B - A) W0/(D0 + A lambda).
        "plastic": (B - A) W0/(D0 - (B - A) lambda), the spring and the asperities in series;
        infinite where the asperities alone are too soft, lambda >= D0/(B - A).
    """
    plastic = age_velocity == "plastic"
    length = p.D0 + (p.A - p.B if plastic else p.A) * p.lambda_
    stabilised = length > 0
    return jnp.where(stabilised, (p.B - p.A) * p.W0 / jnp.where(stabilised, length, 1.0), jnp.inf)


@typed
def critical_stiffness_form(
    law: str, *, elastic: bool, inertia: bool
) -> Callable[[SmallModulation], Array] | None:
    """The closed form of Kc for a law; None without a closed form.

    Parameters
    ----------
    law : str
        Name of a registered law.
    elastic : bool
        Whether its asperities have a shear elastic length above zero.
    inertia : bool
        Whether the mass of the slider counts.
    """
    if law in _RIGID or (law in _ELASTIC and not elastic):
        return critical_stiffness_inertial if inertia else critical_stiffness
    if law in _ELASTIC and not inertia:
        return partial(critical_stiffness_elastic, age_velocity=_ELASTIC[law])
    return None
