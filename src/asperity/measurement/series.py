"""Slow series of a recording: block means, their steady part, and a mean with its uncertainty."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Array = NDArray[np.float64]

#: Cosine transforms that say how noisy a mean is; twice the root of twice as many is its own doubt.
_COSINES = 8
_MOST_BLOCKS = 512
#: Probability at which noise explains that two rates differ.
_ACCIDENT = 3e-3


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


def block_means(values: Array, blocks: int) -> Array:
    """Means of about so many runs of equally many samples; a short run at the end is left out."""
    length = max(1, values.size // blocks)
    whole = values.size // length
    return values[: whole * length].reshape(whole, length).mean(1)


def mean_level(time: Array, values: Array) -> MeanLevel:
    """Mean of a stretch, correlated noise honoured.

    Parameters
    ----------
    time, values : array, (n,)

    Notes
    -----
    The variance of the mean is that of the first type-II cosine transforms of the series, which
    see the same slow noise as the mean does (equal-weighted cosines: Mueller, J. Econometrics 141,
    1331, 2007). A slow drift counts as noise.
    """
    means = block_means(values, _MOST_BLOCKS)
    n = means.size
    cosines = min(_COSINES, n - 1)
    if cosines < 1:
        return MeanLevel(float(values.mean()), np.inf, 1.0, float(time[0]), float(time[-1]))
    at = (np.arange(n) + 0.5) * np.pi / n
    waves = np.cos(np.arange(1, cosines + 1)[:, None] * at)
    transform = waves @ (means - means.mean()) * np.sqrt(2.0) / n
    spread = float(np.sqrt(np.mean(transform**2)))
    return MeanLevel(float(values.mean()), spread, float(cosines), float(time[0]), float(time[-1]))


def steady_from(values: Array, degree: int) -> int:
    """Where a series has forgotten its beginning: index of the first value to keep.

    The start is cut where what is left determines its mean best, by the marginal standard error
    rule (White, Simulation 69, 323, 1997), about a drift of the given degree; of starts that
    noise cannot tell apart, the earliest. At most half is cut.

    Parameters
    ----------
    values : array, (n,)
        About a hundred.
    degree : int
        Of the drift that is no transient.
    """
    n = values.size
    if n < 8:
        return 0
    errors = []
    for cut in range(n // 2 + 1):
        rest = values[cut:]
        u = np.linspace(-1, 1, rest.size)
        columns = np.polynomial.legendre.legvander(u, degree)
        beta = np.linalg.lstsq(columns, rest)[0]
        spread = np.sum((rest - columns @ beta) ** 2) / (rest.size - degree - 1)
        errors.append(spread / rest.size)
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
