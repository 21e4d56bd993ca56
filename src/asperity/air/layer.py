"""The squeezed air layer: linearised Reynolds equation between two parallel discs.

Source: Bureau, Baumberger and Caroli (2000), Appendix, Eqs. (31) to (38).
Isothermal air of mean pressure P0 leaks radially through a gap h0; the pressure excess vanishes at
the rim r = R. All amplitudes are complex with the factor e^{+i w t}.

Everything depends on the one number s = |gamma R| = sqrt(12 eta w R^2/(P0 h0^2)) ("squeeze"), for
gamma R = (1 - i)/sqrt(2) s: s << 1 is a viscous leak, s >> 1 an elastic cushion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from asperity.air.normal_contact import Real, as_real
from asperity.arrays import Complex, Float
from asperity.errors import InputError
from asperity.parameters import Parameter
from asperity.parameters.arguments import broadcast_shape, one_of, typed

GasFlow = Literal["continuum", "slip", "free-molecular"]
#: Numbers of a layer, by their names in materials; `argument` is the field of `AirLayer`.
LAYER: Mapping[str, Parameter] = {
    name: Parameter(name, kind, "positive", meaning, symbol, argument=field)
    for name, field, kind, symbol, meaning in (
        ("P0", "P0", "pressure", "P_0", "pressure of the air"),
        ("h0", "h0", "length", "h_0", "gap between the surfaces"),
        ("R", "R", "length", "R", "radius of the air layer"),
        ("eta_air", "eta", "viscosity", r"\eta", "viscosity of the air"),
    )
}
#: Kind of quantity of the fields of a layer.
_KINDS = {p.argument: p.kind for p in LAYER.values()} | {"temperature": "temperature"}
#: sqrt(pi R_gas T/(2 m_air)) is the molecular speed in mfp = eta/P times it: R_gas of CODATA, in
#: J/(mol K), the molar mass of dry air of the US Standard Atmosphere 1976, in kg/mol.
_GAS_CONSTANT, _MOLAR_MASS_AIR = 8.314462618, 28.9644e-3

#: Value of s above which the asymptotic series replaces the continued fraction, and the numbers of
#: terms with which both reach 1e-15 there (measured: 37 levels and 14 powers at s = 30; 16 powers
#: at s = 25).
_HANDOVER, _LEVELS, _POWERS = 30.0, 40, 16


@cache
def _asymptotic_coefficients() -> tuple[float, ...]:
    """c_k of I1(x)/I0(x) ~ sum c_k x^-k, from its Riccati equation y' = 1 - y/x - y^2."""
    c = [1.0]
    for k in range(1, _POWERS + 1):
        products = sum(c[i] * c[k - i] for i in range(1, k))
        c.append(((k - 2) * c[k - 1] - products) / 2)
    return tuple(c)


def _ratio_by_fraction(s: Float) -> Complex:
    # With (gamma R)^2 = -i q every level keeps both parts positive: no digit cancels, and the
    # (tiny) elastic part of a nearly viscous layer is as accurate as its damping.
    q = 1j * s**2
    tail = np.full(s.shape, 2.0 * (_LEVELS + 1), dtype=complex)
    for k in range(_LEVELS, 1, -1):
        tail = 2.0 * k + q / tail
    ratio: Complex = -q / (2 * tail + q)
    return ratio


def _ratio_by_asymptotics(s: Float) -> Complex:
    u = np.exp(-0.25j * np.pi) / s
    ratio: Complex = -1 + 2 * u * np.polyval(_asymptotic_coefficients()[::-1], u)
    return ratio


@typed
def bessel_ratio(squeeze: ArrayLike) -> Any:
    """J2(gamma R)/J0(gamma R) at gamma R = (1 - i)/sqrt(2) s, for any s >= 0.

    Continued fraction J2/J0 = z^2/(2C - z^2), C = 4 - z^2/(6 - z^2/(8 - ...)), z = gamma R, up to
    s = 30, the asymptotic series of -I2/I0 above. Bessel functions themselves are never
    formed, hence nothing overflows; real and imaginary part are each accurate to about 1e-15.

    Parameters
    ----------
    squeeze : array
        s = |gamma R| (dimensionless).

    Returns
    -------
    complex array
        Both parts are <= 0: an elastic and a damping force, whatever s.
        -> -i s^2/8 - s^4/48 for s -> 0, -> -1 + sqrt(2) (1 - i)/s for s -> infinity.
    """
    s = np.asarray(as_real("layer.squeeze", squeeze, "dimensionless", "not negative"))
    large = s > _HANDOVER
    ratio = np.empty(s.shape, dtype=complex)
    ratio[large] = _ratio_by_asymptotics(s[large])
    ratio[~large] = _ratio_by_fraction(s[~large])
    return ratio[()]


