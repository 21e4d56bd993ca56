"""Noise of a recording: autoregressive, of an order chosen by the data, and its whitening.

The residual of a fit is a stretch of noise e_t with e_t = sum_k a_k e_(t-k) + s n_t, n_t normal and
independent. Coefficients are estimated by Burg's method, which also gives every lower order and
always a stationary process; the order is that of the lowest AICc, but at least 10 log10 n, since an
order that is too low makes intervals too narrow, and one that is too high costs little. The first
samples are predicted by the lower orders, so that the likelihood is that of all samples.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from asperity.arrays import Float

#: Highest order, as a number and as a share of the samples.
_HIGHEST, _SHARE = 60, 0.05
#: The order is at least this times the decimal logarithm of the number of samples (Berk, Ann. Stat.
#: 2, 489, 1974): what matters is the spectrum at low frequency, and criteria choose for all of it.
_ORDERS_PER_DECADE = 10
#: Innovations below this share of the power are lost in the rounding of sums over all samples.
_SMOOTH = 1e-6


class Whitening(NamedTuple):
    """Innovations of noise as a linear function of its samples, of NumPy and of JAX arrays.

    Attributes
    ----------
    taps : array, shape (p + 1,)
        Weights of a sample and of the samples before it.
    first : array, shape (p, p)
        Weights of the first samples, before which lower orders predict.
    """

    taps: Any
    first: Any

    def of(self, x: Any, module: Any = np) -> Any:
        """Innovations of unit variance along the first axis, of shape (n,) or (n, columns).

        Parameters
        ----------
        x : array
        module : module
            numpy, or jax.numpy within compiled programs.
        """
        n = x.shape[0]
        p = min(self.first.shape[0], n)
        columns = x.reshape(n, -1)
        later = [module.convolve(column, self.taps)[p:n] for column in columns.T]
        white = module.concatenate([self.first[:p, :p] @ columns[:p], module.stack(later, axis=-1)])
        return white.reshape(x.shape)

    def transposed(self, white: Float) -> Float:
        """The transpose of `of`: products of innovations with those of an impulse at each sample.

        Parameters
        ----------
        white : array, shape (n,) or (n, columns)
        """
        n, p = white.shape[0], min(self.first.shape[0], white.shape[0])
        columns = white.reshape(n, -1).copy()
        first, columns[:p] = self.first[:p, :p].T @ columns[:p], 0.0
        ends = np.concatenate([columns, np.zeros((self.taps.size - 1, columns.shape[1]))])
        result = np.stack([np.correlate(x, self.taps, mode="valid") for x in ends.T], axis=-1)
        result[:p] += first
        return result.reshape(white.shape)

    def squares(self, n: int) -> Float:
        """Sums of the squared innovations of an impulse at each of n samples."""
        p = min(self.first.shape[0], n)
        # Innovations from the first p samples on have the weights of the highest order.
        before = np.concatenate([[0.0], np.cumsum(self.taps**2)])
        at = np.arange(n)
        result = before[np.minimum(n - at, self.taps.size)] - before[np.maximum(p - at, 0)]
        result[:p] += np.sum(self.first[:p, :p] ** 2, axis=0)
        return np.asarray(result)


@dataclass(frozen=True, eq=False)
class Autoregression:
    """A stationary autoregressive process.

    Attributes
    ----------
    reflection : array, shape (p,)
        Partial correlations; the process is stationary as all are inside (-1, 1).
    variance : float
        Variance of the process itself.
    """

    reflection: Float
    variance: float

    @property
    def order(self) -> int:
        """Number of coefficients."""
        return self.reflection.size

    @property
    def innovation(self) -> float:
        """Standard deviation of a sample if all samples before it are known."""
        return math.sqrt(self.variance * float(np.prod(1 - self.reflection**2)))

    @functools.cached_property
    def coefficients(self) -> list[Float]:
        """Coefficients a_k of the predictors of every order up to that of the process."""
        orders = [np.zeros(0)]
        for k in self.reflection:
            a = orders[-1]
            orders.append(np.append(a - k * a[::-1], k))
        return orders

    def whiten(self, columns: Float) -> Float:
        """Innovations of unit variance of samples along the first axis."""
        return np.asarray(self.whitening.of(np.asarray(columns, float)))

    @property
    def whitening(self) -> Whitening:
        """The linear function from samples to innovations."""
        taps = np.concatenate([[1.0], -self.coefficients[-1]]) / self.innovation
        return Whitening(taps, self._first_taps)

    @functools.cached_property
    def _first_taps(self) -> Float:
        """Weights of the predictors of lower order for the first samples, shape (p, p)."""
        result = np.zeros((self.order, self.order))
        scale = self.variance
        for t, (b, partial) in enumerate(zip(self.coefficients, self.reflection, strict=False)):
            result[t, : t + 1] = np.concatenate([-b[::-1], [1.0]]) / math.sqrt(scale)
            scale *= 1 - partial**2
        return result

    def departures_of_single_samples(self, white: Float) -> Float:
        """Difference of each sample from its prediction by all others, in standard deviations.

        Parameters
        ----------
        white : array, shape (n,)
            Innovations.

        Notes
        -----
        The estimate of a spike at each sample over its standard error (Fox, J. R. Stat. Soc. B
        34, 350, 1972).
        """
        impulse = self.whitening
        return impulse.transposed(white) / np.sqrt(impulse.squares(white.size))

    def log_scale(self, n: int) -> float:
        """Sum of the logarithms of the standard deviations of the innovations of n samples."""
        logs = np.log1p(-(self.reflection**2))
        ahead = np.cumsum(np.concatenate([[0.0], logs]))
        first = ahead[: min(n, self.order)]
        later = max(n - self.order, 0) * ahead[-1]
        return 0.5 * (n * math.log(self.variance) + float(first.sum()) + float(later))

    def spectrum(self, frequency: Float) -> Float:
        """Power per frequency in cycles a sample, two-sided; it integrates to the variance."""
        a = self.coefficients[-1]
        k = np.arange(1, self.order + 1)
        transfer = 1 - np.exp(-2j * np.pi * np.outer(frequency, k)) @ a
        return np.asarray(self.innovation**2 / np.abs(transfer) ** 2)

    def effective_samples(self, n: int) -> float:
        """Number of independent samples whose mean has the variance of the mean of n samples."""
        return min(float(n), n * self.variance / float(self.spectrum(np.zeros(1))[0]))


def fitted(
    stretches: Sequence[Float],
    *,
    order: int | None = None,
    parameters: int = 0,
    uncertain: Sequence[Float] | None = None,
) -> Autoregression:
    """Autoregressive process of one or more stretches of noise, by Burg's method.

    Parameters
    ----------
    stretches : sequence of array
        Noise, evenly sampled, of one process.
    order : int, optional
        By default the order of the lowest AICc, but at least 10 log10 n.
    parameters : int
        That were fitted to the same samples: the variance is larger than that of the residual.
    uncertain : sequence of array, shape (columns, samples of the stretch), optional
        A root of the covariance of the fitted curve, which a fit has removed from the noise.

    Notes
    -----
    A fit takes off what resembles its curves, slow noise above all. With `uncertain`, the moments
    are those that the noise is expected to have given the residual, which is a step of the EM
    algorithm for the restricted likelihood (Patterson and Thompson, Biometrika 58, 545, 1971;
    Laird and Ware, Biometrics 38, 963, 1982).
    """
    n = sum(s.size for s in stretches)
    highest = order if order is not None else min(_HIGHEST, int(_SHARE * n))
    highest = min(highest, max(0, min(s.size for s in stretches) - 2))
    more = uncertain if uncertain is not None else [np.zeros((0, s.size)) for s in stretches]
    rows = [np.vstack([s, u]) for s, u in zip(stretches, more, strict=True)]
    # A recording made by a formula has no noise.
    smallest = np.finfo(float).tiny
    variance = max(sum(float(np.sum(r * r)) for r in rows) / n, smallest)
    reflection = _reflections(rows, highest)
    criteria = [n * math.log(variance) + 2]
    innovation_power = variance
    for k, partial in enumerate(reflection, start=2):
        innovation_power *= 1 - partial * partial
        penalty = 2 * k + 2 * k * (k + 1) / max(n - k - 1, 1)
        criteria.append(n * math.log(max(innovation_power, smallest)) + penalty)
    best = len(reflection)
    if order is None:
        # A lower order smooths the spectrum of slow noise too much.
        lowest = round(_ORDERS_PER_DECADE * math.log10(n))
        best = min(best, max(int(np.argmin(criteria)), lowest))
    chosen = np.array(reflection[:best])
    result = Autoregression(chosen, variance)
    # The variance of the likelihood: innovations of unit mean square.
    white = np.concatenate([result.whiten(s) for s in stretches])
    left = max(n - parameters - best, 1)
    return Autoregression(chosen, max(variance * float(white @ white) / left, smallest))


def _reflections(stretches: Sequence[Float], highest: int) -> list[float]:
    """Partial correlations of stretches of rows by Burg's method, up to the highest order."""
    products = [LaggedProducts(rows, highest) for rows in stretches]
    power = innovation_power = sum(p.power for p in products)
    predictor = np.ones(1)
    result: list[float] = []
    while len(result) < highest:
        if innovation_power <= _SMOOTH * power:
            return _reflections_of_smooth(stretches, highest)
        for p in products:
            p.next_order()
        table = sum(p.table for p in products)
        forward, backward = np.append(predictor, 0.0), np.append(0.0, predictor[::-1])
        along = table @ backward
        partial = 2 * float(forward @ along) / float(forward @ table @ forward + backward @ along)
        result.append(_inside(partial))
        predictor = forward - result[-1] * backward
        innovation_power *= 1 - result[-1] ** 2
    return result


