"""Second opinions on a law: its evidence, and how well other runs predict each run.

Evidence is the probability of the data under a law, averaged over its prior: the integral of
likelihood times prior over the parameters by importance sampling from Student's t about the mode in
whitened coordinates; without samples, the normal approximation (Laplace).

Samples of one run share what was the same in it, so that leaving out one reading at a time would
flatter every law. A run is what was measured together: a file, or the rows of one entry in the
column ``run``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.inference.fitting.result import Fit
from asperity.inference.objective import log_density
from asperity.inference.posterior.density import Whitened
from asperity.inference.tables.term import LockInTerm

Float = NDArray[np.float64]

#: Degrees of freedom of the distribution that samples come from.
_TAILS = 5.0
#: Effective samples below which the number is no more than a guess.
_ENOUGH = 50.0


@dataclass(frozen=True)
class Evidence:
    """Evidence of a law.

    Attributes
    ----------
    log : float
        Natural logarithm of the evidence.
    standard_error : float
        Of `log`, by sampling.
    effective_samples : float
        Of the importance weights.
    laplace : float
        The normal approximation of `log`.
    failed : int
        Samples at which the law has no solution; they count as impossible.
    prior : mapping
        Prior of each parameter, as plain numbers: the evidence depends on the ranges.
    """

    log: float
    standard_error: float
    effective_samples: float
    laplace: float
    failed: int
    prior: dict[str, Any]

    @property
    def reliable(self) -> bool:
        """Whether there are effective samples enough."""
        return self.effective_samples >= _ENOUGH


def evidence_of(fit: Fit, *, samples: int | None = None, seed: int = 0) -> Evidence:
    """Evidence of a fitted law.

    Parameters
    ----------
    fit : Fit
        Converged.
    samples : int, optional
        By default what the data afford, 1024 for a table, 256 with a recording, and 80 where
        orbits are searched for; 0 for the normal approximation alone.
    seed : int

    Notes
    -----
    The prior is that of `Coordinates`. A range k times as wide of a parameter that these data
    determine lowers the logarithm by ln k.
    """
    if samples is None:
        samples = min(term.affordable for term in fit.objective.terms)
    if not fit.objective.unknowns:
        # Nothing to average over.
        density = fit.log_likelihood
        return Evidence(density, 0.0, float(samples), density, 0, {})
    whitened = Whitened.of(fit)
    n = whitened.mode.size
    (mode,), (at_mode,) = _with_log_prior(whitened, np.zeros((1, n)))
    laplace = fit.objective.log_likelihood(mode) + at_mode + 0.5 * n * math.log(2 * math.pi)
    if samples == 0:
        return Evidence(laplace, math.nan, 0.0, laplace, 0, whitened.prior_record())
    # The whole of scipy.stats takes longer to load than a fit of a velocity step to begin.
    from scipy.stats import multivariate_t

    proposal = multivariate_t(np.zeros(n), np.eye(n), df=_TAILS, seed=seed)
    z = np.asarray(proposal.rvs(samples)).reshape(samples, n)
    log_weights = _log_target(fit, whitened, z) - proposal.logpdf(z).reshape(samples)
    failed = int((~np.isfinite(log_weights)).sum())
    log_weights = np.where(np.isfinite(log_weights), log_weights, -np.inf)
    top = log_weights.max()
    weights = np.exp(log_weights - top)
    mean = weights.mean()
    return Evidence(
        float(top + math.log(mean)),
        float(weights.std(ddof=1) / (mean * math.sqrt(samples))),
        float(weights.sum() ** 2 / (weights**2).sum()),
        laplace,
        failed,
        whitened.prior_record(),
    )


def _with_log_prior(whitened: Whitened, z: Float) -> tuple[Float, Float]:
    """Coordinates of the fit, and the logarithm of the prior times the volume dq/dz du/dq."""
    q = whitened.mode + z @ whitened.root.T
    u = np.asarray(whitened.coordinates.to_u(q))
    volume = np.asarray(whitened.coordinates.log_slope(q)).sum(-1)
    volume = volume + np.linalg.slogdet(whitened.root)[1]
    return u, whitened.coordinates.log_density(u) + volume


def _log_target(fit: Fit, whitened: Whitened, z: Float) -> Float:
    """Logarithm of likelihood times prior times volume, shape (samples,)."""
    u, total = _with_log_prior(whitened, z)
    values = [fit.objective.named(x) for x in u]
    for term, residuals in zip(fit.objective.terms, fit.residuals, strict=True):
        # The change from the estimate: the error of a coarse model of searched orbits is in both.
        at_estimate, *chi2 = term.chi2_of_many([fit.values, *values], near=True)
        total += log_density(residuals) - 0.5 * (np.array(chi2) - at_estimate)
    return total


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


def leave_one_run_out(fit: Fit) -> CrossValidation:
    """Cross-validation of a converged fit to tables of lock-in readings.

    The density of a run is normal about the prediction of the fit to the others, with their
    uncertainty of the parameters on top of the errors.
    """
    tables = fit.objective.terms_of(LockInTerm)
    if not tables or len(fit.objective.terms) > 1:
        return CrossValidation(math.nan, {}, "data other than tables have no runs to leave out")
    (term,) = tables
    names = list(dict.fromkeys(term.table.run.tolist()))
    if len(names) < 2:
        return CrossValidation(
            math.nan, {}, "all rows are of one run; name the runs in a column 'run'"
        )
    runs = {name: _predictive(fit, term, term.table.run == name) for name in names}
    if not all(math.isfinite(value) for value in runs.values()):
        return CrossValidation(math.nan, runs, "the other runs do not determine the parameters")
    return CrossValidation(sum(runs.values()), runs)


def _predictive(fit: Fit, term: LockInTerm, left_out: NDArray[np.bool_]) -> float:
    """Log density of the rows left out, given the others."""
    objective = fit.objective
    rest = replace(objective, terms=(term.weighted(np.where(left_out, 0.0, 1.0)),))
    u = rest.minimise(objective.coordinates(fit.values))[0]
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
