"""Mean levels and trends of a recording, with uncertainties that count correlated noise.

Friction in a segment is averaged in bins of equal time and fitted by least squares with a level, a
trend over slip and optionally decaying exponentials. The residual is correlated over hundreds of
samples and contains spectral lines: the variance of the coefficients is not that of white noise. It
is estimated from the spectral density of the residual near zero frequency, by projections on the
slowest cosines that the fitted columns leave free (equal-weighted cosines: Mueller, J. Econometrics
141, 1331, 2007; Lazarus et al., J. Bus. Econ. Stat. 36, 541, 2018). Where the density grows
significantly towards zero, its power law is extrapolated. Each cosine is a degree of freedom.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from asperity.arrays import Float
from asperity.lock_in.noise import red_exponent
from asperity.lock_in.quantisation import rounding_variance

#: Most blocks of a mean level.
_MOST_BLOCKS = 512
#: Two rates differ if noise alone has less than this probability of such a difference.
_ACCIDENT = 3e-3

#: Most bins of a segment, and cosines from which slow noise is estimated.
_BINS, _COSINES = 400, 8
#: Scatter of the log of a squared projection, a chi-squared number of one degree of freedom.
_LOG_SCATTER = 2.22


class MeanLevel(NamedTuple):
    """A mean over a stretch of time, with its standard uncertainty and degrees of freedom."""

    value: float
    uncertainty: float
    dof: float
    start: float
    end: float


class Rate(NamedTuple):
    """Change per second, with its standard uncertainty and degrees of freedom."""

    value: float
    uncertainty: float
    dof: float

    def beyond(self, other: Rate) -> float:
        """Difference of two rates; 0 if noise explains it."""
        parts = [(self.uncertainty, self.dof), (other.uncertainty, other.dof)]
        quantile = float(stdtrit(effective_dof(parts), 1 - _ACCIDENT / 2))
        away = abs(self.value - other.value)
        return away if away > quantile * np.hypot(self.uncertainty, other.uncertainty) else 0.0


def rate_between(first: MeanLevel, second: MeanLevel) -> Rate:
    """Rate from one level to a later one."""
    seconds = (second.start + second.end - first.start - first.end) / 2
    parts = [(level.uncertainty / seconds, level.dof) for level in (first, second)]
    doubt = float(np.hypot(parts[0][0], parts[1][0]))
    return Rate((second.value - first.value) / seconds, doubt, effective_dof(parts))


def block_means(values: Float, blocks: int) -> Float:
    """Means over about `blocks` blocks of equal length; a shorter block at the end is left out."""
    length = max(1, values.size // blocks)
    whole = values.size // length
    return values[: whole * length].reshape(whole, length).mean(1)


def mean_level(time: Float, values: Float, step: float = 0.0) -> MeanLevel:
    """Mean of a stretch of time, with the uncertainty due to correlated noise and to rounding.

    Parameters
    ----------
    time, values : array, (n,)
    step : float
        Step of the recorder.

    Notes
    -----
    The uncertainty is that of a level without trend, by `slow_variance`: a slow drift counts as
    noise.
    """
    means, mean = block_means(values, _MOST_BLOCKS), float(values.mean())
    span = float(time[0]), float(time[-1])
    if means.size < 2:
        return MeanLevel(mean, np.inf, 1.0, *span)
    # A drift is part of the cosines already; as a power law it would count twice.
    left, level = means - means.mean(), np.ones((means.size, 1))
    variance, dof = slow_variance(left, level, grows=False)
    variance = variance / means.size + rounding_variance(step, float(np.std(values)))[0]
    return MeanLevel(mean, float(np.sqrt(variance)), float(dof), *span)


def neighbour_scatter(values: Float) -> float:
    """Standard deviation of noise, by differences of neighbours, which steps hardly change."""
    if values.size < 3:
        return 0.0
    return 1.4826 * float(np.median(np.abs(np.diff(values)))) / np.sqrt(2)


def moving_mean(values: Float, wide: int) -> Float:
    """Means over every `wide` neighbours; the values themselves where they are fewer."""
    return (
        np.convolve(values, np.ones(wide) / wide, mode="valid") if values.size >= wide else values
    )


def slope_of(at: Float, values: Float) -> float:
    """Least-squares slope of values over their positions; 0 where all positions are the same."""
    away = at - at.mean()
    power = float(away @ away)
    return float(away @ (values - values.mean())) / power if power else 0.0


class WeightedLine(NamedTuple):
    """A straight line through values of known uncertainty.

    Attributes
    ----------
    beta : array, (2,)
        Level at zero, and slope.
    covariance : array, (2, 2)
        By the uncertainties of the values.
    excess : float
        Chi-squared over its degrees of freedom; 1 for two values.
    """

    beta: Float
    covariance: Float
    excess: float


def weighted_line(at: Float, values: Float, uncertainty: Float) -> WeightedLine:
    """Least squares of a straight line; arrays (n,)."""
    matrix = np.stack([np.ones_like(at), at], axis=1) / uncertainty[:, None]
    covariance = np.asarray(np.linalg.pinv(matrix.T @ matrix), dtype=np.float64)
    beta = covariance @ (matrix.T @ (values / uncertainty))
    left, free = values / uncertainty - matrix @ beta, values.size - 2
    return WeightedLine(beta, covariance, float(left @ left) / free if free else 1.0)


def weighted_mean(values: Float, uncertainty: Float) -> tuple[float, float]:
    """Mean, and its uncertainty by those of the values or by their scatter, whichever is larger."""
    weight = 1 / uncertainty**2
    mean = float(weight @ values / weight.sum())
    excess = float(weight @ (values - mean) ** 2) / max(values.size - 1, 1)
    return mean, float(np.sqrt(max(excess, 1.0) / weight.sum()))


def steady_from(values: Float, degree: int) -> int:
    """Index of the first value after the initial transient of a series.

    The cut is chosen so that the standard error of the mean of the remaining values, about a drift
    of the given degree, is smallest (marginal standard error rule: White, Simulation 69, 323,
    1997). Among cuts that are equally good within noise, the earliest is chosen. At most half of
    the values are cut.

    Parameters
    ----------
    values : array, (n,)
        About a hundred values.
    degree : int
        Degree of the drift that is no transient.
    """
    n = values.size
    if n < 8:
        return 0
    # Not an exponential, as in `window.settled`: friction in a hold falls over decades of time, and
    # what one exponential leaves moves the levels of holds by two to three uncertainties.
    errors = []
    for cut in range(n // 2 + 1):
        late = values[cut:]
        u = np.linspace(-1, 1, late.size)
        columns = np.polynomial.legendre.legvander(u, degree)
        beta = np.linalg.lstsq(columns, late)[0]
        spread = np.sum((late - columns @ beta) ** 2) / (late.size - degree - 1)
        errors.append(spread / late.size)
    error = np.array(errors)
    return int(np.argmax(error <= error.min() * (1 + 3 * np.sqrt(2 / n)) + 1e-300))


def effective_dof(parts: list[tuple[float, float]]) -> float:
    """Degrees of freedom of a sum of squared uncertainties (Welch and Satterthwaite).

    Parameters
    ----------
    parts : list of (float, float)
        Standard uncertainties and their degrees of freedom.
    """
    whole = sum(doubt**2 for doubt, _ in parts)
    each = sum(doubt**4 / max(dof, 1.0) for doubt, dof in parts)
    return whole**2 / each if each > 0 else np.inf


@dataclass(frozen=True, eq=False)
class TrendFit:
    """Least squares of a segment.

    Attributes
    ----------
    beta : array, (p,)
        Level at zero slip, then the coefficients of slip, of its square, and of exponentials.
    inverse : array, (p, p)
        Inverse of the normal matrix; `variance` times `inverse` is the covariance of `beta`.
    variance : float
        Variance per bin of white noise that would give `beta` the same uncertainty as the actual
        noise.
    dof : int
        Degrees of freedom of `variance`.
    """

    beta: Float
    inverse: Float
    variance: float
    dof: int

    def rate(self, k: int) -> Rate:
        """A coefficient that is a rate."""
        uncertainty = float(np.sqrt(self.variance * self.inverse[k, k]))
        return Rate(float(self.beta[k]), uncertainty, float(self.dof))


def bin_means(at: Float, values: Float) -> tuple[Float, Float]:
    """Mean positions and values in bins of equal width; empty bins are left out.

    Parameters
    ----------
    at, values : array, (n,)
        Positions, rising, and the values at these positions.
    """
    wanted = min(_BINS, max(4, at.size // 2))
    edges = np.linspace(at[0], at[-1], wanted + 1)[1:-1]
    place = np.searchsorted(edges, at, side="right")
    count = np.bincount(place, minlength=wanted)
    filled = count > 0
    weight = count[filled]
    return (
        np.bincount(place, at, minlength=wanted)[filled] / weight,
        np.bincount(place, values, minlength=wanted)[filled] / weight,
    )


def columns(slip: Float, degree: int, decays: tuple[float, ...] = ()) -> Float:
    """Columns of a fit: powers of slip and exponentials that decay from zero slip, (n, p)."""
    made = [slip**power for power in range(degree + 1)]
    made += [np.exp(-np.abs(slip) / decay) for decay in decays]
    return np.stack(made, axis=1)


def fit_trend(matrix: Float, values: Float) -> TrendFit:
    """Fit a segment.

    Parameters
    ----------
    matrix : array, (n, p)
        From `columns`.
    values : array, (n,)
        Bin means of friction.
    """
    scale = np.abs(matrix).max(axis=0)
    scale[scale == 0] = 1.0
    scaled = matrix / scale
    inverse = np.linalg.pinv(scaled.T @ scaled, hermitian=True)
    beta = inverse @ (scaled.T @ values)
    variance, dof = slow_variance(values - scaled @ beta, scaled)
    return TrendFit(beta / scale, inverse / np.outer(scale, scale), variance, dof)


def slow_variance(residual: Float, matrix: Float, *, grows: bool = True) -> tuple[float, int]:
    """Variance per bin of white noise as strong as the slow noise, and its degrees of freedom.

    Parameters
    ----------
    residual : array, (n,)
    matrix : array, (n, p)
        The fitted columns, which have absorbed part of the noise.
    grows : bool
        Whether noise that grows towards zero is extrapolated to there.
    """
    n, taken = matrix.shape
    count = max(1, min(_COSINES, (n - taken) // 4))
    most = min(n - 1, 3 * count + taken)
    if most <= taken:
        return float(np.mean(residual**2)), 1
    order = np.arange(1, most + 1)[:, None]
    waves = np.cos(np.pi * order * (np.arange(n) + 0.5) / n).T
    together = np.concatenate([matrix, waves], axis=1)
    gram = together.T @ together
    # Cosines nearly span a trend: the remainder of the last cosines must exceed rounding errors.
    gram[np.diag_indices_from(gram)] *= 1 + 1e-10
    projections = np.linalg.solve(np.linalg.cholesky(gram), together.T @ residual)
    power = np.asarray(projections[taken:] ** 2, dtype=np.float64)
    # The fitted columns have absorbed the strongest part of noise that grows towards zero.
    lines = np.arange(1, power.size + 1) + taken / 2
    exponent = red_exponent(lines, power, _LOG_SCATTER) if grows else np.zeros(())
    return float(power[:count].mean() / np.mean(lines[:count] ** -exponent)), count