class LaggedProducts:
    """Sums over time of the products of samples at two lags, of one order after the other.

    Burg's method needs these sums only; one Fourier transform of each row gives all of them. A fit
    needs them hundreds of times for dozens of rows.

    Attributes
    ----------
    sums : array, shape (highest + 1,)
        Sums of the products of all samples with the samples at a lag.
    power : float
        Sum of all squares.
    table : array, shape (m + 1, m + 1)
        Of order m: sums over the rows and over t = m ... n - 1 of x[t - i] x[t - j].
    """

    def __init__(self, rows: Float, highest: int) -> None:
        self._first, self._last = rows[:, :highest], rows[:, ::-1][:, :highest]
        length = next_fast_len(rows.shape[1] + highest, real=True)
        spectrum = np.zeros(length // 2 + 1)
        for row in rows:
            transform = rfft(row, length)
            spectrum += transform.real**2 + transform.imag**2
        self.sums = irfft(spectrum, length)[: highest + 1]
        self.power = float(self.sums[0])
        self.table = np.array([[self.power]])

    def next_order(self) -> None:
        """Go on to the next order."""
        m = len(self.table)
        first, last = self._first[:, :m][:, ::-1], self._last[:, :m]
        first_row = self.table[-1] - last[:, -1] @ last
        inner = self.table - first.T @ first
        self.table = np.empty((m + 1, m + 1))
        self.table[:m, :m] = inner
        self.table[m, 0] = self.sums[m]
        self.table[m, 1:] = first_row
        self.table[:m, m] = self.table[m, :m]


def _reflections_of_smooth(stretches: Sequence[Float], highest: int) -> list[float]:
    """`_reflections` from the prediction errors of each sample: less rounding error."""
    forward, backward = list(stretches), list(stretches)
    result: list[float] = []
    for _ in range(highest):
        ahead = [f[:, 1:] for f in forward]
        behind = [b[:, :-1] for b in backward]
        power = sum(_dot(f, f) + _dot(b, b) for f, b in zip(ahead, behind, strict=True))
        if power <= 0:
            break
        k = _inside(2 * sum(_dot(f, b) for f, b in zip(ahead, behind, strict=True)) / power)
        forward = [f - k * b for f, b in zip(ahead, behind, strict=True)]
        backward = [b - k * f for f, b in zip(ahead, behind, strict=True)]
        result.append(k)
    return result


def _inside(partial: float) -> float:
    return min(max(partial, -1 + 1e-9), 1 - 1e-9)


def _dot(a: Float, b: Float) -> float:
    # For such short sums the synchronisation of BLAS threads takes longer than the sum.
    return float(np.einsum("ij,ij->", a, b))
