"""Outliers of a fit: rows of a table without which the law describes the other rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from asperity.arrays import Float
from asperity.inference.fitting.minima import FAR_OFF
from asperity.inference.fitting.parabola import Parabola, parabola_of
from asperity.inference.holds import HoldTerm
from asperity.inference.objective import Minimum, Objective, Residuals
from asperity.inference.tables.residuals import (
    DESCRIBED,
    outlying_rows,
    p_value_without,
    weights_without,
)
from asperity.inference.tables.term import LockInTerm

#: A chi-squared that is lower by more than this belongs to another minimum.
LOWER = 0.01
#: Tolerance (relative change of the coordinates) of a fit with rows left out, and its evaluations.
_REFIT_TOLERANCE, _EVALUATIONS = 1e-6, 20


def with_outliers(
    objective: Objective, at: Parabola, minima: Sequence[tuple[Float, float]]
) -> tuple[Parabola, Sequence[tuple[Float, float]], tuple[int, ...]]:
    """The lowest minimum, all minima, and outliers, whose search may find lower minima."""
    outliers, lower = _outliers(objective, at)
    while lower is not None:
        lower = Minimum(objective.ordered(lower.u), lower.chi2)
        minima, at = [lower, *minima], parabola_of(objective, *lower) or at
        if outliers and at.p_value < DESCRIBED:
            break
        outliers, lower = _outliers(objective, at)
    return at, minima, outliers


def _outliers(objective: Objective, at: Parabola) -> tuple[tuple[int, ...], Minimum | None]:
    """Outliers of a table, and a lower minimum to which the fit without them leads.

    Outliers are rows without which the law describes the table. A row that is steep in the
    parameters makes several minima, of which the search may miss the lowest: the fit without that
    row has one minimum, from which that of all rows is reached. In a fit together with recordings,
    which takes minutes, and in one of holds, predictions are linearised.
    """
    if any(isinstance(term, HoldTerm) for term in objective.terms) and objective.noise_is_known:
        return tuple(outlying_rows(at.data[0])), None
    tables = [i for i, term in enumerate(objective.terms) if isinstance(term, LockInTerm)]
    if not tables:
        return (), None
    if len(objective.terms) > 1:
        data = objective.data_residuals(at.u)
        return tuple(outlying_rows(data[tables[0]])) if data else (), None
    u = at.u
    rows = np.concatenate([at.data[0].row, np.full(at.priors, -1)])

    def whole(objective: Objective) -> Residuals | None:
        values, slopes = objective.residuals(u)
        if not np.isfinite(values).all():
            return None
        return at.data[0]._replace(values=values, jacobian=slopes, row=rows)

    def refit(objective: Objective, weights: Float) -> Residuals | None:
        nonlocal u
        (term,) = objective.terms_of(LockInTerm)
        weighted = replace(objective, terms=(term.weighted(weights),))
        u, _ = weighted.minimise(u, tolerance=_REFIT_TOLERANCE, evaluations=_EVALUATIONS)
        return whole(objective)

    now, coarse = whole(objective), objective.coarser()
    outliers = () if now is None else tuple(outlying_rows(now, partial(refit, coarse)))
    if now is not None and outliers and coarse is not objective:
        without = refit(objective, weights_without(now, outliers))
        if without is None or not p_value_without(without, outliers) >= DESCRIBED:
            outliers = ()
    if u is at.u or not (outliers or at.p_value >= FAR_OFF):
        return outliers, None
    end = objective.minimise(u)
    # A minimum that is not reached again would be tried without end.
    lower = end.chi2 < at.chi2 - LOWER and parabola_of(objective, *end) is not None
    return outliers, end if lower else None
