"""Confidence intervals: by the parabola about a minimum, at a bound, and by profile likelihood.

Near a bound, intervals by the usual thresholds of the likelihood ratio have the wrong coverage. The
thresholds of Feldman and Cousins (Phys. Rev. D 57, 3873, 1998) have the right coverage, and lead
from a two-sided interval to an upper limit without a decision by the user.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtrc, ndtr, ndtri

from asperity.arrays import Bool, Float
from asperity.inference.objective import Objective, Residuals
from asperity.inference.tables.residuals import leverages
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


#: A logarithmic coordinate with a larger standard deviation (a factor of e) is not determined.
UNDETERMINED = 1.0
#: A delay that is closer to its bound than this share of its range is at the bound.
_AT_BOUND = 1e-3
#: A coordinate closer to a bound than this many standard deviations is stopped by the bound.
_NEAR_BOUND = 0.1
#: If chi-squared can still decrease by more (a third of a standard error), the point is no minimum.
_STOPPED = 0.1


@dataclass(frozen=True)
class Parabola:
    """The quadratic approximation of chi-squared about a minimum.

    Attributes
    ----------
    u : array, shape (n,)
        Coordinates of the minimum.
    chi2 : float
        Chi-squared at the minimum.
    data : tuple of Residuals
        Residuals of each term.
    covariance : array, shape (n, n)
        Covariance of the coordinates if the noise is known.
    missing : bool array, shape (n,)
        Coordinates on which neither data nor priors have any information.
    total : array, shape (n, n)
        Covariance of the coordinates, including the uncertainty of noise that is estimated from
        the same data.
    freedom : array, shape (n,)
        Degrees of freedom of the diagonal of `total`.
    unbounded : array, shape (n,)
        Minimum of the parabola without the bounds that stop coordinates.
    undetermined : tuple of str
        Parameters that the data do not determine.
    stopped : bool
        Whether chi-squared still falls towards values at which the law has no orbit.
    fitted : float
        Number of parameters, including those of the noise, that the data determine: the trace of
        I (I + P)^-1, with the information I of the data and P of the priors.
    priors : int
        Number of priors.
    judging : float
        Chi-squared of the data with given uncertainties and of priors; of all data if all noise is
        estimated.
    dof : int
        Degrees of freedom of `judging`.
    """

    u: Float
    chi2: float
    data: tuple[Residuals, ...]
    covariance: Float
    missing: Bool
    total: Float
    freedom: Float
    unbounded: Float
    undetermined: tuple[str, ...]
    stopped: bool
    fitted: float
    priors: int
    judging: float
    dof: int

    @property
    def sd(self) -> Float:
        """Standard deviations of the coordinates under known noise."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def se(self) -> Float:
        """Standard errors of the coordinates, including the uncertainty of estimated noise."""
        return np.asarray(np.sqrt(np.diag(self.total)))

    @property
    def readings(self) -> int:
        """Number of data."""
        return sum(d.values.size for d in self.data)

    @property
    def p_value(self) -> float:
        """Probability of as large a chi-squared by chance; NaN without degrees of freedom."""
        return float(chdtrc(self.dof, self.judging)) if self.dof > 0 else math.nan


