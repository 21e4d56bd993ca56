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
#: Lines above zero that tell a power law.
_ABOVE_ZERO = 48
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
        lines = free_lines(k, periods, basis, samples, blocks.count.size)
        if lines.size < 2 * _FEWEST:
            spectra[k], dof[k] = white, max(samples - basis.linear - 1, 1.0)
            continue
        angle = 2 * np.pi * (lines[:, None] - k * periods) * at
        turned = (np.cos(angle) - 1j * np.sin(angle)) @ residual[:, k]
        near = turned if k else turned[: 2 * _NEXT_TO_ZERO]
        spectra[k] = near.T @ near.conj() / (near.shape[0] * samples)
        # Two numbers a line; the halves between lines repeat what their neighbours say.
        dof[k] = near.shape[0]
        if not k:
            grown = np.sqrt(_growth(lines, turned))
            spectra[k] *= grown[:, None] * grown
    return LocalNoise(spectra, dof)


def _growth(lines: Array, turned: Complex) -> Array:
    """How much stronger noise is below the lowest lines than in them; (channels,).

    Noise that grows towards zero, as 1/f noise does, moves the mean more than any line that can be
    seen: its power law is followed down to a third of a line, where a mean has what 1/f noise has
    brought since it began a few windows ago.
    """
    away = np.log(lines) - np.log(lines).mean()
    lever = max(float(away @ away), 1e-300)
    exponent = -(away @ np.log(np.maximum(np.abs(turned) ** 2, 1e-300))) / lever
    # The log of a periodogram's line scatters by 1.28, and only half of the lines are new.
    scatter = 1.28 * np.sqrt(2.0 / lever)
    # White noise has no exponent but by chance; what is steeper than 1/f is no noise but motion.
    exponent = np.where(exponent > 2.5 * scatter, np.minimum(exponent, 1.0), 0.0)
    lowest = lines[: 2 * _NEXT_TO_ZERO, None]
    return np.asarray((1 / 3.0) ** -exponent / np.mean(lowest**-exponent, axis=0))


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
    wanted = _AROUND_HARMONIC if k else _ABOVE_ZERO
    # Of lines between harmonics most are free, unless there are hardly any between them.
    reach = min(blocks / 8, 3.0 * wanted + (2.0 * basis.harmonics * periods if periods < 64 else 0))
    first = max(1.0 + (basis.degree > 0), k * periods - reach)
    last = min(samples / 2 - 1, k * periods + reach)
    # Halves of lines, counted from the harmonic: what is far off, such as hum, reaches wholes or
    # halves, as it reaches the harmonic or its derivative; whole periods of it would hide it.
    away = np.arange(np.ceil(2 * (first - k * periods)), 2 * (last - k * periods) + 1e-9) / 2
    lines = k * periods + away
    nearest = np.clip(np.rint(lines / periods), 0, basis.harmonics)
    near = 0.9 if periods < 8 else 1.2
    free = (np.abs(lines - periods * nearest) > near) | (lines < periods / 2)
    lines = lines[free]
    return lines[np.argsort(np.abs(lines - k * periods), kind="stable")[: 2 * wanted]]


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
