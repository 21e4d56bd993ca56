"""Points that exclude a law: chi-squared of the rival, refitted, is as large as it can be.

With the rival's predictions made linear at its last fit, the optimal shares are a concave problem.
The rival is then refitted at these shares, and the shares are accepted as far as its chi-squared
really grows. The general equivalence theorem at the last fit bounds what a better design could
reach (Atkinson and Fedorov, 1975), whatever the way to it. How probably the readings exclude the
rival follows from the linear predictions of both laws.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Float
from asperity.inference.comparison.evidence import EXCLUDED
from asperity.inference.design.candidates import differences, predicted, with_readings
from asperity.inference.design.plan import DesignPlan, expected_values
from asperity.inference.design.shares import Misfit, Shares, optimal_shares, whole_readings
from asperity.inference.objective import Minimum, Objective
from asperity.inference.tables.table import LockInTable

_ROUNDS = 15
#: Efficiency at which the search ends.
_ENOUGH = 0.99
#: Parts of the way to the proposed shares that are tried.
_PARTS = (1.0, 0.5, 0.25, 0.1)
_NEGLIGIBLE = 1e-4
#: Rounds of exchanges of whole readings, each at the rival's last fit.
_EXCHANGES = 4
#: Synthetic sets of readings, linear in the parameters, for the probability of deciding.
_DRAWS = 20_000


class Separation(NamedTuple):
    """Shares of the budget, the whole readings, and the rival that comes nearest to them.

    Attributes
    ----------
    shares : Shares
    readings : int array, shape (candidates,)
    chi2, chi2_shares : float
        Of the rival refitted to the expected readings, for whole readings and for the shares.
    u : array, shape (p,)
        Coordinates of the rival there.
    criterion : Misfit
        At that fit.
    unseen : int
        Candidates at which the rival had no response in the end, so that they were not judged.
    """

    shares: Shares
    readings: NDArray[np.int64]
    chi2: float
    chi2_shares: float
    u: Float
    criterion: Misfit
    unseen: int


class RivalFit:
    """Refits of the rival to expected readings at candidates.

    Parameters
    ----------
    plan : DesignPlan
    rival : Objective
    points : mapping of str to array, shape (candidates,)
    expected : LockInTable
        Readings at all candidates by the other law.
    """

    def __init__(
        self,
        plan: DesignPlan,
        rival: Objective,
        points: Mapping[str, Float],
        expected: LockInTable,
    ) -> None:
        self.plan, self.rival, self.points, self.expected = plan, rival, points, expected
        self.start = rival.coordinates(expected_values(rival))

    def to(self, n: Float) -> Objective:
        """The rival with n readings of each candidate."""
        return with_readings(self.plan, self.rival, self.expected.without(n <= 0), n[n > 0])

    def fitted(self, n: Float, *starts: Float) -> Minimum:
        """The best of the fits to n readings of each candidate, from several starts."""
        objective = self.to(n)
        return min((objective.minimise(u) for u in (*starts, self.start)), key=lambda m: m.chi2)

    def criterion(self, u: Float) -> tuple[Misfit, Bool]:
        """Misfit linear at the coordinates u, and the candidates at which there is a response."""
        values = self.rival.named(u)
        at = predicted(self.plan, self.rival, self.points, values)
        residual, jacobian = differences(self.rival, self.expected, at, values)
        # A point without a response is not judged: it tells nothing.
        residual = np.where(at.seen[:, None], residual, 0.0)
        return Misfit(residual, jacobian, *self.rival.prior_residuals(u)), at.seen


def separation(
    fits: RivalFit, cost: Float, total: float, progress: Callable[[int, int, str], None]
) -> Separation:
    """Shares and whole readings at which the refitted rival's chi-squared is largest.

    Parameters
    ----------
    fits : RivalFit
    cost : array, shape (candidates,)
        Of a reading.
    total : float
        Budget.
    progress : callable
    """
    readings = total / cost
    criterion, _ = fits.criterion(fits.start)
    shares = _cleaned(optimal_shares(criterion, readings).shares)
    best, efficiency = fits.fitted(shares * readings), 0.0
    for round_ in range(_ROUNDS):
        progress(round_, _ROUNDS, "refits of the rival")
        criterion, _ = fits.criterion(best.u)
        slope = criterion.gradient(shares * readings) * readings
        gap = float(slope.max() - shares @ slope)
        efficiency = criterion.least_efficiency(gap, best.chi2)
        if efficiency >= _ENOUGH:
            break
        mixed = 0.9 * shares + 0.1 / shares.size
        proposed = _cleaned(optimal_shares(criterion, readings, start=mixed).shares)
        for part in _PARTS:
            tried = _cleaned((1 - part) * shares + part * proposed)
            result = fits.fitted(tried * readings, best.u)
            if result.chi2 > best.chi2 * (1 + 1e-6):
                shares, best = tried, result
                break
        else:
            break
    n = whole_readings(criterion, cost, total, shares)
    fitted = fits.fitted(n.astype(float), best.u)
    for _ in range(_EXCHANGES):
        progress(_ROUNDS, _ROUNDS, "whole readings")
        linear, _ = fits.criterion(fitted.u)
        changed = whole_readings(linear, cost, total, n * cost / total)
        again = fits.fitted(changed.astype(float), fitted.u)
        if again.chi2 <= fitted.chi2 * (1 + 1e-6):
            break
        n, fitted = changed, again
    last, seen = fits.criterion(fitted.u)
    shared = Shares(shares, efficiency)
    return Separation(shared, n, fitted.chi2, best.chi2, fitted.u, last, int((~seen).sum()))


def _cleaned(shares: Float) -> Float:
    kept = np.where(shares > _NEGLIGIBLE, shares, 0.0)
    return np.asarray(kept / kept.sum())


def probability_of_deciding(jacobian: Float, rival: Misfit, readings: Float, seed: int) -> float:
    """Probability that the rival's AICc exceeds that of the true law enough to exclude it.

    Both laws are linear in their parameters about their fits to the expected readings, so that the
    difference of the two chi-squared follows from normal noise by projections.

    Parameters
    ----------
    jacobian : array, shape (candidates, m, p)
        Of the true law, in standard uncertainties of a reading.
    rival : Misfit
        At its fit to the expected readings.
    readings : array, shape (candidates,)
    seed : int
    """
    rows = np.flatnonzero(readings > 0)
    root = np.sqrt(readings[rows])[:, None]
    apart = (rival.residual[rows] * root).ravel()
    data = round(float(readings[rows].sum())) * rival.residual.shape[1]
    q = rival.prior_residual.size
    own = (jacobian[rows] * root[..., None]).reshape(apart.size, -1)
    theirs = (rival.jacobian[rows] * root[..., None]).reshape(apart.size, -1)
    apart = np.concatenate([apart, rival.prior_residual])
    own = np.vstack([own, np.zeros((q, own.shape[1]))])
    theirs = np.vstack([theirs, rival.prior_jacobian])
    noise = np.random.default_rng(seed).normal(size=(_DRAWS, apart.size))
    noise[:, apart.size - q :] = 0.0
    difference = _outside(theirs, apart - noise) - _outside(own, noise)
    behind = difference + penalty(theirs.shape[1], data) - penalty(own.shape[1], data)
    return float((behind >= EXCLUDED).mean())


def penalty(parameters: int, data: float) -> float:
    """What AICc adds to the deviance; infinite where the data are too few."""
    if data <= parameters + 1:
        return np.inf
    return 2 * parameters + 2 * parameters * (parameters + 1) / (data - parameters - 1)


def _outside(jacobian: Float, vectors: Float) -> Float:
    """Square of what a fit leaves of each vector."""
    u, s, _ = np.linalg.svd(jacobian, full_matrices=False)
    basis = u[:, s > 1e-12 * max(float(s.max(initial=0.0)), 1e-300)]
    inside = vectors @ basis
    return np.asarray((vectors**2).sum(1) - (inside**2).sum(1))
