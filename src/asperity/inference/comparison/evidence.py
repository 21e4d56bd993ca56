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


def evidence_of(found: Fit, *, samples: int | None = None, seed: int = 0) -> Evidence:
    """Evidence of a fitted law.

    Parameters
    ----------
    found : Fit
        Converged.
    samples : int, optional
        By default what the data afford, 1024 for a table, 256 with a recording, and 128 where
        orbits are searched for; 0 for the normal approximation alone.
    seed : int

    Notes
    -----
    The prior is `PriorDensity`. A range k times as wide of a parameter that these data determine
    lowers the logarithm by ln k.
    """
    if samples is None:
        samples = min(term.affordable for term in found.objective.terms)
    if not found.objective.unknowns:
        # Nothing to average over.
        density = found.log_likelihood
        return Evidence(density, 0.0, float(samples), density, 0, {})
    whitened = whitened_posterior(found)
    n = whitened.mode.size
    at_mode = float(_log_target(whitened, np.zeros((1, n)))[0])
    laplace = at_mode + 0.5 * n * math.log(2 * math.pi)
    if samples == 0:
        return Evidence(laplace, math.nan, 0.0, laplace, 0, whitened.prior.record())
    proposal = multivariate_t(np.zeros(n), np.eye(n), df=_TAILS, seed=seed)
    z = np.asarray(proposal.rvs(samples)).reshape(samples, n)
    log_weights = _log_target(whitened, z) - proposal.logpdf(z).reshape(samples)
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
    values = [objective.named(x) for x in u]
    total = np.zeros(len(u))
    for term in objective.terms:
        total += term.log_norm - 0.5 * term.chi2_of_many(values, near=True)
    return total
