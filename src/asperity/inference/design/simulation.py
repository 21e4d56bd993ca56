"""Fits of synthetic readings of a design: the check of its expected errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from asperity.arrays import Float
from asperity.errors import named
from asperity.inference.comparison.evidence import EXCLUDED
from asperity.inference.design.candidates import Progress, with_readings
from asperity.inference.design.plan import DesignPlan, expected_values, with_prior_means
from asperity.inference.design.rival import reached
from asperity.inference.objective import Objective, aicc_penalty
from asperity.inference.tables.residuals import leverages
from asperity.inference.tables.table import OBSERVABLES, LockInTable
from asperity.inference.tables.term import LockInTerm

#: A warning is given if the simulated spread differs from the expected one by more than this many
#: standard errors of the spread, plus this share of the expected spread.
_SURPRISING, _LINEAR = 3.0, 0.1


@dataclass(frozen=True)
class Simulated:
    """Results of fits to synthetic readings.

    Attributes
    ----------
    sets : int
        Number of fits that converged.
    failed : int
    spread : mapping of str to float
        Standard deviation of the estimates in SI: half the width of the central 68 %.
    uncertainty : mapping of str to float
        Standard error of that spread, by bootstrap.
    decided : float or None
        Share of the sets that exclude the rival.
    """

    sets: int
    failed: int
    spread: Mapping[str, float]
    uncertainty: Mapping[str, float]
    decided: float | None = None


def simulated(
    plan: DesignPlan,
    expected: LockInTable,
    n: Float,
    sets: int,
    rival: tuple[Objective, Float] | None,
    report: Progress,
) -> Simulated:
    """Fits of synthetic readings; noise and the means of priors are drawn anew for each set.

    Only the start of each fit is from the linear prediction.

    Parameters
    ----------
    plan : DesignPlan
    expected : LockInTable
        Expected readings of all candidates.
    n : array, shape (candidates,)
        Number of readings of each candidate.
    sets : int
    rival : (Objective, array) or None
        The rival with these readings, and its fit to the expected ones.
    report : callable
    """
    random = np.random.default_rng(plan.question.seed)
    counts, readings = n[n > 0], expected.without(n <= 0)
    truth = with_readings(plan, plan.truth, readings, counts)
    hypotheses = [(truth, truth.coordinates(expected_values(truth)))]
    hypotheses += [] if rival is None else [rival]
    estimates, behind = [], []
    for done in range(sets):
        report(done, sets, "synthetic sets")
        normal = random.normal(size=(readings.rows, len(OBSERVABLES)))
        drawn = readings.disturbed(readings.values, normal / np.sqrt(counts)[:, None])
        errors = {name: known * random.normal() for name, known in plan.priors.items()}
        fits = [_refitted(h, drawn, errors, counts, begin) for h, begin in hypotheses]
        ends = [fit for fit in fits if fit is not None]
        if len(ends) < len(fits):
            continue
        estimates.append(list(truth.named(ends[0].u).values()))
        aicc = [end.aicc for end in ends]
        behind.append(aicc[-1] - aicc[0] if np.isfinite(aicc).all() else 0.0)
    columns = np.array(estimates).reshape(-1, len(truth.names)).T
    spreads = {
        name: _spread(column, random) for name, column in zip(truth.names, columns, strict=True)
    }
    return Simulated(
        columns.shape[1],
        sets - columns.shape[1],
        {name: spread for name, (spread, _) in spreads.items()},
        {name: error for name, (_, error) in spreads.items()},
        float((np.array(behind) >= EXCLUDED).mean()) if rival and behind else None,
    )


class _Refit(NamedTuple):
    """The minimum for synthetic readings, in coordinates, and its AICc up to a constant."""

    u: Float
    aicc: float


def _refitted(
    objective: Objective,
    readings: LockInTable,
    errors: Mapping[str, float],
    counts: Float,
    u: Float,
) -> _Refit | None:
    """The fit to other readings at the same points; None if no minimum was reached.

    Parameters
    ----------
    objective : Objective
    readings : LockInTable
    errors : mapping of str to float
        Errors of the means of priors, in standard deviations.
    counts : array, shape (rows,)
    u : array, shape (n,)
        Start.
    """
    (term,) = objective.terms_of(LockInTerm)
    priors = {k.name: k.prior for k in objective.unknowns if k.prior}
    means = {name: prior.mean + prior.sd * errors[name] for name, prior in priors.items()}
    term = term.with_table(readings).weighted(np.sqrt(counts))
    objective = with_prior_means(replace(objective, terms=(term,)), means)
    end = objective.minimise(u)
    if not reached(objective, end.u):
        return None
    of_priors, slopes = objective.prior_residuals(end.u)
    jacobian = objective.residuals(end.u)[1]
    # As in a fit: priors count neither as data nor, by their leverage, as parameters.
    parameters = u.size - float(leverages(slopes, jacobian.T @ jacobian).sum())
    data = float(counts.sum()) * len(readings.observables)
    return _Refit(end.u, end.chi2 - float(of_priors @ of_priors) + aicc_penalty(parameters, data))


def _spread(x: Float, random: np.random.Generator) -> tuple[float, float]:
    """Half the width of the central 68 %, robust against outliers, and its standard error."""
    if x.size < 3:
        return math.nan, math.nan
    copies = np.vstack([x, random.choice(x, size=(200, x.size))])
    low, high = np.quantile(copies, [0.158655, 0.841345], axis=-1)
    half = (high - low) / 2
    return float(half[0]), float(half[1:].std())


def deviations_of_simulation(simulation: Simulated, expected: Mapping[str, float]) -> list[str]:
    """Sentences on simulated fits that differ from the expected standard errors."""
    warnings = []
    if simulation.failed:
        warnings.append(
            f"{simulation.failed} of {simulation.failed + simulation.sets} simulated fits did not "
            "converge"
        )
    for name, spread in simulation.spread.items():
        se, error = expected[name], simulation.uncertainty[name]
        if abs(spread - se) > _SURPRISING * error + _LINEAR * se:
            warnings.append(
                f"the simulated spread of {named(name)}, {spread:.3g}, is not the expected "
                f"standard error {se:.3g}: predictions are not linear in it over so wide a range"
            )
    return warnings
