"""Innovations of the noise of a recording, tests of them, and the uncertainty of the noise.

Innovations are independent and normal with unit variance if law and noise are right. A wrong law,
gauge or drive shows in the samples after changes of the drive, and a wrong sample in all
innovations that contain it.

The covariance of generalised least squares holds for known noise. The coefficients of the noise are
estimated from the same samples. The estimates vary with these coefficients (Kackar and Harville, J.
Am. Stat. Assoc. 79, 853, 1984), and so does the covariance, whose degrees of freedom
(Satterthwaite, Biometrics Bull. 2, 110, 1946) enter Student's t. Both effects are combined as by
Kenward and Roger (Biometrics 53, 983, 1997), for autoregressive noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.linalg import solve_banded
from scipy.special import chdtrc, ndtri

from asperity.arrays import Float
from asperity.recording.defects.autoregression import Autoregression, LaggedProducts, Whitening

#: Smallest number of lags in the test of whiteness.
_LAGS = 20


def innovations(
    columns: Any,
    noise: Sequence[Whitening],
    stretches: Sequence[tuple[int, int]],
    basis: Any = None,
    module: Any = np,
) -> Any:
    """Innovations of unit variance, with linear nuisances projected out.

    Parameters
    ----------
    columns : array, shape (n,) or (n, columns)
        Computed less recorded friction, and its derivatives; NumPy or JAX arrays.
    noise : sequence of Whitening
        Noise of each stretch.
    stretches : sequence of (int, int)
    basis : array, shape (n, nuisances), optional
        Whitened linear nuisances, orthonormal.
    module : module
        numpy, or jax.numpy within compiled programs.
    """
    parts = [w.of(columns[a:b], module) for w, (a, b) in zip(noise, stretches, strict=True)]
    white = module.concatenate(parts)
    return white if basis is None else white - basis @ (basis.T @ white)


def whiteness(innovations: Sequence[Float], fitted_order: int) -> float:
    """Probability of larger autocorrelations by chance (Ljung and Box, Biometrika 65, 297, 1978).

    Parameters
    ----------
    innovations : sequence of array
    fitted_order : int
        Number of coefficients that were estimated from the same samples.
    """
    n = sum(x.size for x in innovations)
    lags = min(max(_LAGS, 2 * fitted_order), n // 4)
    products = sum(LaggedProducts(x[None], lags).sums for x in innovations)
    r = products[1 : lags + 1] / products[0]
    q = float(np.sum(r**2 / (n - np.arange(1, lags + 1))))
    return float(chdtrc(max(lags - fitted_order, 1), n * (n + 2) * q))


#: Probability that noise is mistaken for a wrong sample, anywhere in a recording.
_CHANCE = 1e-3
#: Largest number of successive wrong samples. More are a motion that the law does not describe: an
#: unstated lag of the gauge of up to 4 samples leaves 6 to 9 successive wrong samples in 5 of 10
#: recordings of load steps.
_IN_A_ROW = 3
#: A sample has no influence if the fitted curves leave a smaller share of its innovations.
_EXPLAINED = 1e-6


def largest_departure(n: int) -> float:
    """Departure (standard deviations) that noise exceeds in one of 1,000 sets of n samples."""
    return -float(ndtri(_CHANCE / (2 * n)))


def wrong_samples(
    white: Float,
    curves: Float,
    noise: Sequence[Whitening],
    stretches: Sequence[tuple[int, int]],
    most: int,
) -> list[int]:
    """Indices of single samples that neither the motion nor its noise explains, in rising order.

    Parameters
    ----------
    white : array, shape (n,)
        Innovations of computed less recorded friction.
    curves : array, shape (n, columns)
        Innovations of the derivatives of the motion, and of linear nuisances.
    noise : sequence of Whitening
        Noise of each stretch.
    stretches : sequence of (int, int)
    most : int
        The search ends with one more than this number; successive samples are then included.

    Notes
    -----
    The test statistic is the size of an impulse at each sample over its standard error (an additive
    outlier of Fox, J. R. Stat. Soc. B 34, 350, 1972). All curves are refitted with the impulse, and
    the sample does not count for the scale of the noise. The largest impulse is removed before the
    next is searched, because it hides others.
    Student's t in place of normal innovations would not help: a wrong sample changes as many
    innovations as the order of the noise.
    """
    basis = np.linalg.qr(curves)[0]
    white = white - basis @ (basis.T @ white)
    squares = np.concatenate([w.squares(b - a) for w, (a, b) in zip(noise, stretches, strict=True)])
    left = squares - np.sum(_at_samples(basis, noise, stretches) ** 2, axis=1)
    limit = largest_departure(white.size) ** 2
    free = white.size - basis.shape[1] - 1
    wrong: list[int] = []
    while free > 0 and len(wrong) <= most:
        unknown = left <= _EXPLAINED * squares
        decrease = _at_samples(white, noise, stretches) ** 2 / np.where(unknown, np.inf, left)
        k = int(np.argmax(decrease))
        if decrease[k] * free <= limit * (white @ white - decrease[k]):
            break
        wrong.append(k)
        impulse = innovations(np.eye(1, white.size, k)[0], noise, stretches, basis)
        impulse /= np.sqrt(impulse @ impulse)
        basis, free = np.column_stack([basis, impulse]), free - 1
        white = white - impulse * (impulse @ white)
        left -= _at_samples(impulse, noise, stretches) ** 2
    rows = np.sort(np.array(wrong, np.intp))
    groups = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    longest = _IN_A_ROW if rows.size <= most else rows.size
    return [int(k) for group in groups if group.size <= longest for k in group]


def _at_samples(
    white: Float, noise: Sequence[Whitening], stretches: Sequence[tuple[int, int]]
) -> Float:
    """Inner products with the innovations of an impulse at each sample."""
    return np.concatenate(
        [w.transposed(white[a:b]) for w, (a, b) in zip(noise, stretches, strict=True)]
    )


#: Numbers of samples after a change, and number before it, in which a misfit is searched: the time
#: of a change is uncertain.
_AFTER, _BEFORE = (5, 20, 80), 5


def misfit_after_changes(white: Float, first: Sequence[int]) -> tuple[float, float]:
    """Probability of innovations as large as those after changes of the drive, and their size.

    Parameters
    ----------
    white : array, shape (n,)
    first : sequence of int
        First sample after each change.

    Returns
    -------
    (float, float)
        Lowest probability of chi-squared over the tested spans; root mean square of the innovations
        in that span, over that of all other innovations.
    """
    lowest, size = 1.0, 1.0
    for span in _AFTER:
        inside = np.zeros(white.size, bool)
        for k in first:
            inside[max(k - _BEFORE, 0) : k + span] = True
        if not inside.any() or inside.mean() > 0.25:
            continue
        other = float(np.mean(white[~inside] ** 2))
        ratio = float(np.mean(white[inside] ** 2)) / max(other, 1e-300)
        chance = float(chdtrc(int(inside.sum()), ratio * inside.sum()))
        if chance < lowest:
            lowest, size = chance, ratio**0.5
    return min(1.0, len(_AFTER) * lowest), size


#: Number of samples whose derivatives are computed at once.
_CHUNK = 4096


def added_by_noise(
    model: Autoregression, curves: Float, nuisances: Float, covariance: Float
) -> tuple[Float, Float]:
    """Covariance added by estimated noise coefficients, and variance of the covariance itself.

    Parameters
    ----------
    model : Autoregression
        Noise estimated from a stretch of n samples.
    curves : array, shape (n, parameters)
        Derivatives of the signal in the parameters, with linear nuisances projected out.
    nuisances : array, shape (n, columns)
        Whitened linear nuisances, orthonormal over all samples of the recording.
    covariance : array, shape (parameters, parameters)
        Covariance of the parameters under known noise, by all data and priors.

    Returns
    -------
    added : array, shape (parameters, parameters)
    variance : array, shape (parameters,)
        Variance of the diagonal of `covariance`, due to the estimated noise of this stretch.

    Notes
    -----
    With the whitening W of the noise, dW/da_k = -B^k/s for the lag B, and the covariance S of the
    noise, (dS^-1/da_k) S (dS^-1/da_l) = W^T G_k^T G_l W with G_k = B^k W^-1/s and its transpose
    added. Coefficients have the covariance s^2/n times the inverse of the autocovariances.
    """
    n, p = curves.shape[0], model.order
    white = model.whiten(curves)
    weights = white @ covariance
    # The variance of the scale, from the remaining degrees of freedom.
    left = max(n - curves.shape[1] - nuisances.shape[1] - p, 1)
    variance = 2 / left * np.einsum("ij,ij->j", weights, weights) ** 2
    if not p:
        return np.zeros_like(covariance), variance
    s = model.innovation
    # The whitening of the first p samples is a root of the inverse of their autocovariances.
    root = s / np.sqrt(n) * model.whitening.first.T
    a = np.concatenate([[1.0], -model.coefficients[-1]])
    before = np.vstack([np.zeros((p, covariance.shape[0])), curves @ covariance])
    bands = np.repeat(a[:, None], n, axis=1)
    ahead = solve_banded((p, 0), bands, weights[::-1])[::-1]
    ahead = np.vstack([ahead, np.zeros((p + 1, covariance.shape[0]))])
    square = np.zeros_like(covariance)
    along = np.zeros((p, covariance.shape[0]))
    on_curves = np.zeros((covariance.shape[0], covariance.shape[0], p))
    on_nuisances = np.zeros((nuisances.shape[1], covariance.shape[0], p))
    for first in range(0, n, _CHUNK):
        last = min(first + _CHUNK, n)
        rows = slice(first, last)
        past = sliding_window_view(before[first : last + p - 1], p, axis=0)[:, :, ::-1] / s
        future = sliding_window_view(ahead[first + 1 : last + p], p, axis=0)
        G = (past + future) @ root
        square += np.einsum("tik,tjk->ij", G, G, optimize=True)
        along += np.einsum("ti,tik->ki", weights[rows], G, optimize=True)
        on_curves += np.tensordot(white[rows], G, axes=(0, 0))
        on_nuisances += np.tensordot(nuisances[rows], G, axes=(0, 0))
    seen = np.einsum("aik,ab,bjk->ij", on_curves, covariance, on_curves, optimize=True)
    seen += np.einsum("cik,cjk->ij", on_nuisances, on_nuisances, optimize=True)
    return square - seen, variance + np.einsum("ki,ki->i", along, along)


def added_without(
    rows: Sequence[int],
    white: Float,
    covariance: Float,
    noise: Sequence[Whitening],
    stretches: Sequence[tuple[int, int]],
    basis: Float,
    least: float,
) -> tuple[Float, list[int]]:
    """Covariance added if some samples are unknown, and these samples.

    Parameters
    ----------
    rows : sequence of int
        Samples, each once.
    white : array, shape (n, parameters)
        Innovations of the derivatives of the signal, with linear nuisances projected out.
    covariance : array, shape (parameters, parameters)
        Of the parameters, by all data and priors.
    noise, stretches, basis
        As in `innovations`.
    least : float
        Samples are unknown from this leverage on: the share that a sample has in its own fitted
        value.
    """
    if not rows:  # no velocity changes
        return np.zeros_like(covariance), []
    impulses = innovations(np.eye(white.shape[0])[:, rows], noise, stretches, basis)
    impulses /= np.sqrt(np.einsum("ij,ij->j", impulses, impulses))
    along = impulses.T @ white
    leverage = np.einsum("ki,ij,kj->k", along, covariance, along)
    alone = np.flatnonzero(leverage > least)
    along = np.linalg.qr(impulses[:, alone])[0].T @ white
    # Woodbury: the information without the samples.
    left, directions = np.linalg.eigh(np.eye(alone.size) - along @ covariance @ along.T)
    root = covariance @ along.T @ (directions / np.sqrt(np.maximum(left, _EXPLAINED**2)))
    return root @ root.T, [rows[int(k)] for k in alone]
