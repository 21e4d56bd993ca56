"""The multicontact interface in the normal direction: h0 - h = lambda_z ln(W/W0).

Source: Bureau, Baumberger and Caroli (2000), Appendix, first paragraph and Eq. (30).
The closure `h0 - h` (m) is positive when the load rises above W0 and the gap narrows. The
printed Eq. (30), F_el = W0 (h - h0)/lambda_z, counts the elastic force on the slider towards the
track, as Eq. (39) uses it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import Annotated, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from asperity.arrays import Float
from asperity.errors import InputError
from asperity.parameters import Parameter, obeying
from asperity.parameters.arguments import at_least, broadcast_shape, typed

#: A number or an array of numbers, in SI.
Real: TypeAlias = float | Float

#: The number of the contacts, as in materials.
LAMBDA_Z = Parameter(
    "lambda_z", "length", "positive", "normal elastic length of the contacts", r"\lambda_z",
    argument="lambda_z",
)  # fmt: skip
#: Powers of (beta/2)^2 kept in I0(beta) - 1 for beta <= 1; the first one dropped is below 1e-17.
_I0_SERIES = (*(1.0 / factorial(k) ** 2 for k in range(10, 0, -1)), 0.0)


def as_real(label: str, value: ArrayLike, kind: str, rule: str = "positive") -> Real:
    """`asperity.parameters.obeying` as a float or a new float array."""
    array = np.array(obeying(value, label, kind, rule))
    return array if array.ndim else float(array)


@dataclass(frozen=True)
class NormalContact:
    """Elastic micro-contacts that carry the mean load W0.

    Parameters
    ----------
    W0 : array
        Mean normal load (N).
    lambda_z : array
        Normal elastic length (m), of the order of the roughness.

    Raises
    ------
    InputError
        When a field is not finite and positive, or the two do not broadcast.
    """

    W0: Real
    lambda_z: Real

    def __post_init__(self) -> None:
        load = as_real("NormalContact.W0", self.W0, "force")
        length = as_real("NormalContact.lambda_z", self.lambda_z, "length")
        broadcast_shape("NormalContact.lambda_z", load, length)
        object.__setattr__(self, "W0", load)
        object.__setattr__(self, "lambda_z", length)

    @property
    def stiffness(self) -> Real:
        """Linear stiffness kappa_z = W0/lambda_z (N/m), Eq. (30)."""
        return self.W0 / self.lambda_z

    def omega0(self, M: ArrayLike) -> Real:
        """Return the resonance w0z = sqrt(kappa_z/M) (rad/s) of a slider of mass `M` (kg)."""
        omega0: Real = np.sqrt(self.stiffness / as_real("NormalContact.M", M, "mass"))
        return omega0

    def load(self, closure: ArrayLike) -> Real:
        """Return the load W = W0 exp((h0 - h)/lambda_z) (N) at the closure h0 - h (m)."""
        relative = as_real("NormalContact.closure", closure, "length", "finite") / self.lambda_z
        load: Real = self.W0 * np.exp(relative)
        return load

    def closure(self, load: ArrayLike) -> Real:
        """Closure h0 - h = lambda_z ln(W/W0) (m) under the normal load W (N).

        Raises
        ------
        InputError
            When a load is not positive: the contact would be lost.
        """
        relative = as_real("NormalContact.load", load, "force") / self.W0
        closure: Real = self.lambda_z * np.log(relative)
        return closure

    @typed
    def load_harmonics(self, amplitude: ArrayLike, count: Annotated[int, at_least(1)] = 4) -> Float:
        """Harmonics of W/W0 when the gap moves sinusoidally, without linearising.

        With h = h_mean - a cos(wt) and a mean load that stays W0, the law gives exactly
        W/W0 = exp(beta cos wt)/I0(beta), beta = a/lambda_z, so that
        W/W0 = 1 + sum_n w_n cos(n wt) with w_n = 2 I_n(beta)/I0(beta) -> 2 (beta/2)^n/n!.

        Parameters
        ----------
        amplitude : array
            Peak amplitude a of the gap's motion (m), not negative.
        count : int
            Number of harmonics.

        Returns
        -------
        array, shape (..., count)
            Peak amplitudes w_1 ... w_count (dimensionless).
        """
        from scipy.special import ive

        beta = np.asarray(self._beta(amplitude))[..., np.newaxis]
        order = np.arange(1, count + 1)
        return np.asarray(2 * ive(order, beta) / ive(0, beta))

    def dilation(self, amplitude: ArrayLike) -> Real:
        """Rise of the mean gap lambda_z ln I0(a/lambda_z) (m) under a sinusoidal motion.

        The law is convex: a slider shaken with the peak amplitude a = `amplitude` (m) under a
        constant mean load rides higher by this much, a^2/(4 lambda_z) for small a.
        """
        from scipy.special import ive

        beta = np.asarray(self._beta(amplitude))
        small = np.log1p(np.polyval(_I0_SERIES, np.minimum(beta, 1.0) ** 2 / 4))
        rise: Real = self.lambda_z * np.where(beta < 1, small, np.log(ive(0, beta)) + beta)[()]
        return rise

    @typed
    def closure_harmonics(
        self, epsilon: ArrayLike, count: Annotated[int, at_least(1)] = 4
    ) -> Float:
        """Harmonics (m) of the closure when the contacts' load is sinusoidal.

        For W = W0 (1 + eps cos wt) and rho = eps/(1 + sqrt(1 - eps^2)),
        h0 - h = -lambda_z ln(1 + rho^2) + sum_n c_n cos(n wt),
        c_n = 2 lambda_z (-1)^(n+1) rho^n/n; the linear law keeps only c_1 -> lambda_z eps.

        Parameters
        ----------
        epsilon : array
            Relative load modulation borne by the contacts, 0 <= eps < 1.
        count : int
            Number of harmonics.

        Returns
        -------
        array, shape (..., count)
            Signed peak amplitudes c_1 ... c_count (m).

        Raises
        ------
        InputError
            When eps is not in [0, 1).
        """
        eps = np.asarray(as_real("NormalContact.epsilon", epsilon, "dimensionless", "amplitude"))
        broadcast_shape("NormalContact.epsilon", eps, self.lambda_z)
        rho = (eps / (1 + np.sqrt((1 - eps) * (1 + eps))))[..., np.newaxis]
        order = np.arange(1, count + 1)
        length = np.asarray(self.lambda_z)[..., np.newaxis]
        return np.asarray(-2 * length * (-rho) ** order / order)

    def _beta(self, amplitude: ArrayLike) -> Real:
        a = as_real("NormalContact.amplitude", amplitude, "length", "not negative")
        broadcast_shape("NormalContact.amplitude", a, self.lambda_z)
        return a / self.lambda_z


def mindlin_length_ratio(nu: ArrayLike) -> Real:
    """Ratio lambda/lambda_z = (2 - nu)/(2 (1 - nu)) of elastic contacts that do not slip.

    Mindlin's tangential stiffness of one contact of radius a between like solids is 4 G a/(2 - nu),
    its normal stiffness 2 G a/(1 - nu): the quotient does not depend on a, hence holds for any
    population of contacts. It grows from 1 (nu = 0) to 1.5 (nu = 1/2). At the paper's nu = 0.44
    it is 1.39; the paper states 1.7, which this formula reaches for no admissible nu.

    Parameters
    ----------
    nu : array
        Poisson's ratio, 0 <= nu <= 1/2.

    Raises
    ------
    InputError
        When nu is outside that range.
    """
    ratio = np.asarray(as_real("material.nu", nu, "dimensionless", "not negative"))
    if (ratio > 0.5).any():
        worst = f"{float(ratio.max()):g}"
        raise InputError("material.nu", "be at most 0.5", worst, "give a ratio from 0 to 0.5")
    quotient: Real = ((2 - ratio) / (2 * (1 - ratio)))[()]
    return quotient


def normal_length(lambda_: ArrayLike, length_ratio: ArrayLike) -> Real:
    """Return lambda_z = lambda/length_ratio (m), the normal from the shear elastic length.

    Parameters
    ----------
    lambda_ : array
        Shear elastic length (m).
    length_ratio : array
        lambda/lambda_z: the paper's number is 1.7, the derived one `mindlin_length_ratio`.
    """
    shear = as_real("material.lambda_", lambda_, "length")
    ratio = as_real("material.length_ratio", length_ratio, "dimensionless")
    broadcast_shape("material.length_ratio", shear, ratio)
    return shear / ratio
