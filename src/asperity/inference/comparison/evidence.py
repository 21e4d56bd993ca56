"""Evidence: the probability of the data under a law, averaged over its prior.

The integral of likelihood times prior over the parameters by importance sampling from Student's t
about the mode in whitened coordinates; without samples, the normal approximation (Laplace).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import multivariate_t

from asperity.inference.fitting.result import Fit
from asperity.inference.objective import Objective
from asperity.inference.posterior.density import Whitened
from asperity.inference.posterior.sampling import whitened_posterior
from asperity.inference.tables.residuals import columns_of
from asperity.inference.tables.term import LockInTerm, all_converged

Float = NDArray[np.float64]

#: Samples, and the degrees of freedom of the distribution that they come from.
_SAMPLES, _TAILS = 1024, 5.0
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


def evidence_of(found: Fit, *, samples: int = _SAMPLES, seed: int = 0) -> Evidence:
    """Evidence of a fitted law.

    Parameters
    ----------
    found : Fit
        Converged.
    samples : int
    seed : int

    Notes
    -----
    The prior is `PriorDensity`. A range k times as wide of a parameter that these data determine
    lowers the logarithm by ln k.
    """
    if not found.objective.unknowns:
        # Nothing to average over.
        density = found.log_likelihood
        return Evidence(density, 0.0, float(samples), density, 0, {})
    whitened = whitened_posterior(found)
    n = whitened.mode.size
    proposal = multivariate_t(np.zeros(n), np.eye(n), df=_TAILS, seed=seed)
    z = np.asarray(proposal.rvs(samples)).reshape(samples, n)
    log_weights = _log_target(whitened, z) - proposal.logpdf(z).reshape(samples)
    failed = int((~np.isfinite(log_weights)).sum())
    log_weights = np.where(np.isfinite(log_weights), log_weights, -np.inf)
    top = log_weights.max()
    weights = np.exp(log_weights - top)
    mean = weights.mean()
    at_mode = float(_log_target(whitened, np.zeros((1, n)))[0])
    return Evidence(
        float(top + math.log(mean)),
        float(weights.std(ddof=1) / (mean * math.sqrt(samples))),
        float(weights.sum() ** 2 / (weights**2).sum()),
        at_mode + 0.5 * n * math.log(2 * math.pi),
        failed,
        whitened.prior.record(),
    )


def _log_target(whitened: Whitened, z: Float) -> Float:
    """Logarithm of likelihood times prior times the volume dq/dz du/dq, shape (samples,)."""
    q = whitened.mode + z @ whitened.root.T
    u = np.asarray(whitened.coordinates.to_u(q))
    volume = np.asarray(whitened.coordinates.log_slope(q)).sum(-1)
    volume = volume + np.linalg.slogdet(whitened.root)[1]
    return log_likelihoods(whitened.objective, u) + whitened.prior.log_density(u) + volume


def log_likelihoods(objective: Objective, u: Float) -> Float:
    """Logarithms of the likelihood at many coordinates, shapes (samples, n) to (samples,)."""
    total = np.zeros(len(u))
    for term in objective.terms:
        if isinstance(term, LockInTerm) and not term.forward.uses_search:
            total += _of_table(objective, term, u)
        else:
            return np.array([objective.log_likelihood(x) for x in u])
    return total


def _of_table(objective: Objective, term: LockInTerm, u: Float) -> Float:
    weights, rows = term.weights, term.table.rows
    values = {
        k.name: np.repeat(np.asarray(k.to_value(u[:, i])), rows)
        for i, k in enumerate(objective.unknowns)
    }
    predicted, outcome = term.forward.predicted(values, repeats=len(u))
    columns = columns_of(predicted).reshape(len(u), rows, -1)
    residuals = np.einsum("rsc,nrc->nrs", weights.matrix, columns) - weights.target
    good = np.array([all_converged(o) for o in outcome.reshape(len(u), rows)])
    count = int(weights.reported.sum())
    found = -0.5 * np.sum(residuals**2, axis=(1, 2)) - weights.log_scale
    return np.where(good, found - 0.5 * count * math.log(2 * math.pi), -np.inf)
