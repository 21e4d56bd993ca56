"""Sums of a lock-in over blocks of an uneven clock.

Products of two harmonics are harmonics again, so all normal equations follow from sums of
u^m e^(ik phi), k up to twice the highest harmonic, and of each channel times the same. Where the
clock is nearly even, e^(i phi) is that of the even clock, from a table, times a short series in the
small difference of the phase; elsewhere it is a cosine and a sine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.basis import Basis

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Samples that are summed at a time: their products fit into the second-level cache.
_CHUNK = 8192
#: Largest deviation (rad) from an even clock for which the series is used.
_NEAR = 0.1
#: Truncation error of the series.
_ROUNDING = 1e-17


def uneven_sums(
    basis: Basis, time: Array, channels: list[Array], length: int
) -> tuple[Array, Array]:
    """Gram matrices and moments of blocks of some thousand samples.

    Parameters
    ----------
    basis : Basis
    time : array, (n,)
    channels : list of array, (n,)
    length : int
        Samples per block; the last may be shorter.

    Returns
    -------
    (array (blocks, size, size), array (blocks, size, channels))
    """
    chunk = -(-length // -(-length // _CHUNK))
    worker = _Chunk(basis, time, len(channels), chunk)
    blocks = -(-time.size // length)
    found = np.zeros((blocks, 2 * basis.harmonics + 1, worker.rows), dtype=complex)
    for b in range(blocks):
        end = min((b + 1) * length, time.size)
        for at in range(b * length, end, chunk):
            stop = min(at + chunk, end)
            found[b] += worker.sums(time[at:stop], [c[at:stop] for c in channels])
    powers = found[:, :, : worker.powers]
    return _gram(basis, powers), _moments(basis, found[:, :, worker.powers :], len(channels))


class _Chunk:
    """Buffers and tables for chunks of one recording."""

    def __init__(self, basis: Basis, time: Array, channels: int, size: int) -> None:
        self._basis = basis
        # u^0 .. u^m for the Gram matrix; each channel times u^0 .. u^p.
        self.powers = max(2 * basis.degree, basis.degree + 1, 2) + 1
        self._channel_powers = max(basis.degree, 1) + 1
        self.rows = self.powers + channels * self._channel_powers
        self._ramp = _usual_step(time, size) * np.arange(float(size))
        phase = basis.omega * self._ramp
        self._table, self._turned = np.stack([np.cos(phase), np.sin(phase)]), np.empty((2, size))
        # Cosine and sine of k phi, k = 0 .. 2n.
        self._waves = np.empty((2 * basis.harmonics + 1, 2, size))
        self._waves[0, 0], self._waves[0, 1] = 1.0, 0.0
        self._weights = np.empty((self.rows, size))
        self._scratch = np.empty((4, size))

    def sums(self, time: Array, channels: list[Array]) -> Complex:
        """Sums of each weight times e^(ik phi), k = 0 .. 2n; (2n + 1, rows)."""
        basis, size = self._basis, time.size
        waves, weights = self._waves[:, :, :size], self._weights[:, :size]
        most = 2 * basis.harmonics
        turn = self._fundamental(time, waves[1])
        twice = np.multiply(waves[1, 0], 2.0, out=self._scratch[0, :size])
        for k in range(1, most):
            # cos (k+1)x + cos (k-1)x = 2 cos x cos kx, and the same of sines.
            np.multiply(waves[k], twice, out=waves[k + 1])
            waves[k + 1] -= waves[k - 1]
        weights[0] = 1.0
        u = np.subtract(time, basis.centre, out=weights[1])
        u /= basis.half_width
        for power in range(2, self.powers):
            np.multiply(weights[power - 1], u, out=weights[power])
        at = self.powers
        for channel in channels:
            weights[at] = channel
            for power in range(1, self._channel_powers):
                np.multiply(weights[at + power - 1], u, out=weights[at + power])
            at += self._channel_powers
        both = (waves.reshape(-1, size) @ weights.T).reshape(most + 1, 2, -1)
        turned = np.exp(1j * turn * np.arange(most + 1))[:, None]
        return np.asarray((both[:, 0] + 1j * both[:, 1]) * turned)

    def _fundamental(self, time: Array, wave: Array) -> float:
        """Fill in cos and sin of the phase without a constant part, which is returned."""
        size, omega = time.size, self._basis.omega
        small, square = self._scratch[:2, :size]
        series = self._scratch[2:, :size]
        np.subtract(time, self._ramp[:size], out=small)
        small -= time[0]
        small *= omega
        widest = max(float(small.max()), -float(small.min()))
        if not widest < _NEAR:
            phase = np.subtract(time, self._basis.centre, out=small)
            phase *= omega
            np.cos(phase, out=wave[0])
            np.sin(phase, out=wave[1])
            return 0.0
        np.multiply(small, small, out=square)
        series[:] = 1.0
        # Cosine and sine over its phase: 1 + r1 x (1 + r2 x (1 + ...)).
        for j in range(_terms(widest), 0, -1):
            series *= square
            series *= -0.5 / np.array([[j * (2 * j - 1)], [j * (2 * j + 1)]])
            series += 1.0
        cosine, sine = series
        sine *= small
        table = self._table[:, :size]
        np.multiply(table, cosine, out=wave)
        np.multiply(table, sine, out=self._turned[:, :size])
        wave[0] -= self._turned[1, :size]
        wave[1] += self._turned[0, :size]
        return float(omega * (time[0] - self._basis.centre))


def _usual_step(time: Array, size: int) -> float:
    """Median step over chunks of `size` samples."""
    last = np.arange(size, time.size, size)
    if not last.size:
        return float(time[-1] - time[0]) / max(time.size - 1, 1)
    return float(np.median(time[last] - time[last - size])) / size


def _terms(widest: float) -> int:
    """Terms of the series of cosine and sine for a truncation error below rounding."""
    terms, left = 0, widest
    while left > _ROUNDING:
        terms += 1
        left *= widest**2 / (2 * terms * (2 * terms + 1))
    return terms


def _gram(basis: Basis, powers: Complex) -> Array:
    """Gram matrices of the basis from sums of u^m e^(ik phi), (blocks, 2n + 1, m)."""
    n, first, second = basis.harmonics, basis.drift, basis.linear
    gram = np.empty((powers.shape[0], basis.size, basis.size))
    p = np.arange(first)
    gram[:, :first, :first] = powers[:, 0, p[:, None] + p].real
    k = np.arange(1, n + 1)
    total, apart = k[:, None] + k, k[:, None] - k
    for a, at in ((0, first), (1, second)):
        cosine, sine = slice(at, at + n), slice(at + n, at + 2 * n)
        beside = powers[:, 1 : n + 1, a : a + first].transpose(0, 2, 1)
        gram[:, :first, cosine], gram[:, :first, sine] = beside.real, beside.imag
        for b, to in ((0, first), (1, second)):
            summed = powers[:, total, a + b] / 2
            other = powers[:, np.abs(apart), a + b] / 2
            across, down = slice(to, to + n), slice(to + n, to + 2 * n)
            gram[:, cosine, across] = other.real + summed.real
            gram[:, sine, down] = other.real - summed.real
            gram[:, cosine, down] = summed.imag - np.sign(apart) * other.imag
            gram[:, sine, across] = summed.imag + np.sign(apart) * other.imag
    gram[:, first:, :first] = gram[:, :first, first:].transpose(0, 2, 1)
    return gram


def _moments(basis: Basis, sums: Complex, channels: int) -> Array:
    """Moments from sums of each channel times u^m e^(ik phi), (blocks, 2n + 1, channels * m)."""
    n, first, second = basis.harmonics, basis.drift, basis.linear
    of_channel = sums.reshape(*sums.shape[:2], channels, -1)
    moments = np.empty((sums.shape[0], basis.size, channels))
    moments[:, :first] = of_channel[:, 0, :, :first].real.transpose(0, 2, 1)
    for power, at in ((0, first), (1, second)):
        waves = of_channel[:, 1 : n + 1, :, power]
        moments[:, at : at + n], moments[:, at + n : at + 2 * n] = waves.real, waves.imag
    return moments
