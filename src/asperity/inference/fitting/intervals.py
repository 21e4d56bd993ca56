"""Confidence intervals of an estimate near a bound, by the method of Feldman and Cousins.

Near a bound, intervals by the usual thresholds of the likelihood ratio have the wrong coverage. The
thresholds of Feldman and Cousins (Phys. Rev. D 57, 3873, 1998) have the right coverage, and lead
from a two-sided interval to an upper limit without a decision by the user.
"""

from __future__ import annotations

import math

from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from asperity.parameters.arguments import typed

Interval = tuple[float, float]

#: Coverage of the intervals of a fit: one standard deviation of a normal estimate, and 95 %.
LEVELS = (math.erf(1 / math.sqrt(2)), 0.95)
#: Standard deviations beyond which a bound has no influence.
_FAR = 8.0


def bounded_threshold(distance: float, level: float) -> float:
    """Largest -2 ln of the likelihood ratio that an interval contains.

    Parameters
    ----------
    distance : float
        Distance of the tested value from the bound, in standard deviations.
    level : float
        Coverage, in (0, 1).

    Notes
    -----
    For an estimate x that is normal about mu >= 0 with unit variance, the ratio to the best
    allowed value is (x - mu)^2 where x >= 0 and mu^2 - 2 x mu elsewhere.
    """
    far = float(ndtri((1 - level) / 2)) ** 2
    if distance > _FAR:
        return far
    if distance <= 0:
        # At the bound every negative estimate, half of all estimates, has the ratio 0.
        return float(ndtri(1 - level)) ** 2 if level > 0.5 else 0.0

    def covered(threshold: float) -> float:
        root = math.sqrt(threshold)
        lowest = distance - root
        if lowest < 0:
            lowest = (distance**2 - threshold) / (2 * distance)
        return float(ndtr(root) - ndtr(lowest - distance)) - level

    return float(brentq(covered, 0.0, far + 1e-9, xtol=1e-12)) if covered(far) > 0 else far


@typed
def bounded_interval(
    estimate: float, sd: float, level: float, lower: float, upper: float
) -> Interval:
    """Interval of a normal estimate with a bound on one side or on both.

    Parameters
    ----------
    estimate : float
        The estimate without bounds; it may lie beyond a bound.
    sd : float
        Standard deviation of the estimate.
    level : float
        Coverage.
    lower, upper : float
        Bounds; infinite if there is none. Each bound is treated alone; if both are closer than the
        width of the interval, the interval is the whole range.

    Returns
    -------
    (float, float)
    """
    root = -float(ndtri((1 - level) / 2))
    if upper - lower < 2 * root * sd:
        return lower, upper
    low, high = estimate - root * sd, estimate + root * sd
    if (estimate - lower) < _FAR * sd:
        low, high = _interval_above(estimate, sd, level, lower)
    if (upper - estimate) < _FAR * sd:
        mirrored = _interval_above(-estimate, sd, level, -upper)
        high = -mirrored[0]
        low = max(low, -mirrored[1]) if (estimate - lower) < _FAR * sd else -mirrored[1]
    return max(low, lower), min(high, upper)


def _interval_above(estimate: float, sd: float, level: float, bound: float) -> Interval:
    """Interval of a normal estimate with a lower bound."""
    x = (estimate - bound) / sd

    def inside(mu: float) -> float:
        ratio = (x - mu) ** 2 if x >= 0 else mu**2 - 2 * x * mu
        return bounded_threshold(mu, level) - ratio

    best = max(x, 0.0)
    far = best + 12.0
    high = float(brentq(inside, best, far)) if inside(best) > 0 else best
    low = 0.0 if inside(0.0) >= 0 else float(brentq(inside, 0.0, best))
    return bound + sd * low, bound + sd * high
