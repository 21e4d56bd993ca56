"""Profile likelihood: chi-squared minimised over all other parameters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from asperity.inference.intervals import Interval, bounded_threshold
from asperity.inference.objective import Objective

Float = NDArray[np.float64]

#: Steps outwards, each twice as long as the last, before a side counts as without end.
_STEPS = 12
#: Accuracy of an end, in standard deviations.
_ACCURACY = 1e-2
#: Rise of chi-squared that stands for values without a periodic orbit.
_NO_ORBIT = 1e3


def profile_interval(
    objective: Objective, i: int, u: Float, chi2: float, covariance: Float, level: float
) -> tuple[Interval, tuple[Float, float]]:
    """Ends of the confidence interval of a coordinate, and the lowest point on the way.

    Parameters
    ----------
    objective : Objective
    i : int
        Which coordinate.
    u, chi2 : array, float
        The minimum.
    covariance : array, shape (n, n)
        Of the coordinates, by the normal approximation.
    level : float
        Coverage.

    Returns
    -------
    ends : (float, float)
        Infinite or the bound where the profile stays below the threshold.
    lowest : (array, float)
        Coordinates and chi-squared; below the minimum where that was not the lowest one.
    """
    low, high = objective.unknowns[i].bounds
    side = _Side(objective, i, u, chi2, covariance, level)
    ends = side.end(-1, low), side.end(1, high)
    return ends, min(side.path.values(), key=lambda point: point[1])


class _Side:
    """The profile of one coordinate, each point of it computed once."""

    def __init__(
        self, objective: Objective, i: int, u: Float, chi2: float, covariance: Float, level: float
    ) -> None:
        self.objective, self.i, self.u, self.chi2, self.level = objective, i, u, chi2, level
        # No farther at once than a factor of e, where the approximation may be worth nothing.
        self.sd = min(float(np.sqrt(covariance[i, i])), 1.0)
        self.along = covariance[:, i] / covariance[i, i]
        self.path = {float(u[i]): (u, chi2)}

    def end(self, sign: int, bound: float) -> float:
        """Where the profile passes the threshold on one side."""
        inner = float(self.u[self.i])
        width = 1.05 * self.sd * math.sqrt(bounded_threshold(math.inf, self.level))
        for _ in range(_STEPS):
            outer = inner + sign * width
            if sign * (outer - bound) >= 0:
                outer = bound - sign * 1e-9 * self.sd
                if self.excess(outer) <= 0:
                    return bound
            if self.excess(outer) > 0:
                return float(brentq(self.excess, inner, outer, xtol=_ACCURACY * self.sd))
            inner, width = outer, 2 * width
        return sign * math.inf

    def excess(self, x: float) -> float:
        """Root of the rise of chi-squared less that of its threshold: nearly linear in x."""
        if x not in self.path:
            nearest = min(self.path, key=lambda known: abs(known - x))
            begin = self.path[nearest][0] + self.along * (x - nearest)
            found, value = self.objective.minimise(begin, {self.i: x})
            if not math.isfinite(value):
                return math.sqrt(_NO_ORBIT)
            self.path[x] = found, value
        low, high = self.objective.unknowns[self.i].bounds
        limit = bounded_threshold(min(x - low, high - x) / self.sd, self.level)
        rise = max(self.path[x][1] - self.chi2, 0.0)
        return math.sqrt(rise) - math.sqrt(limit)
