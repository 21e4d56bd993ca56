"""What an estimated noise adds to the uncertainty of parameters.

The covariance of generalised least squares is that under known noise. The coefficients of the noise
are estimated from the same samples: estimates vary with them (Kackar and Harville, J. Am. Stat.
Assoc. 79, 853, 1984), and so does the covariance itself, whose degrees of freedom (Satterthwaite,
Biometrics Bull. 2, 110, 1946) Student's t needs; both as Kenward and Roger (Biometrics 53, 983,
1997) put them together, for noise that is autoregressive.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from asperity.inference.runs.noise import Autoregression

Float = NDArray[np.float64]

#: Samples whose derivatives are held at once.
_CHUNK = 4096


def added_by_noise(
    model: Autoregression, curves: Float, nuisances: Float, covariance: Float
) -> tuple[Float, Float]:
    """Covariance that estimated coefficients add, and the variance of the one without it.

    Parameters
    ----------
    model : Autoregression
        Estimated from a stretch of n samples.
    curves : array, shape (n, parameters)
        Derivatives of the signal to the parameters, less what linear nuisances take of them.
    nuisances : array, shape (n, columns)
        Whitened linear nuisances, orthonormal over all samples of the recording.
    covariance : array, shape (parameters, parameters)
        Of the parameters under known noise, by all data and priors.

    Returns
    -------
    added : array, shape (parameters, parameters)
    variance : array, shape (parameters,)
        Of the diagonal of `covariance`, as the noise of this stretch is estimated.

    Notes
    -----
    With the whitening W of the noise, dW/da_k = -B^k/s for the lag B, and the covariance S of the
    noise, (dS^-1/da_k) S (dS^-1/da_l) = W^T G_k^T G_l W with G_k = B^k W^-1/s and its transpose
    added. Coefficients have the covariance s^2/n times the inverse of the autocovariances.
    """
    n, p = curves.shape[0], model.order
    white = model.whiten(curves)
    weights = white @ covariance
    # The scale of the noise, with so many samples left to estimate it.
    left = max(n - curves.shape[1] - nuisances.shape[1] - p, 1)
    variance = 2 / left * np.einsum("ij,ij->j", weights, weights) ** 2
    if not p:
        return np.zeros_like(covariance), variance
    s = model.innovation
    lagged = toeplitz(model.autocovariances(p))
    root = np.linalg.cholesky(s**2 / n * np.linalg.inv(lagged))
    a = np.concatenate([[1.0], -model.coefficients[-1]])
    before = np.vstack([np.zeros((p, covariance.shape[0])), curves @ covariance])
    ahead = lfilter([1.0], a, weights[::-1], axis=0)[::-1]
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
