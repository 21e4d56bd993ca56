"""Noise of a reading, from the residual's own spectrum around each harmonic.

What disturbs the amplitude at a frequency is the noise at that frequency. The variance of a
column's coefficient is therefore taken from the periodogram of the residual in the nearest lines
of the window that the fit does not touch, and not from the mean square of all of it: for white
noise that is the textbook's formula, for coloured noise it is right where the textbook is not.
Lines that are averaged count as degrees of freedom, two each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.instrument.lock_in_basis import Basis
from asperity.instrument.lock_in_blocks import Blocks

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Lines averaged around a harmonic and next to zero; more are steadier, fewer are more local.
_AROUND_HARMONIC = 20
_NEXT_TO_ZERO = 6
#: Fewer lines than this say nothing: then noise is taken for white.
_FEWEST = 4


@dataclass(frozen=True)
class LocalNoise:
    """The variance that white noise would need to have, to be as strong as the noise at k f.

    Attributes
    ----------
    spectra : complex array, (n + 1, channels, channels)
        Hermitian, for k = 0..n; in the channels' units squared.
    dof : array, (n + 1,)
        Degrees of freedom.
    """

    spectra: Complex
    dof: Array


def residual_sums(blocks: Blocks, beta: Array) -> Complex:
    """Sums of residual times e^(-i k phi) over each block.

    Parameters
    ----------
    blocks : Blocks
    beta : array, (size, channels)
        What the fit has found.

    Returns
    -------
    complex array, (blocks, n + 1, channels)
    """
    n, first = blocks.basis.harmonics, blocks.basis.drift
    left = blocks.moments - blocks.gram @ beta
    cosine, sine = left[:, first : first + n], left[:, first + n : first + 2 * n]
    return np.concatenate([left[:, :1].astype(complex), cosine - 1j * sine], axis=1)


def local_noise(blocks: Blocks, residual: Complex, white: Array) -> LocalNoise:
    """Noise around each harmonic.

    Parameters
    ----------
    blocks : Blocks
    residual : complex array, (blocks, n + 1, channels)
        From `residual_sums`.
    white : array, (channels, channels)
        Covariance of the residual, for windows too short to tell frequencies apart.
    """
    basis, samples = blocks.basis, float(blocks.count.sum())
    periods = basis.omega * basis.half_width / np.pi
    # Each block stands at its middle, in units of the window's length.
    at = (blocks.middle - basis.centre) / (2 * basis.half_width)
    spectra = np.empty((basis.harmonics + 1, white.shape[0], white.shape[0]), dtype=complex)
    dof = np.empty(basis.harmonics + 1)
    for k in range(basis.harmonics + 1):
        nearest = free_lines(k, periods, basis, samples, blocks.count.size) - k * periods
        if nearest.size < _FEWEST:
            spectra[k], dof[k] = white, max(samples - basis.linear - 1, 1.0)
            continue
        angle = 2 * np.pi * nearest[:, None] * at
        turned = (np.cos(angle) - 1j * np.sin(angle)) @ residual[:, k]
        spectra[k] = turned.T @ turned.conj() / (nearest.size * samples)
        dof[k] = 2 * nearest.size
    return LocalNoise(spectra, dof)


def free_lines(k: int, periods: float, basis: Basis, samples: float, blocks: int) -> Array:
    """Numbers of the window's spectral lines next to a harmonic that the fit leaves alone.

    Parameters
    ----------
    k : int
        Harmonic, 0 for the mean.
    periods : float
        Of the modulation in the window.
    basis : Basis
    samples : float
        Below half of them lies the Nyquist frequency.
    blocks : int
        Lines farther from their harmonic than an eighth of them are smoothed away in the blocks.
    """
    wanted = _AROUND_HARMONIC if k else _NEXT_TO_ZERO
    # Of lines between harmonics most are free, unless there are hardly any between them.
    reach = min(blocks / 8, 3.0 * wanted + (2.0 * basis.harmonics * periods if periods < 64 else 0))
    first = max(1.0 + (basis.degree > 0), np.ceil(k * periods - reach))
    last = min(samples / 2 - 1, k * periods + reach)
    lines = np.arange(first, last + 0.5)
    nearest = np.clip(np.rint(lines / periods), 0, basis.harmonics)
    near = 0.9 if periods < 8 else 1.2
    free = (np.abs(lines - periods * nearest) > near) | (lines < periods / 2)
    lines = lines[free]
    return lines[np.argsort(np.abs(lines - k * periods), kind="stable")[:wanted]]


def column_harmonics(basis: Basis) -> NDArray[np.intp]:
    """Which harmonic each column of the basis belongs to, 0 for the drift; (size,)."""
    k = np.arange(1, basis.harmonics + 1)
    return np.concatenate([np.zeros(basis.drift, dtype=np.intp), k, k, k, k])


def quadrature(basis: Basis) -> Array:
    """The matrix that turns cos into sin and sin into -cos, (size, size); the drift has none."""
    n = basis.harmonics
    turn = np.zeros((basis.size, basis.size))
    for first in (basis.drift, basis.linear):
        k = first + np.arange(n)
        turn[k + n, k] = 1.0
        turn[k, k + n] = -1.0
    return turn


def sum_covariance(
    basis: Basis, gram: Array, noise: LocalNoise, columns: tuple[Array, Array]
) -> Array:
    """Covariance of the sums of noise times columns, for two channels.

    Parameters
    ----------
    basis : Basis
    gram : array, (size, size)
        Of the whole window.
    noise : LocalNoise
    columns : (array (size, p), array (size, q))
        Coefficients of the columns that each channel is summed with; each lies at one harmonic.

    Returns
    -------
    array, (p + q, p + q)
    """
    of_column = column_harmonics(basis)
    k = [of_column[np.argmax(np.abs(c), axis=0)] for c in columns]
    turned = quadrature(basis)
    rows = []
    for a in (0, 1):
        row = []
        for b in (0, 1):
            product = columns[a].T @ gram @ columns[b]
            if a == b:
                level = np.sqrt(noise.spectra[k[a], a, a].real)
                row.append(level[:, None] * product * level)
                continue
            # Channels share noise at one harmonic only: in phase by the real part of the
            # cross-spectrum, in quadrature by the imaginary one.
            cross = noise.spectra[k[a], a, b][:, None]
            across = (turned @ columns[a]).T @ gram @ columns[b]
            same = k[a][:, None] == k[b]
            row.append(np.where(same, cross.real * product + cross.imag * across, 0.0))
        rows.append(np.hstack(row))
    whole = np.vstack(rows)
    # In part periods a quadrature and its transpose differ by as much as columns overlap.
    return (whole + whole.T) / 2
