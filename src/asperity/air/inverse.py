"""The patch radius, or the gap, that gives a measured eps_eff/eps.

Eq. (40) of Bureau, Baumberger and Caroli (2000), solved for R or h0. Below the vacuum resonance the
fraction falls with R and rises with h0. Above it the stiffness of the layer may bring the slider
back to resonance, and then two radii give one fraction. The bracket is therefore divided at every
extremum, and each monotone part is searched.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.air.layer import AirLayer
from asperity.air.normal_contact import as_real
from asperity.air.transfer import effective_modulation
from asperity.arrays import Float
from asperity.errors import require
from asperity.parameters.arguments import broadcast_shape, typed

#: Points of the logarithmic scan. However sharp an extremum of the curve is, its flanks are
#: monotone over decades, so that a few points a decade reveal it.
_SCAN = 513
#: At a root the fraction must agree with the measured one to this relative accuracy: at a jump of
#: "free-molecular" the difference changes sign without a root.
_CLOSE = 1e-8


@dataclass(frozen=True)
class InverseResult:
    """Values that give the measured fraction, or the reason why there are none.

    Parameters
    ----------
    solutions : tuple of float
        All values (m) within the bracket, ascending; may be empty.
    reachable_min, reachable_max : float
        Smallest and largest eps_eff/eps within the bracket.
    result : str
        "found", or a sentence: which fractions can be reached, or between which values all give the
        measured one.
    """

    solutions: tuple[float, ...]
    reachable_min: float
    reachable_max: float
    result: str

    @property
    def found(self) -> bool:
        """Whether there is a solution."""
        return bool(self.solutions)


@typed
def patch_radius(
    ratio: ArrayLike,
    frequency: ArrayLike,
    *,
    W0: ArrayLike,
    M: ArrayLike,
    lambda_z: ArrayLike,
    layer: AirLayer,
    bracket: ArrayLike = (1e-5, 10.0),
) -> InverseResult:
    """Radii R (m) of the patch of contacts at which eps_eff/eps equals `ratio`.

    Parameters
    ----------
    ratio : float
        Measured eps_eff/eps (dimensionless).
    frequency : float
        Frequency of the modulation (Hz).
    W0, M, lambda_z : float
        Mean load (N), mass (kg), normal elastic length (m).
    layer : AirLayer
        Numbers, not arrays; its R is not used.
    bracket : (float, float)
        Smallest and largest radius to consider (m).

    Returns
    -------
    InverseResult
        A fraction that no radius gives is no error: `result` names the reachable range.

    Raises
    ------
    InputError
        When an argument is not one finite positive number, or the bracket is empty.
    """
    return _invert("R", ratio, frequency, (W0, M, lambda_z), layer, bracket)


@typed
def gap(
    ratio: ArrayLike,
    frequency: ArrayLike,
    *,
    W0: ArrayLike,
    M: ArrayLike,
    lambda_z: ArrayLike,
    layer: AirLayer,
    bracket: ArrayLike = (1e-8, 1e-2),
) -> InverseResult:
    """Gaps h0 (m) at which eps_eff/eps equals `ratio`.

    Parameters, result and errors as in `patch_radius`, with h0 in the place of R.
    """
    return _invert("h0", ratio, frequency, (W0, M, lambda_z), layer, bracket)


def _invert(
    field: str,
    ratio: ArrayLike,
    frequency: ArrayLike,
    machine: tuple[ArrayLike, ArrayLike, ArrayLike],
    layer: AirLayer,
    bracket: ArrayLike,
) -> InverseResult:
    """Solutions of the field of the layer; `machine` is W0, M and lambda_z."""
    W0, M, lambda_z = machine
    wanted = as_real("inverse.ratio", ratio, "dimensionless")
    frequency = as_real("inverse.frequency", frequency, "frequency", "not negative")
    shape = broadcast_shape("inverse", wanted, frequency, *machine, *vars(layer).values())
    advice = "call once for each measured fraction, as each may have several solutions"
    got = f"an array of shape {shape}"
    require(shape == (), "inverse.arguments", "be single numbers", got, advice)
    target = float(np.log(wanted))
    ends = np.asarray(as_real("inverse.bracket", bracket, "length"))
    rule, got, advice = "be two ascending lengths", f"{bracket!r} m", "swap or correct them"
    require(ends.shape == (2,) and ends[0] < ends[1], "inverse.bracket", rule, got, advice)

    def log_fractions(u: Any) -> Any:
        chosen: AirLayer = replace(layer, **{field: np.exp(u)})
        return np.log(effective_modulation(frequency, W0=W0, M=M, lambda_z=lambda_z, layer=chosen))

    def log_fraction(u: float) -> float:
        return float(log_fractions(u))

    u = np.linspace(np.log(ends[0]), np.log(ends[1]), _SCAN)
    scan = log_fractions(u)
    knots = [u[0], *_extrema(log_fraction, u, scan), u[-1]]
    flat = _flat(u, scan, target)
    roots = [
        root
        for root in _roots(log_fraction, np.array(knots), target)
        if not (flat and flat[0] <= root <= flat[1])
    ]
    values = np.exp(np.append(scan, [log_fraction(k) for k in knots]))
    lowest, highest = float(values.min()), float(values.max())
    result = tuple(float(np.exp(r)) for r in roots)
    text = "found"
    if flat:
        text = (
            f"every {field} from {np.exp(flat[0]):.3g} to {np.exp(flat[1]):.3g} m gives "
            f"eps_eff/eps = {wanted:g}, which does not determine it"
        )
    elif not result:
        text = (
            f"no {field} between {ends[0]:g} and {ends[1]:g} m gives eps_eff/eps = {wanted:g}; "
            f"there it ranges from {lowest:.6g} to {highest:.6g}"
        )
    return InverseResult(result, lowest, highest, text)


def _flat(u: Float, scan: Float, target: float) -> tuple[float, float] | None:
    """Ends of the scan's points that give the target to the last bits, if there are several.

    A layer without an effect has the fraction of the vacuum: one that "free-molecular" leaves
    without viscosity, or a patch so small that its stiffness is lost in round-off.
    """
    same = u[np.abs(scan - target) <= 2 * np.finfo(float).eps]
    return (float(same[0]), float(same[-1])) if len(same) > 1 else None


def _extrema(function: Callable[[float], float], u: Float, scan: Float) -> list[float]:
    """Abscissae of the interior extrema, each refined between the scan's points around it."""
    from scipy.optimize import minimize_scalar

    slope = np.diff(scan)
    (steps,) = np.nonzero(slope)
    result = []
    for left, right in pairwise(steps):
        if slope[left] * slope[right] < 0:
            sign = np.sign(slope[right])
            limits = (u[left], u[right + 1])
            best = minimize_scalar(
                lambda x, sign=sign: sign * function(x),
                bounds=limits,
                method="bounded",
                options={"xatol": 1e-12},
            )
            result.append(float(best.x))
    return result


def _roots(function: Callable[[float], float], knots: Float, target: float) -> list[float]:
    """One root for every monotone piece between `knots` that passes through `target`."""
    from scipy.optimize import brentq

    result: list[float] = []
    for low, high in pairwise(knots):
        if (function(low) - target) * (function(high) - target) > 0:
            continue
        root = float(brentq(lambda x: function(x) - target, low, high, xtol=1e-15))
        # A root at a knot is that of the pieces on both sides.
        if root not in result and abs(function(root) - target) < _CLOSE:
            result.append(root)
    return result
