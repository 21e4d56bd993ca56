"""Points that exclude a law: chi-squared of the rival, refitted, is as large as it can be.

With the rival's predictions made linear at its last fit, the optimal shares are a concave problem.
The rival is then refitted at these shares, and the shares are accepted as far as its chi-squared
really grows. The general equivalence theorem at the last fit bounds what a better design could
reach (Atkinson and Fedorov, 1975), whatever the way to it. How probably the readings exclude the
rival follows from the linear predictions of both laws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.inference.comparison.scale import EXCLUDED
from asperity.inference.design.candidates import Candidates
from asperity.inference.design.plan import DesignPlan, Hypothesis
from asperity.inference.design.predictions import (
    PointModel,
    Refitted,
    Whitened,
    prior_terms,
    refit,
    repeated,
)
from asperity.inference.design.shares import Misfit, Shares, optimal_shares, whole_readings
from asperity.inference.tables.table import LockInTable
from asperity.inference.tables.term import on_contacts
from asperity.orbit import Outcome, response_function

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]

_ROUNDS = 15
#: Efficiency at which the search ends.
_ENOUGH = 0.99
#: Parts of the way to the proposed shares that are tried.
_PARTS = (1.0, 0.5, 0.25, 0.1)
_NEGLIGIBLE = 1e-4
#: Rounds of exchanges of whole readings, each at the rival's last fit.
_EXCHANGES = 4


@dataclass(frozen=True, eq=False)
class Separation:
    """Shares of the budget, the whole readings, and the rival that comes nearest to them.

    Attributes
    ----------
    shares : Shares
    readings : int array, shape (candidates,)
    chi2, chi2_shares : float
        Of the rival refitted to the expected readings, for whole readings and for the shares.
    values : mapping of str to float
        Its parameters there.
    criterion : Misfit
        At that fit.
    unseen : int
        Candidates at which the rival had no response in the end, so that they were not judged.
    """

    shares: Shares
    readings: NDArray[np.int64]
    chi2: float
    chi2_shares: float
    values: dict[str, float]
    criterion: Misfit
    unseen: int


class RivalFit:
    """Refits of the rival to expected readings at candidates.

    Parameters
    ----------
    plan : DesignPlan
    rival : Hypothesis
    candidates : Candidates
    expected : LockInTable
        Readings at all candidates by the other law.
    """

    def __init__(
        self, plan: DesignPlan, rival: Hypothesis, candidates: Candidates, expected: LockInTable
    ) -> None:
        self.plan, self.rival, self.expected = plan, rival, expected
        self.points = dict(candidates.points)
        self.slow = candidates.slow | _slow(plan, rival, candidates)

    def at(self, rows: NDArray[np.intp]) -> tuple[PointModel, LockInTable]:
        """Model and readings at some candidates."""
        keep = np.zeros(len(self.slow), bool)
        keep[rows] = True
        some = {n: v[keep] for n, v in self.points.items()}
        model = PointModel(self.plan, self.rival, some, self.slow[keep])
        return model, self.expected.without(~keep)

    def everywhere(self, u: Float) -> Whitened:
        """Differences at all candidates with the coordinates u."""
        model = PointModel(self.plan, self.rival, self.points, self.slow)
        values = {k.name: k.to_value(x) for k, x in zip(self.rival.unknowns, u, strict=True)}
        return model.whitened(self.expected, values)

    def fitted(self, n: Float, starts: Float) -> Refitted:
        """The best of the fits from several starts, as one set."""
        rows = np.flatnonzero(n > 0)
        model, expected = self.at(rows)
        result = refit(model, repeated(expected, len(starts)), n[rows], starts)
        k = [int(np.argmin(result.chi2))]
        return Refitted(result.coordinates[k], result.chi2[k], result.converged[k])

    def criterion(self, u: Float) -> tuple[Misfit, Bool]:
        """Misfit linear at the coordinates u, and the candidates at which there is a response."""
        result = self.everywhere(u)
        seen = np.asarray(np.isfinite(result.values).all(axis=-1))
        prior, slopes = prior_terms(self.rival, u[None])
        blank = np.where(seen[:, None], result.values, 0.0)
        jacobian = np.where(seen[:, None, None], result.jacobian, 0.0)
        return Misfit(blank, jacobian, prior[0], slopes[0]), seen


def _slow(plan: DesignPlan, rival: Hypothesis, candidates: Candidates) -> Bool:
    """Candidates at which the fast method does not solve the rival, with its expected values."""
    if plan.inertia or plan.radiation_damping:
        return np.ones(candidates.size, bool)
    quick = response_function(rival.law, search=False)
    given = on_contacts({**rival.fixed, **candidates.points, **rival.values})
    outcome = quick({n: given[n] for n in quick.parameters}).outcome
    return np.asarray(outcome) != Outcome.CONVERGED


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
    u = fits.rival.coordinates
    nominal = u
    criterion, seen = fits.criterion(u)
    shares = np.full(criterion.size, 1 / criterion.size)
    shares = optimal_shares(criterion, readings).shares
    best = fits.fitted(_cleaned(shares) * readings, np.array([u]))
    shares, efficiency = _cleaned(shares), 0.0
    for round_ in range(_ROUNDS):
        progress(round_, _ROUNDS, "refits of the rival")
        u, chi2 = best.coordinates[0], float(best.chi2[0])
        criterion, seen = fits.criterion(u)
        slope = criterion.gradient(shares * readings) * readings
        gap = float(slope.max() - shares @ slope)
        efficiency = criterion.least_efficiency(gap, chi2)
        if efficiency >= _ENOUGH:
            break
        proposed = _cleaned(optimal_shares(criterion, readings, start=_mixed(shares)).shares)
        for part in _PARTS:
            tried = _cleaned((1 - part) * shares + part * proposed)
            result = fits.fitted(tried * readings, np.array([u, nominal]))
            if result.chi2[0] > chi2 * (1 + 1e-6):
                shares, best = tried, result
                break
        else:
            break
    chi2_shares = float(best.chi2[0])
    n = whole_readings(criterion, cost, total, shares)
    fitted = fits.fitted(n.astype(float), np.array([best.coordinates[0], nominal]))
    for _ in range(_EXCHANGES):
        progress(_ROUNDS, _ROUNDS, "whole readings")
        linear, _ = fits.criterion(fitted.coordinates[0])
        changed = whole_readings(linear, cost, total, n * cost / total)
        again = fits.fitted(changed.astype(float), np.array([fitted.coordinates[0], nominal]))
        if again.chi2[0] <= fitted.chi2[0] * (1 + 1e-6):
            break
        n, fitted = changed, again
    last, seen = fits.criterion(fitted.coordinates[0])
    values = {
        k.name: float(k.to_value(x))
        for k, x in zip(fits.rival.unknowns, fitted.coordinates[0], strict=True)
    }
    return Separation(
        Shares(shares, efficiency),
        n,
        float(fitted.chi2[0]),
        chi2_shares,
        values,
        last,
        int((~seen).sum()),
    )


def _cleaned(shares: Float) -> Float:
    kept = np.where(shares > _NEGLIGIBLE, shares, 0.0)
    return np.asarray(kept / kept.sum())


def _mixed(shares: Float) -> Float:
    return 0.9 * shares + 0.1 / shares.size


_DRAWS = 20_000


def probability_of_deciding(
    jacobian: Float, rival: Misfit, readings: Float, parameters: tuple[int, int], seed: int
) -> float:
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
    parameters : (int, int)
        Numbers of free parameters of the true law and of the rival.
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
    penalty = [
        2 * k + (2 * k * (k + 1) / (data - k - 1) if data > k + 1 else np.inf) for k in parameters
    ]
    if not np.isfinite(penalty).all():
        return 0.0
    behind = difference + penalty[1] - penalty[0]
    return float((behind >= EXCLUDED).mean())


def _outside(jacobian: Float, vectors: Float) -> Float:
    """Square of what a fit leaves of each vector."""
    u, s, _ = np.linalg.svd(jacobian, full_matrices=False)
    basis = u[:, s > 1e-12 * max(float(s.max(initial=0.0)), 1e-300)]
    inside = vectors @ basis
    return np.asarray((vectors**2).sum(1) - (inside**2).sum(1))