@dataclass(frozen=True)
class AirLayer:
    """A disc of gas between two smooth parallel discs.

    Parameters
    ----------
    P0 : array
        Ambient pressure (Pa).
    h0 : array
        Gap at rest (m).
    eta : array
        Dynamic viscosity of the bulk gas (Pa s), independent of the pressure.
    R : array
        Radius of the disc or of the patch of micro-contacts (m).
    gas_flow : {"continuum", "slip", "free-molecular"}
        Flow of the leak where the mean free path l is not small against h0 (Kn = l/h0).
        "continuum": as for small Kn, the paper's Eq. (poiseuille). "slip": Poiseuille flow with
        Maxwell's slip at diffuse walls, eta/(1 + 6 Kn), which is right to first order in Kn and too
        resistive at large Kn. "free-molecular": the paper's argument for 1 mbar, zero viscosity
        where l exceeds the gap (Kn > 1), the viscosity of the bulk elsewhere.
    temperature : array
        Temperature (K); enters the mean free path only.

    Raises
    ------
    InputError
        When a field or the area is not finite and positive, the shapes do not broadcast, or
        `gas_flow` is unknown.
    """

    P0: Real
    h0: Real
    eta: Real
    R: Real
    gas_flow: GasFlow = "continuum"
    temperature: Real = 300.0

    def __post_init__(self) -> None:
        for field, kind in _KINDS.items():
            value = as_real(f"AirLayer.{field}", getattr(self, field), kind)
            object.__setattr__(self, field, value)
        with np.errstate(over="ignore"):
            if not np.all(np.isfinite(np.square(self.R))):
                rule, got = "have a square that is a finite number", f"{np.max(self.R):g} m"
                raise InputError("AirLayer.R", rule, got, "give the radius of the contact patch")
        broadcast_shape("AirLayer.fields", *(getattr(self, field) for field in _KINDS))
        one_of(self.gas_flow, get_args(GasFlow), "AirLayer.gas_flow")

    @property
    def area(self) -> Real:
        """Sigma0 = pi R^2 (m^2)."""
        return np.pi * self.R**2

    @property
    def stiffness(self) -> Real:
        """Stiffness kappa_air = P0 Sigma0/h0 (N/m) of a layer that cannot leak, Eq. (31)."""
        return self.P0 * self.area / self.h0

    @property
    def mean_free_path(self) -> Real:
        """Kinetic estimate (eta/P0) sqrt(pi R_gas T/(2 m)) (m), m the molar mass of air."""
        speed = np.sqrt(np.pi * _GAS_CONSTANT * self.temperature / (2 * _MOLAR_MASS_AIR))
        path: Real = self.eta / self.P0 * speed
        return path

    @property
    def knudsen(self) -> Real:
        """Knudsen number Kn = mean free path/h0 (dimensionless)."""
        return self.mean_free_path / self.h0

    @property
    def effective_viscosity(self) -> Real:
        """Viscosity (Pa s) that resists the leak under the model `gas_flow`."""
        if self.gas_flow == "slip":
            return self.eta / (1 + 6 * self.knudsen)
        if self.gas_flow == "free-molecular":
            eta: Real = np.where(np.asarray(self.knudsen) > 1, 0.0, self.eta)[()]
            return eta
        return self.eta

    def squeeze(self, omega: ArrayLike) -> Real:
        """Return s = |gamma R| = sqrt(12 eta w R^2/(P0 h0^2)) at `omega` = w (rad/s)."""
        w = as_real("layer.omega", omega, "dimensionless", "not negative")
        broadcast_shape("layer.omega", w, self.P0, self.h0, self.eta, self.R, self.temperature)
        s: Real = np.sqrt(12 * self.effective_viscosity * w / self.P0) * (self.R / self.h0)
        return s

    def gamma(self, omega: ArrayLike) -> Any:
        """Complex wave number gamma (1/m) of the pressure field, Eq. (37)."""
        return (1 - 1j) / np.sqrt(2) * (self.squeeze(omega) / self.R)

    def dynamic_stiffness(self, omega: ArrayLike) -> Any:
        """Complex stiffness -F_p/delta h = -kappa_air J2(gamma R)/J0(gamma R) (N/m), Eq. (38).

        The real part is the spring, the imaginary part w times the damping constant (e^{+i w t});
        both are >= 0. Limits: kappa_air for s -> infinity, i w 3 pi eta R^4/(2 h0^3) for s -> 0.

        Parameters
        ----------
        omega : array
            Angular frequency (rad/s), not negative.
        """
        return -self.stiffness * bessel_ratio(self.squeeze(omega))

    def pressure(self, r: ArrayLike, omega: ArrayLike) -> Any:
        """Pressure excess per unit widening of the gap, delta P/delta h (Pa/m), Eq. (dP).

        -(P0/h0) [1 - J0(gamma r)/J0(gamma R)], stable for any s.

        Parameters
        ----------
        r : array
            Distance from the centre (m), 0 <= r <= R.
        omega : array
            Angular frequency (rad/s).

        Raises
        ------
        InputError
            When a radius lies outside the disc.
        """
        radius = as_real("layer.r", r, "length", "not negative")
        s = self.squeeze(omega)
        broadcast_shape("layer.r", radius, s, self.R)
        rho = np.asarray(radius / self.R)
        if (rho > 1).any():
            worst = float(np.max(np.broadcast_to(radius, rho.shape)[rho > 1]))
            raise InputError("layer.r", "lie on the disc", f"{worst:g} m", "keep 0 <= r <= R")
        rho, squeeze = np.broadcast_arrays(rho, s)
        return -self.P0 / self.h0 * _profile(rho, squeeze)[()]


