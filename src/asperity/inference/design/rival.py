"""Points that exclude a law: chi-squared of the rival, refitted, is as large as it can be.

The rival's predictions are linearised at its last fit; the optimal weights are then a concave
problem. The rival is refitted at these weights, and a step towards them is accepted if the
chi-squared of the refitted rival grows. The general equivalence theorem at the last fit bounds the
gain of any better design (Atkinson and Fedorov, 1975). The probability that the readings exclude
the rival follows from the linear predictions of both laws.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from asperity.arrays import Bool, Float
from asperity.inference.comparison.evidence import EXCLUDED
from asperity.inference.design.candidates import differences, predicted, with_readings
from asperity.inference.design.criteria import Misfit
from asperity.inference.design.plan import DesignPlan, expected_values
from asperity.inference.design.weights import Whole, optimal_weights, whole_readings
from asperity.inference.objective import Minimum, Objective, aicc_penalty
from asperity.inference.tables.table import LockInTable

_ROUNDS = 15
#: The search ends at this efficiency.
_ENOUGH = 0.99
#: Fractions of the step to the proposed weights that are tried.
_PARTS = (1.0, 0.5, 0.25, 0.1)
_NEGLIGIBLE = 1e-4
#: Rounds of exchanges of whole readings, with a refit of the rival after each round.
_EXCHANGES = 4
#: Synthetic sets of readings, by linear predictions, for the probability of deciding.
_DRAWS = 20_000
#: A fit has reached a minimum if chi-squared can decrease by less than this.
_LEFT = 0.01


class Separation(NamedTuple):
    """The whole readings of a design, and the best fit of the rival to them.

    Attributes
    ----------
    efficiency : float
        Lower bound of the efficiency of the design weights.
    readings : int array, shape (candidates,)
    fitted : Minimum
        The rival refitted to the expected whole readings.
    chi2_weights : float
        Chi-squared of the rival refitted to the design weights.
    criterion : Misfit
        Criterion at the fit `fitted`.
    unseen : int
        Number of candidates that were left out because the rival has no response at its last fit.
    """

    efficiency: float
    readings: Whole
    fitted: Minimum
    chi2_weights: float
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
        Readings at all candidates, predicted by the law of the plan.
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

    def reached(self, n: Float, end: Minimum) -> bool:
        """Whether a fit to n readings of each candidate has reached a minimum."""
        return reached(self.to(n), end.u)

    def criterion(self, u: Float, n: Float) -> tuple[Misfit, Bool]:
        """The criterion linearised at a fit u to n readings, and which candidates have a response.

        A coordinate that its bound stops stays constant.
        """
        values = self.rival.named(u)
        at = predicted(self.plan, self.rival, self.points, values)
        residual, jacobian = differences(self.rival, self.expected, at, values)
        # A point without a response has no information.
        residual = np.where(at.seen[:, None], residual, 0.0)
        prior, prior_slopes = self.rival.prior_residuals(u)
        slope = np.einsum("i,im,imp->p", n, residual, jacobian) + prior @ prior_slopes
        moving = ~self.rival.active_bounds(u, slope)
        return Misfit(residual, jacobian * moving, prior, prior_slopes * moving), at.seen


def separation(
    fits: RivalFit, cost: Float, total: float, progress: Callable[[int, int, str], None]
) -> Separation:
    """Whole readings at which the refitted rival's chi-squared is largest.

    Parameters
    ----------
    fits : RivalFit
    cost : array, shape (candidates,)
        Cost of a reading.
    total : float
        Budget.
    progress : callable
    """
    readings = total / cost
    criterion, _ = fits.criterion(fits.start, readings / readings.size)
    weights = _cleaned(optimal_weights(criterion, readings)[0])
    best, efficiency = fits.fitted(weights * readings), 0.0
    for round_ in range(_ROUNDS):
        progress(round_, _ROUNDS, "refits of the rival")
        criterion, _ = fits.criterion(best.u, weights * readings)
        slope = criterion.gradient(weights * readings) * readings
        efficiency = criterion.least_efficiency(weights, slope)
        if efficiency >= _ENOUGH:
            break
        proposed = _cleaned(optimal_weights(criterion, readings)[0])
        for part in _PARTS:
            tried = _cleaned((1 - part) * weights + part * proposed)
            result = fits.fitted(tried * readings, best.u)
            if best.chi2 * (1 + 1e-6) < result.chi2 < np.inf:
                weights, best = tried, result
                break
        else:
            break
    n = whole_readings(criterion, cost, total, weights)
    fitted = fits.fitted(n.astype(float), best.u)
    for _ in range(_EXCHANGES):
        progress(_ROUNDS, _ROUNDS, "whole readings")
        linear, _ = fits.criterion(fitted.u, n.astype(float))
        changed = whole_readings(linear, cost, total, n * cost / total)
        again = fits.fitted(changed.astype(float), fitted.u)
        if not fitted.chi2 * (1 + 1e-6) < again.chi2 < np.inf:
            break
        n, fitted = changed, again
    last, seen = fits.criterion(fitted.u, n.astype(float))
    return Separation(efficiency, n, fitted, best.chi2, last, int((~seen).sum()))


def reached(objective: Objective, u: Float) -> bool:
    """Whether u is a minimum, and not at the edge of the region in which the law has responses."""
    return math.isfinite(objective.chi2(u)) and objective.expected_decrease(u) < _LEFT


def _cleaned(weights: Float) -> Float:
    kept = np.where(weights > _NEGLIGIBLE, weights, 0.0)
    return np.asarray(kept / kept.sum())


def probability_of_deciding(jacobian: Float, rival: Misfit, readings: Float, seed: int) -> float:
    """Probability that the rival's AICc exceeds that of the true law enough to exclude it.

    Both laws are linear in their parameters about their fits to the expected readings, so that the
    difference of the two chi-squared follows from normal noise by projections.

    Parameters
    ----------
    jacobian : array, shape (candidates, m, p)
        Jacobian of the true law, in standard uncertainties of a reading.
    rival : Misfit
        Criterion at the rival's fit to the expected readings.
    readings : array, shape (candidates,)
    seed : int
    """
    rows = np.flatnonzero(readings > 0)
    root = np.sqrt(readings[rows])[:, None]
    apart = (rival.residual[rows] * root).ravel()
    data = round(float(readings[rows].sum())) * rival.residual.shape[1]
    q = rival.prior_residual.size
    law_columns = (jacobian[rows] * root[..., None]).reshape(apart.size, -1)
    rival_columns = (rival.jacobian[rows] * root[..., None]).reshape(apart.size, -1)
    apart = np.concatenate([apart, rival.prior_residual])
    law_columns = np.vstack([law_columns, np.zeros((q, law_columns.shape[1]))])
    rival_columns = np.vstack([rival_columns, rival.prior_jacobian])
    noise = np.random.default_rng(seed).normal(size=(_DRAWS, apart.size))
    noise[:, apart.size - q :] = 0.0
    difference = _outside(rival_columns, apart - noise) - _outside(law_columns, noise)
    of_rival, of_law = (aicc_penalty(a.shape[1], data) for a in (rival_columns, law_columns))
    # Laws with as many parameters as data, or one less, are not compared.
    together = math.isfinite(of_rival + of_law)
    return float((difference + of_rival - of_law >= EXCLUDED).mean()) if together else 0.0


def _outside(jacobian: Float, vectors: Float) -> Float:
    """Squared norm of the part of each vector outside the columns of the Jacobian."""
    u, s, _ = np.linalg.svd(jacobian, full_matrices=False)
    basis = u[:, s > 1e-12 * max(float(s.max(initial=0.0)), 1e-300)]
    inside = vectors @ basis
    return np.asarray((vectors**2).sum(1) - (inside**2).sum(1))
