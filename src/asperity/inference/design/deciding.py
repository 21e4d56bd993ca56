"""How probably the readings of a design exclude the rival law."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.inference.comparison.compare import LARGEST_AICC_DIFFERENCE
from asperity.inference.design.criteria import Misfit

Float = NDArray[np.float64]

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
    mine = (jacobian[rows] * root[..., None]).reshape(apart.size, -1)
    theirs = (rival.jacobian[rows] * root[..., None]).reshape(apart.size, -1)
    apart = np.concatenate([apart, rival.prior_residual])
    mine = np.vstack([mine, np.zeros((q, mine.shape[1]))])
    theirs = np.vstack([theirs, rival.prior_jacobian])
    noise = np.random.default_rng(seed).normal(size=(_DRAWS, apart.size))
    noise[:, apart.size - q :] = 0.0
    difference = _outside(theirs, apart - noise) - _outside(mine, noise)
    penalty = [
        2 * k + (2 * k * (k + 1) / (data - k - 1) if data > k + 1 else np.inf) for k in parameters
    ]
    if not np.isfinite(penalty).all():
        return 0.0
    behind = difference + penalty[1] - penalty[0]
    return float((behind >= LARGEST_AICC_DIFFERENCE).mean())


def _outside(jacobian: Float, vectors: Float) -> Float:
    """Square of what a fit leaves of each vector."""
    u, s, _ = np.linalg.svd(jacobian, full_matrices=False)
    basis = u[:, s > 1e-12 * max(float(s.max(initial=0.0)), 1e-300)]
    inside = vectors @ basis
    return np.asarray((vectors**2).sum(1) - (inside**2).sum(1))