def parabola_of(objective: Objective, u: Float, chi2: float) -> Parabola | None:
    """The parabola at a minimum; None if the law has no solution at the minimum."""
    r, J = objective.residuals(u)
    data = objective.data_residuals(u)
    if data is None:
        return None
    # A delay at its bound, which the segments of the drive set, counts as known.
    J = np.where(_known_at_bound(objective, u), 0.0, J)
    covariance, missing = inverse_information(J.T @ J)
    total, freedom = _with_estimated_noise(objective, u, covariance, missing)
    of_data = np.sum([d.jacobian.T @ d.jacobian for d in data], axis=0)
    # Priors of nuisance parameters describe the instrument, and count as data.
    prior_slopes = objective.prior_residuals(u)[1]
    with_prior = [v for v in objective.unknowns if v.prior is not None]
    nuisance = [v.nuisance for v in with_prior]
    informed = inverse_information(of_data + prior_slopes[nuisance].T @ prior_slopes[nuisance])[0]
    undetermined = tuple(
        unknown.name
        for i, unknown in enumerate(objective.unknowns)
        if not unknown.nuisance
        and (missing[i] or math.sqrt(max(informed[i, i], 0.0)) > unknown.widest(u[i]))
    )
    parameters = len(objective.unknowns) + sum(term.profiled for term in objective.terms)
    judging, dof = chi2, r.size - parameters
    given = [term.profiled == 0 for term in objective.terms]
    if any(given) and not all(given):
        # Innovations have unit variance by their estimated noise, and would hide a misfit.
        of_data = np.repeat(given, [d.values.size for d in data])
        judges = np.concatenate([of_data, ~np.array(nuisance, bool)])
        judging = float(np.sum(r[judges] ** 2))
        dof = round(float(np.sum(1 - leverages(J[judges], J.T @ J))))
    return Parabola(
        u=u,
        chi2=chi2,
        data=tuple(data),
        covariance=covariance,
        missing=missing,
        total=total,
        freedom=freedom,
        unbounded=u - covariance @ _gradient_at_bounds(objective, u, covariance, J.T @ r),
        undetermined=undetermined,
        stopped=objective.noise_is_known and objective.expected_decrease(u) > _STOPPED,
        fitted=parameters - float(leverages(J[r.size - len(with_prior) :], J.T @ J).sum()),
        priors=len(with_prior),
        judging=judging,
        dof=dof,
    )


def _known_at_bound(objective: Objective, u: Float) -> Bool:
    """Delays and offsets at a bound: other parameters do not depend on a value beyond the bound.

    A stiffness at its bound is not among them, because the data bound it on the other side.
    """
    low, high = objective.bounds
    linear = np.array([k.nuisance and not k.logarithmic for k in objective.unknowns], bool)
    room = np.where(np.isfinite(high - low), high - low, 1.0)
    return np.asarray(linear & (np.minimum(u - low, high - u) < _AT_BOUND * room))


def _gradient_at_bounds(
    objective: Objective, u: Float, covariance: Float, gradient: Float
) -> Float:
    """The gradient of coordinates that a bound stops; 0 for all other coordinates.

    The gradient of other coordinates is zero at the exact minimum. In a nearly flat valley a
    minimisation leaves a small gradient, which says nothing about the position of the minimum.
    """
    low, high = objective.bounds
    sd = np.sqrt(np.diag(covariance))
    at_low = (gradient > 0) & (u - low < _NEAR_BOUND * sd)
    at_high = (gradient < 0) & (high - u < _NEAR_BOUND * sd)
    return np.where(at_low | at_high, gradient, 0.0)


def _with_estimated_noise(
    objective: Objective, u: Float, covariance: Float, missing: Bool
) -> tuple[Float, Float]:
    """The covariance including the uncertainty of estimated noise, and its degrees of freedom."""
    known = np.where(missing[:, None] | missing, 0.0, covariance)
    values = objective.named(u)
    slopes = np.array([float(k.slope(values[k.name])) for k in objective.unknowns])
    total, variance = covariance.copy(), np.zeros(u.size)
    for term in objective.terms:
        added, spread = term.uncertainty_of_noise(values, slopes, known)
        total += nowhere_negative(added, known)
        variance += spread
    freedom = 2 * np.diag(known) ** 2 / np.where(variance > 0, variance, 1.0)
    return total, np.where(variance > 0, np.maximum(freedom, 1.0), np.inf)


def nowhere_negative(added: Float, covariance: Float) -> Float:
    """An addition to a covariance, without eigenvalues that are negative by rounding.

    If the data hardly tell parameters apart, the addition is a small difference of large numbers.
    """
    sd = np.sqrt(np.where(np.diag(covariance) > 0, np.diag(covariance), 1.0))
    values, vectors = np.linalg.eigh(added / np.outer(sd, sd))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(sd, sd))


def inverse_information(information: Float) -> tuple[Float, Bool]:
    """Inverse of an information matrix, and a mask of coordinates without information."""
    if not information.size:
        return information, np.zeros(0, bool)
    scale = np.sqrt(np.diag(information))
    blind = ~(scale > 0)
    scale = np.where(blind, 1.0, scale)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    null = values < 1e-13 * max(values.max(), 1.0)
    loose = (np.abs(vectors[:, null]) > 1e-3).any(1) | blind
    inverse = (vectors / np.where(null, np.inf, values)) @ vectors.T
    covariance = inverse / np.outer(scale, scale)
    return covariance + np.diag(np.where(loose, 1e12, 0.0)), loose


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