def _profile(rho: Float, s: Float) -> Complex:
    """1 - J0(rho z)/J0(z) at z = (1 - i)/sqrt(2) s."""
    from scipy.special import jve

    # For s < 1 the difference cancels; sum_k y^k (1 - rho^2k)/k!^2, y = i s^2/4, does not.
    y = 0.25j * np.minimum(s, 1.0) ** 2
    terms = [y**k / factorial(k) ** 2 for k in range(11)]
    top = sum(t * (1 - rho ** (2 * k)) for k, t in enumerate(terms))
    # jve is scaled by e^{-|Im|}: the quotient lacks the factor e^{-s (1 - rho)/sqrt 2}.
    z = (1 - 1j) / np.sqrt(2) * np.maximum(s, 1.0)
    bare = jve(0, rho * z) / jve(0, z) * np.exp(np.abs(z.imag) * (rho - 1))
    return np.where(s < 1, top / sum(terms), 1 - bare)


@typed
def shear_viscosity_ratio(
    V: ArrayLike, *, W0: ArrayLike, A: ArrayLike, layer: AirLayer, as_printed: bool = False
) -> Real:
    """Viscous shear force of the layer over the rate term of friction, eta Sigma0 V/(A W0 h0).

    A tangential oscillation of amplitude dx gives eta w dx Sigma0/h0 and A W0 w dx/V: their ratio
    contains A. The paper's last formula prints eta Sigma0 V/(W0 h0), without it.

    Parameters
    ----------
    V : array
        Sliding velocity (m/s).
    W0 : array
        Mean normal load (N).
    A : array
        Rate coefficient of friction (dimensionless).
    layer : AirLayer
        Its bulk viscosity, area and gap enter.
    as_printed : bool
        Leave A out, as the paper does.
    """
    velocity = as_real("shear.V", V, "velocity")
    load, rate = as_real("shear.W0", W0, "force"), as_real("shear.A", A, "dimensionless")
    broadcast_shape("shear arguments", velocity, load, rate, layer.eta, layer.R, layer.h0)
    printed: Real = layer.eta * layer.area * velocity / (load * layer.h0)
    return printed if as_printed else printed / rate
