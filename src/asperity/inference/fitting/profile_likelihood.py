"""Profile likelihood: chi-squared along one parameter, minimised over all others."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from asperity.arrays import Float
from asperity.inference.fitting.intervals import Interval, bounded_threshold
from asperity.inference.objective import Objective

#: Steps outwards after which a side counts as unbounded. Each may be twice as long as the last, up
#: to the second number, a factor of e^2: far beyond an end minimisations take seconds.
_STEPS, _LONGEST = 24, 2.0
#: Accuracy of an end, in standard deviations, or of the square root of chi-squared there.
_ACCURACY, _CLOSE = 1e-2, 2e-3
#: A minimisation ends at a relative change of the other coordinates, or if chi-squared is expected
#: to decrease by no more than the second number: its square root is then good to a thousandth.
_TOLERANCE, _NEGLIGIBLE = 1e-5, 1e-3
#: A profile that ends further below the threshold (standard deviations) was stopped by the method.
_JUMP = 0.1
#: If chi-squared rises by more (ten standard deviations) from one point of the profile to the next,
#: the minimisation has left a narrow valley; and largest number of halvings of the step then.
_LEAP, _HALVINGS = 100.0, 4
#: Rise of chi-squared that stands for values without a periodic orbit.
_NO_ORBIT = 1e3


class ProfileAtEdgeError(Exception):
    """A profile runs along the edge of the region in which the law has a solution."""


class Profile:
    """Profile of chi-squared along one coordinate, minimised over all others.

    Parameters
    ----------
    objective : Objective
    i : int
        Index of the coordinate.
    u, chi2 : array, float
        Coordinates and chi-squared of the minimum.
    covariance : array, shape (n, n)
        Covariance of the coordinates, by the normal approximation.
    search : bool
        Whether to search for orbits where the fast method fails. Without a search, an interval
        that reaches such values is open.
    most : float
        Largest number of evaluations without a solution during the search for orbits.

    Attributes
    ----------
    path : dict of float to (array, float)
        Coordinates and chi-squared of all points so far, by the value of the coordinate.
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
        self.whole, self.i, self.u, self.chi2 = objective, i, u, chi2
        self.search, self.most = search, most
        self._coarsen()
        # The approximation may fail further away.
        widest = objective.unknowns[i].widest(float(u[i]))
        self.sd = min(float(np.sqrt(covariance[i, i])), widest)
        self.along = covariance[:, i] / covariance[i, i]
        self.path = {float(u[i]): (u, chi2)}
        self._unsolved: set[float] = set()

    def _coarsen(self) -> None:
        # Errors of coarse orbits are far below the accuracy of an end.
        self.objective = self.whole.coarser(partly=False)
        self.last_unsolved = self.objective.unsolved + self.most

    @property
    def lowest(self) -> tuple[Float, float]:
        """Lowest point of the profile; lower than the given minimum if a better one exists."""
        return min(self.path.values(), key=lambda point: point[1])

    def interval(self, level: float, wider: float = 1.0) -> Interval:
        """Ends of the confidence interval of a coverage.

        An end is infinite, or the bound, where the profile stays below the threshold throughout
        the search range of a parameter: the data do not bound such a side.

        Parameters
        ----------
        level : float
            Coverage.
        wider : float
            Factor of the interval, for noise that is estimated from the data.

        Raises
        ------
        ProfileAtEdgeError
            If more evaluations than `most` had no solution.
        """
        return self._end(level, wider, -1), self._end(level, wider, 1)

    def _end(self, level: float, wider: float, sign: int) -> float:
        """The value at which the profile crosses the threshold on one side."""
        unknown, begin = self.objective.unknowns[self.i], float(self.u[self.i])
        bound = farthest = unknown.bounds[sign > 0]
        if not unknown.nuisance:
            farthest = unknown.range_about(begin, self.sd)[sign > 0]
            farthest = sign * max(sign * farthest, sign * begin)

        def excess(x: float) -> float:
            value = self._excess(x, level, wider)
            return 0.0 if abs(value) < _CLOSE else value

        width = 1.05 * wider * self.sd * math.sqrt(bounded_threshold(math.inf, level))
        for _ in range(_STEPS):
            inner, outer = self._bracket(excess, sign, width)
            if sign * (outer - farthest) >= 0:
                outer = farthest - sign * 1e-9 * self.sd
                if excess(outer) <= 0:
                    return bound
            if excess(outer) >= 0:
                end = float(brentq(excess, inner, outer, xtol=_ACCURACY * self.sd))
                within = [x for x in self.path if sign * (end - x) >= 0]
                last = max(within, key=lambda x: sign * x)
                if excess(last) < -_JUMP and not self.objective.searches:
                    # The fast method fails beyond this value; this is no statement about the data.
                    if not self.search:
                        return sign * math.inf
                    self.whole.use_search(True)
                    self._coarsen()
                    self._unsolved.clear()
                    return self._end(level, wider, sign)
                return end
            width = max(width, min(2 * width, _LONGEST))
        return sign * math.inf

    def _bracket(
        self, excess: Callable[[float], float], sign: int, width: float
    ) -> tuple[float, float]:
        """The last known point within the threshold on one side, and one farther out.

        The second is the next known point. Without one it is where the line through the last points
        crosses the threshold, and a quarter beyond, but at most `width` away.
        """
        begin = float(self.u[self.i])
        known = sorted((x for x in self.path if sign * (x - begin) >= 0), key=lambda x: sign * x)
        within = list(itertools.takewhile(lambda x: excess(x) < 0, known))
        inner = within[-1]
        if len(within) < len(known):
            return inner, known[len(within)]
        before = [x for x in within if abs(inner - x) > _ACCURACY * self.sd]
        if before:
            rate = (excess(inner) - excess(before[-1])) / abs(inner - before[-1])
            if rate > 0:
                width = min(width, -1.25 * excess(inner) / rate)
        return inner, inner + sign * width

    def _excess(self, x: float, level: float, wider: float) -> float:
        """Square root of the rise of chi-squared less that of the threshold: nearly linear in x."""
        if x not in self.path and (x in self._unsolved or not self._minimise_at(x, _HALVINGS)):
            self._unsolved.add(x)
            return math.sqrt(_NO_ORBIT)
        low, high = self.objective.unknowns[self.i].bounds
        distance = min(x - low, high - x) / (wider * self.sd)
        limit = wider**2 * bounded_threshold(distance, level)
        rise = max(self.path[x][1] - self.chi2, 0.0)
        return math.sqrt(rise) - math.sqrt(limit)

    def _minimise_at(self, x: float, halvings: int) -> bool:
        """Minimise over all other coordinates at x; whether this succeeded."""
        nearest = min(self.path, key=lambda known: abs(known - x))
        for begin in (self._start(x), self.path[nearest][0]):
            if self.objective.searches and self.objective.unsolved > self.last_unsolved:
                raise ProfileAtEdgeError
            result, value = self.objective.minimise(
                begin, {self.i: x}, tolerance=_TOLERANCE, negligible=_NEGLIGIBLE
            )
            if math.isfinite(value):
                break
        far = not value < self.path[nearest][1] + _LEAP
        if self.objective.curved and halvings and far:
            # Outside a narrow valley a minimisation may end anywhere: go to x in smaller steps.
            if self._minimise_at((x + nearest) / 2, halvings - 1):
                return self._minimise_at(x, halvings - 1)
            return False
        if math.isfinite(value):
            self.path[x] = result, value
        return math.isfinite(value)

    def _start(self, x: float) -> Float:
        """Initial guess at x: on the line through the two nearest points, or by the covariance.

        A coordinate that would change by more than `_LONGEST` stays: the line says nothing about
        what the data do not determine.
        """
        first, *others = sorted(self.path, key=lambda known: abs(known - x))
        begin = self.path[first][0]
        second = next((other for other in others if abs(other - first) > _ACCURACY * self.sd), None)
        slope = self.along
        if second is not None:
            slope = (begin - self.path[second][0]) / (first - second)
        change = slope * (x - first)
        return begin + np.where(np.abs(change) > _LONGEST, 0.0, change)
