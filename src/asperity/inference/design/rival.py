"""Points that exclude a law: chi-squared of the rival, refitted, is as large as it can be.

The rival's predictions are linearised at its last fit; the optimal weights are then a concave
problem. The rival is refitted at these weights, and a step towards them is accepted if the
chi-squared of the refitted rival grows. The general equivalence theorem at the last fit bounds the
gain of any better design (Atkinson and Fedorov, 1975). The probability that the readings exclude
the rival follows from the linear predictions of both laws.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
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
    unseen : int
        Number of candidates that were left out because the rival has no response at its last fit.
    """

    efficiency: float
    readings: Whole
    fitted: Minimum
    chi2_weights: float
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
        prior, prior_slopes = prior_rows(self.plan, self.rival, u)
        slope = np.einsum("i,im,imp->p", n, residual, jacobian) + prior @ prior_slopes
        moving = ~self.rival.active_bounds(u, slope)
        return Misfit(residual, jacobian * moving, prior, prior_slopes * moving), at.seen

    def probability_of_deciding(self, jacobian: Float, n: Float, end: Minimum) -> float | None:
        """Probability that n readings exclude the rival; None if its fit reached no minimum.

        Parameters
        ----------
        jacobian : array, shape (candidates, m, p)
            Jacobian of the true law, in standard uncertainties of a reading.
        n : array, shape (candidates,)
        end : Minimum
            Fit of the rival to the expected readings.
        """
        if not self.reached(n, end):
            return None
        plan, truth = self.plan, self.plan.truth
        priors = prior_rows(plan, truth, truth.coordinates(expected_values(truth)))
        law = Misfit(np.zeros(jacobian.shape[:2]), jacobian, *priors)
        rival, _ = self.criterion(end.u, n)
        drawn = list(plan.priors.values())
        return probability_of_deciding(law, rival, n, plan.question.seed, drawn)


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
    seen = fits.criterion(fitted.u, n.astype(float))[1]
    return Separation(efficiency, n, fitted, best.chi2, int((~seen).sum()))


def reached(objective: Objective, u: Float) -> bool:
    """Whether u is a minimum, and not at the edge of the region in which the law has responses."""
    return math.isfinite(objective.chi2(u)) and objective.expected_decrease(u) < _LEFT


def _cleaned(weights: Float) -> Float:
    kept = np.where(weights > _NEGLIGIBLE, weights, 0.0)
    return np.asarray(kept / kept.sum())


def prior_rows(plan: DesignPlan, hypothesis: Objective, u: Float) -> tuple[Float, Float]:
    """Residuals of all priors of a plan, and their derivatives; 0 for those of the other law."""
    values, slopes = hypothesis.prior_residuals(u)
    names = list(plan.priors)
    at = [names.index(k.name) for k in hypothesis.unknowns if k.prior]
    residuals, jacobian = np.zeros(len(names)), np.zeros((len(names), u.size))
    residuals[at], jacobian[at] = values, slopes
    return residuals, jacobian


def probability_of_deciding(
    law: Misfit, rival: Misfit, readings: Float, seed: int, drawn: Sequence[bool] = ()
) -> float:
    """Probability that the rival's AICc exceeds that of the true law enough to exclude it.

    Both laws are linear in their parameters about their fits to the expected readings, so that the
    difference of the two chi-squared follows from normal noise by projections.

    Parameters
    ----------
    law, rival : Misfit
        Criteria at the fits to the expected readings, with the same priors.
    readings : array, shape (candidates,)
    seed : int
    drawn : sequence of bool, shape (priors,)
        Whether the mean of each prior has errors: it is a measurement of the true law.
    """
    rows = np.flatnonzero(readings > 0)
    size = rows.size * rival.residual.shape[1]
    data = round(float(readings[rows].sum())) * rival.residual.shape[1]
    noise = np.random.default_rng(seed).normal(size=(_DRAWS, size + len(drawn)))
    noise[:, size:] *= drawn
    root = np.sqrt(readings[rows])[:, None]
    aicc = []
    for fit in (law, rival):
        apart = np.append(fit.residual[rows] * root, fit.prior_residual)
        columns = (fit.jacobian[rows] * root[..., None]).reshape(size, -1)
        columns = np.vstack([columns, fit.prior_jacobian])
        u, s, _ = np.linalg.svd(columns, full_matrices=False)
        basis = u[:, s > 1e-12 * max(float(s.max(initial=0.0)), 1e-300)]
        outside = apart - noise
        outside = outside - (outside @ basis) @ basis.T
        # As in a fit: priors count neither as data nor, by their leverage, as parameters.
        parameters = columns.shape[1] - float(np.sum(basis[size:] ** 2))
        aicc.append((outside[:, :size] ** 2).sum(1) + aicc_penalty(parameters, data))
    # Laws with as many parameters as data, or one less, are not compared.
    together = np.isfinite(aicc).all()
    return float((aicc[1] - aicc[0] >= EXCLUDED).mean()) if together else 0.0
