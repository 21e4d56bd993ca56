"""The prior of posteriors and evidence as a proper density of the coordinates u.

A parameter with a prior has that normal density, cut off where its rule says. Without, its
coordinate is uniform over a range: a tenth of the lowest to ten times the highest usual value of a
positive parameter, whose coordinate is the logarithm; zero to three times the highest usual value
of others. The range is widened where the data want a value beyond it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from asperity.inference.unknowns import Unknown

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PriorDensity:
    """Normalised prior density of the coordinates.

    Attributes
    ----------
    unknowns : tuple of Unknown
    low, high : array, shape (n,)
        Range of the coordinates.
    mean, precision : array, shape (n,)
        Of the normal priors, in SI; 0 where there is none.
    log_norm : float
        Logarithm of the normalising factor.
    """

    unknowns: tuple[Unknown, ...]
    low: Float
    high: Float
    mean: Float
    precision: Float
    log_norm: float

    @classmethod
    def about(cls, unknowns: Sequence[Unknown], u: Float, sd: Float) -> PriorDensity:
        """The prior, with ranges that reach an estimate u with standard deviations sd."""
        low, high = np.array(
            [k.range_about(x, s) for k, x, s in zip(unknowns, u, sd, strict=True)]
        ).T
        mean = np.array([k.prior.mean if k.prior else 0.0 for k in unknowns])
        sds = np.array([k.prior.sd if k.prior else math.inf for k in unknowns])
        log_norm = 0.0
        for k, a, b in zip(unknowns, low, high, strict=True):
            if k.prior is None:
                log_norm -= math.log(b - a)
            else:
                z = (np.array(k.to_value(np.array([a, b]))) - k.prior.mean) / k.prior.sd
                log_norm -= math.log(norm.cdf(z[1]) - norm.cdf(z[0]))
                log_norm -= math.log(k.prior.sd * math.sqrt(2 * math.pi))
                log_norm += 0.0 if k.logarithmic else math.log(k.scale)
        return cls(tuple(unknowns), low, high, mean, 1 / sds, log_norm)

    def log_density(self, u: Float) -> Float:
        """Logarithm of the density at u, shape (..., n) to (...); minus infinity out of range."""
        total = np.full(u.shape[:-1], self.log_norm)
        for i, k in enumerate(self.unknowns):
            x = u[..., i]
            outside = (x < self.low[i]) | (x > self.high[i])
            total = np.where(outside, -np.inf, total)
            if k.prior is not None:
                total = total - 0.5 * ((k.to_value(x) - k.prior.mean) / k.prior.sd) ** 2
                total = total + (x if k.logarithmic else 0.0)
        return np.asarray(total)

    def record(self) -> dict[str, dict[str, float | str]]:
        """Each prior in SI, for JSON."""
        found: dict[str, dict[str, float | str]] = {}
        for i, k in enumerate(self.unknowns):
            if k.prior is not None:
                found[k.name] = {
                    "kind": "normal",
                    "mean": k.prior.mean,
                    "sd": k.prior.sd,
                    "source": k.prior.source,
                }
            else:
                found[k.name] = {
                    "kind": "uniform in the logarithm" if k.logarithmic else "uniform",
                    "low": float(k.to_value(self.low[i])),
                    "high": float(k.to_value(self.high[i])),
                }
        return found
