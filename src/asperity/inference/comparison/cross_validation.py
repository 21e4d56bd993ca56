"""Leave-one-run-out cross-validation: how well the other runs predict each run.

Samples of one run share what was the same in it, so that leaving out one reading at a time would
flatter every law. A run is what was measured together: a file, or the rows of one entry in the
column ``run``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from asperity.inference.fitting.result import Fit
from asperity.inference.tables.term import LockInTerm

Float = NDArray[np.float64]


@dataclass(frozen=True)
class CrossValidation:
    """Predictive densities of runs that were left out.

    Attributes
    ----------
    log_density : float
        Sum over the runs: expected log predictive density.
    runs : mapping of str to float
        Of each run.
    message : str
        Why there are no numbers, if there are none.
    """

    log_density: float
    runs: dict[str, float]
    message: str = ""

    def difference(self, other: CrossValidation) -> tuple[float, float]:
        """How much better this one predicts than the other, and the standard error."""
        apart = np.array([self.runs[name] - other.runs[name] for name in self.runs])
        if apart.size < 2:
            return float(apart.sum()), math.nan
        return float(apart.sum()), float(apart.std(ddof=1) * math.sqrt(apart.size))


def leave_one_run_out(found: Fit) -> CrossValidation:
    """Cross-validation of a converged fit to tables of lock-in readings.

    The density of a run is normal about the prediction of the fit to the others, with their
    uncertainty of the parameters on top of the errors.
    """
    tables = found.objective.terms_of(LockInTerm)
    if not tables or len(found.objective.terms) > 1:
        return CrossValidation(math.nan, {}, "data other than tables have no runs to leave out")
    (term,) = tables
    names = list(dict.fromkeys(term.table.run.tolist()))
    if len(names) < 2:
        return CrossValidation(
            math.nan, {}, "all rows are of one run; name the runs in a column 'run'"
        )
    runs = {name: _predictive(found, term, term.table.run == name) for name in names}
    if not all(math.isfinite(value) for value in runs.values()):
        return CrossValidation(math.nan, runs, "the other runs do not determine the parameters")
    return CrossValidation(sum(runs.values()), runs)


def _predictive(found: Fit, term: LockInTerm, left_out: NDArray[np.bool_]) -> float:
    """Log density of the rows left out, given the others."""
    objective = found.objective
    rest = replace(objective, terms=(term.weighted(np.where(left_out, 0.0, 1.0)),))
    u = rest.minimise(objective.coordinates(found.values))[0]
    data = objective.data_residuals(u)
    if data is None:
        return math.nan
    out = left_out[data[0].row]
    r_out, J_out = data[0].values[out], data[0].jacobian[out]
    J = np.vstack([data[0].jacobian[~out], objective.prior_residuals(u)[1]])
    information = J.T @ J
    if u.size and np.linalg.cond(information) > 1e14:
        return math.nan
    spread = np.eye(r_out.size) + J_out @ np.linalg.solve(information, J_out.T)
    log_scale = float(term.weights.log_scales[left_out].sum())
    distance = float(r_out @ np.linalg.solve(spread, r_out))
    return float(
        -0.5 * (distance + np.linalg.slogdet(spread)[1] + r_out.size * math.log(2 * math.pi))
        - log_scale
    )
