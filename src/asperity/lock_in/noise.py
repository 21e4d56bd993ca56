"""Noise of a reading, from the spectrum of the residual around each harmonic.

The error of the amplitude at a frequency is the noise at that frequency. The variance of the
coefficient of a column is therefore the mean of the periodogram of the residual over the nearest
spectral lines that are free of fitted columns. The mean square of the residual would give the same
variance for white noise, and a wrong one for coloured noise. Each averaged line counts as two
degrees of freedom.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.arrays import Complex, Float, Index
from asperity.lock_in.normal_equations import Basis, BlockSums

#: Lines averaged around a harmonic and next to zero frequency.
_AROUND_HARMONIC = 20
_NEXT_TO_ZERO = 6
#: Lines above zero frequency to which a power law is fitted.
_ABOVE_ZERO = 48
#: With fewer lines than this, noise is assumed to be white.
_FEWEST = 4
#: Half lines for which powers of a phase are computed; others are products with coarser powers.
_FINE = 16


@dataclass(frozen=True)
class LocalNoise:
    """Noise at the harmonics k f, as the variance of white noise of the same strength.

    Attributes
    ----------
    spectra : complex array, (n + 1, channels, channels)
        Hermitian, for k = 0..n; in the channels' units squared.
    dof : array, (n + 1,)
        Degrees of freedom of each matrix.
    """

    spectra: Complex
    dof: Float


def residual_sums(blocks: BlockSums, beta: Float) -> Complex:
    """Sums of residual times e^(-i k phi) over each block.

    Parameters
    ----------
    blocks : BlockSums
    beta : array, (size, channels)
        Fitted coefficients.

    Returns
    -------
    complex array, (blocks, n + 1, channels)
    """
    return harmonic_sums(blocks.moments - blocks.gram @ beta, blocks.basis)


def harmonic_sums(sums: Float, basis: Basis) -> Complex:
    """Sums times e^(-i k phi), k = 0..n, from sums times the columns.

    Parameters
    ----------
    sums : array, (blocks, size, ...)
    basis : Basis

    Returns
    -------
    complex array, (blocks, n + 1, ...)
    """
    cosine, sine = np.split(sums[:, basis.drift : basis.linear], 2, axis=1)
    return np.concatenate([sums[:, :1], cosine - 1j * sine], axis=1)


def local_noise(blocks: BlockSums, residual: Complex, settles: bool) -> LocalNoise:
    """Noise around each harmonic.

    Parameters
    ----------
    blocks : BlockSums
    residual : complex array, (blocks, n + 1, channels)
        From `residual_sums`.
    settles : bool
        Whether an exponential settling of the mean was fitted too.
    """
    orders = range(blocks.basis.harmonics + 1)
    noises = [noise_around(k, blocks, residual[:, k], settles=settles) for k in orders]
    spectra, dof = zip(*noises, strict=True)
    return LocalNoise(np.array(spectra), np.array(dof))


def noise_around(
    k: int, blocks: BlockSums, residual: Complex, *, settles: bool
) -> tuple[Complex, float]:
    """Spectral matrix of the noise around one harmonic, and its degrees of freedom.

    Where the window is too short to resolve lines, the noise counts as white.

    Parameters
    ----------
    k : int
        Order of the harmonic; 0 for the mean.
    blocks : BlockSums
    residual : complex array, (blocks, channels)
        Sums of the residual times e^(-i k phi).
    settles : bool
        As in `local_noise`.
    """
    basis, samples = blocks.basis, float(blocks.count.sum())
    periods = basis.omega * basis.half_width / np.pi
    # Each block stands at its middle, in units of the window's length.
    at = (blocks.middle - basis.centre) / (2 * basis.half_width)
    lines = _free_lines(k, periods, blocks, 1 + (basis.degree > 0) + settles)
    if lines.size < 2 * _FEWEST:
        dof = max(samples - basis.linear - 1, 1.0)
        return residual.T @ residual.conj() / dof, dof
    turned = _at_lines(np.rint(2 * (lines - k * periods)).astype(np.intp), at, residual)
    near = turned if k else turned[: 2 * _NEXT_TO_ZERO]
    spectrum = near.T @ near.conj() / (near.shape[0] * samples)
    if not k:
        grown = np.sqrt(_growth_below_lowest_line(lines, turned))
        spectrum = spectrum * grown[:, None] * grown
    # Two numbers per line; half-integer lines carry no independent information.
    return spectrum, float(near.shape[0])


def _at_lines(steps: Index, at: Float, residual: Complex) -> Complex:
    """Sums of the residual times e^(-i pi step at), (lines, channels).

    A step is half a line. Every step is a coarse one plus a fine one, so that a few powers of one
    complex number and a product of matrices give all of them.
    """
    lowest = steps.min()
    coarse, fine = np.divmod(steps - lowest, _FINE)
    turn = np.exp(-1j * np.pi * at)
    fines = np.cumprod([np.exp(-1j * np.pi * lowest * at), *(_FINE - 1) * [turn]], axis=0)
    coarses = np.cumprod([np.ones_like(turn), *coarse.max() * [turn**_FINE]], axis=0)
    sums = np.matmul(coarses, (fines * residual.T[:, None]).transpose(0, 2, 1))
    return np.asarray(sums[:, coarse, fine].T)


def _growth_below_lowest_line(lines: Float, turned: Complex) -> Float:
    """Ratio of the noise that acts on the mean to that of the lowest lines; (channels,).

    1/f noise is stronger below the lowest line than at that line. Its power law is extrapolated
    down to a third of a line, as if the noise had started three windows ago.
    """
    # The logarithm of a periodogram has standard deviation 1.28; half of the lines are independent.
    exponent = red_exponent(lines, np.abs(turned) ** 2, 1.28 * np.sqrt(2.0))
    lowest = lines[: 2 * _NEXT_TO_ZERO, None]
    return np.asarray((1 / 3.0) ** -exponent / np.mean(lowest**-exponent, axis=0))


def red_exponent(lines: Float, power: Float, scatter: float) -> Float:
    """Exponent e of noise whose power falls as lines^-e; 0 of white noise, apart from scatter.

    Parameters
    ----------
    lines : array, (n,)
        Frequencies, in any unit.
    power : array, (n, ...)
    scatter : float
        Standard deviation of the logarithm of the power of a line, as if all were independent.

    Returns
    -------
    array, (...)
        At most 1: what is steeper than 1/f is drift.
    """
    away = np.log(lines) - np.log(lines).mean()
    lever = max(float(away @ away), 1e-300)
    exponent = -(away @ np.log(np.maximum(power, 1e-300))) / lever
    seen = exponent > 2.5 * scatter / np.sqrt(lever)
    return np.where(seen, np.minimum(exponent, 1.0), 0.0)


def _free_lines(k: int, periods: float, blocks: BlockSums, taken: int) -> Float:
    """Numbers of the spectral lines next to harmonic k that are free of fitted columns.

    Lines farther from the harmonic than an eighth of the number of blocks are left out, because
    the blocks average them out. The slow columns take up the lowest `taken` lines.
    """
    basis, samples = blocks.basis, float(blocks.count.sum())
    wanted = _AROUND_HARMONIC if k else _ABOVE_ZERO
    # Most lines between harmonics are free, unless there are few periods.
    reach = min(
        blocks.count.size / 8,
        3.0 * wanted + (2.0 * basis.harmonics * periods if periods < 64 else 0),
    )
    first = max(float(taken), k * periods - reach)
    last = min(samples / 2 - 1, k * periods + reach)
    # Both integer and half-integer lines are used. A distant line such as hum leaks into one of the
    # two sets in the same way as into the harmonic or its derivative, and may vanish in the other
    # set.
    away = np.arange(np.ceil(2 * (first - k * periods)), 2 * (last - k * periods) + 1e-9) / 2
    lines = k * periods + away
    nearest = np.clip(np.rint(lines / periods), 0, basis.harmonics)
    near = 0.9 if periods < 8 else 1.2
    free = (np.abs(lines - periods * nearest) > near) | (lines < periods / 2)
    lines = lines[free]
    return lines[np.argsort(np.abs(lines - k * periods), kind="stable")[: 2 * wanted]]


def quadrature(basis: Basis) -> Float:
    """The matrix that maps cos to sin and sin to -cos, (size, size); 0 for the drift."""
    n = basis.harmonics
    turn = np.zeros((basis.size, basis.size))
    for first in (basis.drift, basis.linear):
        k = first + np.arange(n)
        turn[k + n, k] = 1.0
        turn[k, k + n] = -1.0
    return turn


def sum_covariance(
    basis: Basis, gram: Float, noise: LocalNoise, columns: tuple[Float, Float]
) -> Float:
    """Covariance of the sums of noise times columns, for two channels.

    Parameters
    ----------
    basis : Basis
    gram : array, (size, size)
        Gram matrix of the columns over the whole window.
    noise : LocalNoise
    columns : (array (size, p), array (size, q))
        Coefficients of the columns of each channel; each column belongs to one harmonic.

    Returns
    -------
    array, (p + q, p + q)
    """
    C = np.hstack(columns)
    channel = np.repeat([0, 1], [c.shape[1] for c in columns])
    # The harmonic of each column of the basis is 0 for the drift.
    orders = np.tile(np.arange(1, basis.harmonics + 1), 4)
    orders = np.concatenate([np.zeros(basis.drift, dtype=np.intp), orders])
    k = orders[np.argmax(np.abs(C), axis=0)]
    product, across = C.T @ gram @ C, (quadrature(basis) @ C).T @ gram @ C
    level = np.sqrt(noise.spectra[k, channel, channel].real)
    # Noise of two channels is correlated within one harmonic only: in phase by the real part of the
    # cross-spectrum, in quadrature by the imaginary one.
    cross = noise.spectra[k[:, None], channel[:, None], channel]
    between = np.where(k[:, None] == k, cross.real * product + cross.imag * across, 0.0)
    whole = np.where(channel[:, None] == channel, np.outer(level, level) * product, between)
    # Symmetrised: with incomplete periods the columns overlap.
    return (whole + whole.T) / 2
