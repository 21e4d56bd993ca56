"""Profile likelihood: chi-squared minimised over all other parameters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from asperity.inference.fitting.intervals import Interval, bounded_threshold
from asperity.inference.objective import Objective

Float = NDArray[np.float64]

#: Steps outwards, each twice as long as the last, before a side counts as without end.
_STEPS = 12
#: Accuracy of an end, in standard deviations.
_ACCURACY = 1e-2
#: Relative change of the other coordinates that ends a minimisation: chi-squared is good to 1e-4.
_TOLERANCE = 1e-5
#: Standard deviations below the threshold at which a profile that ends has an edge, not an end.
_JUMP = 0.1
#: Rise of chi-squared that stands for values without a periodic orbit.
_NO_ORBIT = 1e3


class ProfileAtEdgeError(Exception):
    """A profile runs along the edge of the region in which the data have a prediction."""


class Profile:
    """chi-squared along one coordinate, minimised over the others; each point is computed once.

    Parameters
    ----------
    objective : Objective
    i : int
        Which coordinate.
    u, chi2 : array, float
        The minimum.
    covariance : array, shape (n, n)
        Of the coordinates, by the normal approximation.
    search : bool
        Whether orbits are searched for where the fast method ends; without, an interval that gets
        there is open.
    most : float
        Evaluations without a solution, at most, where orbits are searched for.
    """

    def __init__(
        self,
        objective: Objective,
        i: int,
        u: Float,
        chi2: float,
        covariance: Float,
        *,
        search: bool,
        most: float = math.inf,
    ) -> None:
        self.objective, self.i, self.u, self.chi2 = objective, i, u, chi2
        self.search = search
        self.most = objective.unsolved + most
        # No farther at once than a factor of e, where the approximation may be worth nothing.
        self.sd = min(float(np.sqrt(covariance[i, i])), 1.0)
        self.along = covariance[:, i] / covariance[i, i]
        self.path = {float(u[i]): (u, chi2)}

    @property
    def lowest(self) -> tuple[Float, float]:
        """Lowest point on the way; below the minimum where that was not the lowest one."""
        return min(self.path.values(), key=lambda point: point[1])

    def interval(self, level: float, wider: float = 1.0) -> Interval:
        """Ends of the confidence interval of a coverage.

        An end is infinite, or the bound, where the profile stays below the threshold.

        Parameters
        ----------
        level : float
            Coverage.
        wider : float
            Factor of the interval, for uncertainties that are estimated themselves.

        Raises
        ------
        ProfileAtEdgeError
            If more evaluations than `most` had no solution.
        """
        low, high = self.objective.unknowns[self.i].bounds
        return self._end(level, wider, -1, low), self._end(level, wider, 1, high)

    def _end(self, level: float, wider: float, sign: int, bound: float) -> float:
        """Where the profile passes the threshold on one side."""

        def excess(x: float) -> float:
            return self._excess(x, level, wider)

        inner = float(self.u[self.i])
        width = 1.05 * wider * self.sd * math.sqrt(bounded_threshold(math.inf, level))
        for _ in range(_STEPS):
            outer = inner + sign * width
            if sign * (outer - bound) >= 0:
                outer = bound - sign * 1e-9 * self.sd
                if excess(outer) <= 0:
                    return bound
            if excess(outer) > 0:
                end = float(brentq(excess, inner, outer, xtol=_ACCURACY * self.sd))
                within = [x for x in self.path if sign * (end - x) >= 0]
                last = max(within, key=lambda x: sign * x)
                if excess(last) < -_JUMP and not self.objective.searches:
                    # The fast method has no orbit beyond, which says nothing about the data.
                    if not self.search:
                        return sign * math.inf
                    self.objective.use_search(True)
                    return self._end(level, wider, sign, bound)
                return end
            inner, width = outer, 2 * width
        return sign * math.inf

    def _excess(self, x: float, level: float, wider: float) -> float:
        """Root of the rise of chi-squared less that of its threshold: nearly linear in x."""
        if x not in self.path:
            nearest = min(self.path, key=lambda known: abs(known - x))
            for begin in (self._start(x), self.path[nearest][0]):
                if self.objective.searches and self.objective.unsolved > self.most:
                    raise ProfileAtEdgeError
                found, value = self.objective.minimise(begin, {self.i: x}, tolerance=_TOLERANCE)
                if math.isfinite(value):
                    break
            else:
                return math.sqrt(_NO_ORBIT)
            self.path[x] = found, value
        low, high = self.objective.unknowns[self.i].bounds
        distance = min(x - low, high - x) / (wider * self.sd)
        limit = wider**2 * bounded_threshold(distance, level)
        rise = max(self.path[x][1] - self.chi2, 0.0)
        return math.sqrt(rise) - math.sqrt(limit)

    def _start(self, x: float) -> Float:
        """The others on the line through the nearest points known, or by the approximation."""
        first, *others = sorted(self.path, key=lambda known: abs(known - x))
        begin = self.path[first][0]
        second = next((other for other in others if abs(other - first) > _ACCURACY * self.sd), None)
        if second is None:
            return begin + self.along * (x - first)
        return begin + (begin - self.path[second][0]) * ((x - first) / (first - second))
