"""Normal equations of a lock-in: basis columns, their sums over blocks of samples, the solution.

A reading is least squares on

    u^0 .. u^d,  cos k phi, sin k phi,  u cos k phi, u sin k phi   (k = 1..n)

with u = (t - centre)/half_width and phi = omega (t - centre). The last 2n columns are the
derivatives with respect to the frequency. The set is closed under a shift of time, so a block of
evenly sampled data needs no separate sines and cosines: one table serves all blocks, each rotated
by its phase. The sums of each block are kept, so that the residual near any harmonic follows from
them without a second pass over the samples.

On an uneven clock, products of two harmonics are harmonics again: all normal equations follow from
sums of u^m e^(ik phi), k up to twice the highest harmonic, and of each channel times the same.
Where the clock is nearly even, e^(i phi) is that of the even clock, from a table, times a short
series in the small difference of the phase; elsewhere it is a cosine and a sine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.arrays import Complex, Float
from asperity.errors import require

#: Samples of a chunk: their products fit into the second-level cache.
_CHUNK = 8192
#: Largest deviation (rad) from an even clock for which the series is used.
_NEAR = 0.1
#: Truncation error of the series.
_ROUNDING = 1e-17

#: Largest deviation of an even clock from an even grid, as phase (rad) of the highest harmonic.
_EVEN = 1e-8
#: Samples in one table or one buffer: small enough for the second-level cache.
_BUFFER = 4096


@dataclass(frozen=True)
class Basis:
    """The columns of a reading.

    Attributes
    ----------
    omega : float
        Angular frequency (rad/s).
    harmonics : int
        n, at least 1.
    degree : int
        Degree d of the drift, 0 to 2.
    centre, half_width : float
        Middle and half length (s) of the window.
    """

    omega: float
    harmonics: int
    degree: int
    centre: float
    half_width: float

    @property
    def drift(self) -> int:
        """Number of drift columns."""
        return self.degree + 1

    @property
    def linear(self) -> int:
        """Number of columns without those of the frequency."""
        return self.drift + 2 * self.harmonics

    @property
    def size(self) -> int:
        """Number of all columns."""
        return self.drift + 4 * self.harmonics

    def columns(self, time: Float, out: Float | None = None) -> Float:
        """Columns of the basis at the times `time`.

        Parameters
        ----------
        time : array, (n,)
            Seconds.
        out : array, (size, n), optional
            Output array.

        Returns
        -------
        array, (size, n)
        """
        out = np.empty((self.size, time.size)) if out is None else out
        shifted = time - self.centre
        u = shifted / self.half_width
        out[0] = 1.0
        for power in range(1, self.drift):
            np.multiply(out[power - 1], u, out=out[power])
        cosine, sine = self._cosines_and_sines(out)
        np.multiply(shifted, self.omega, out=shifted)
        np.cos(shifted, out=cosine[0])
        np.sin(shifted, out=sine[0])
        for k in range(1, self.harmonics):
            # e^(i(k+1)phi) = e^(ik phi) e^(i phi): two sines a sample, however many harmonics.
            np.multiply(cosine[k - 1], cosine[0], out=cosine[k])
            cosine[k] -= sine[k - 1] * sine[0]
            np.multiply(sine[k - 1], cosine[0], out=sine[k])
            sine[k] += cosine[k - 1] * sine[0]
        np.multiply(out[self.drift : self.linear], u, out=out[self.linear :])
        return out

    def _cosines_and_sines(self, columns: Float) -> tuple[Float, Float]:
        trigonometric = columns[self.drift : self.linear]
        return trigonometric[: self.harmonics], trigonometric[self.harmonics :]

    def shift(self, start: Float) -> Float:
        """Matrices that transform the columns at `centre + s` into those at `start + s`.

        Parameters
        ----------
        start : array, (blocks,)
            Seconds.

        Returns
        -------
        array, (blocks, size, size)
        """
        n, first, second = self.harmonics, self.drift, self.linear
        turned = np.zeros((start.size, self.size, self.size))
        u = (start - self.centre) / self.half_width
        for power in range(self.drift):
            for j in range(power + 1):
                turned[:, power, j] = math.comb(power, j) * u ** (power - j)
        k = np.arange(n)
        angle = self.omega * (start - self.centre)[:, None] * (k + 1)
        cosine, sine = np.cos(angle), np.sin(angle)
        for at in (first, second):
            turned[:, at + k, at + k] = turned[:, at + n + k, at + n + k] = cosine
            turned[:, at + k, at + n + k] = -sine
            turned[:, at + n + k, at + k] = sine
        rotation = turned[:, first:second, first:second]
        turned[:, second:, first:second] = u[:, None, None] * rotation
        return turned


def solved(normal: Float, right: Float) -> Float:
    """Solution of normal equations.

    Parameters
    ----------
    normal : array, (p, p)
        Symmetric, positive definite.
    right : array, (p,) or (p, q)

    Returns
    -------
    array
        Of the shape of `right`.
    """
    return inverted(normal) @ right


def inverted(normal: Float) -> Float:
    """Inverse of a symmetric positive definite matrix, (p, p); `InputError` if it has none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1 / np.sqrt(np.diagonal(normal))
        equal = normal * scale * scale[:, None]
    try:
        inverse = np.asarray(np.linalg.inv(equal), dtype=np.float64)
    except np.linalg.LinAlgError:
        inverse = np.full_like(equal, np.nan)
    rule = "resolve all harmonics and drift terms"
    advice = "give a longer window or ask for fewer harmonics"
    require(np.isfinite(inverse).all(), "lock_in.time", rule, "samples that do not", advice)
    return inverse * scale * scale[:, None]


def uneven_sums(
    basis: Basis, time: Float, channels: list[Float], length: int
) -> tuple[Float, Float]:
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
    totals = np.zeros((blocks, 2 * basis.harmonics + 1, worker.rows), dtype=complex)
    for b in range(blocks):
        end = min((b + 1) * length, time.size)
        for at in range(b * length, end, chunk):
            stop = min(at + chunk, end)
            totals[b] += worker.sums(time[at:stop], [c[at:stop] for c in channels])
    powers = totals[:, :, : worker.powers]
    return _gram(basis, powers), _moments(basis, totals[:, :, worker.powers :], len(channels))


class _Chunk:
    """Buffers and tables for chunks of one recording."""

    def __init__(self, basis: Basis, time: Float, channels: int, size: int) -> None:
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

    def sums(self, time: Float, channels: list[Float]) -> Complex:
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

    def _fundamental(self, time: Float, wave: Float) -> float:
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


def _usual_step(time: Float, size: int) -> float:
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


def _gram(basis: Basis, powers: Complex) -> Float:
    """Gram matrices of the basis from sums of u^m e^(ik phi), (blocks, 2n + 1, m)."""
    n, first, second = basis.harmonics, basis.drift, basis.linear
    gram = np.empty((powers.shape[0], basis.size, basis.size))
    p = np.arange(first)
    gram[:, :first, :first] = powers[:, 0, p[:, None] + p].real
    k = np.arange(1, n + 1)
    total, apart = k[:, None] + k, k[:, None] - k
    for a, at in ((0, first), (1, second)):
        cosine, sine = slice(at, at + n), slice(at + n, at + 2 * n)
        mixed = powers[:, 1 : n + 1, a : a + first].transpose(0, 2, 1)
        gram[:, :first, cosine], gram[:, :first, sine] = mixed.real, mixed.imag
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


def _moments(basis: Basis, sums: Complex, channels: int) -> Float:
    """Moments from sums of each channel times u^m e^(ik phi), (blocks, 2n + 1, channels * m)."""
    n, first, second = basis.harmonics, basis.drift, basis.linear
    of_channel = sums.reshape(*sums.shape[:2], channels, -1)
    moments = np.empty((sums.shape[0], basis.size, channels))
    moments[:, :first] = of_channel[:, 0, :, :first].real.transpose(0, 2, 1)
    for power, at in ((0, first), (1, second)):
        waves = of_channel[:, 1 : n + 1, :, power]
        moments[:, at : at + n], moments[:, at + n : at + 2 * n] = waves.real, waves.imag
    return moments


@dataclass(frozen=True)
class BlockSums:
    """Sums over blocks of samples; a longer recording has more of them, or longer ones.

    Attributes
    ----------
    basis : Basis
    gram : array, (blocks, size, size)
        Sums of products of columns.
    moments : array, (blocks, size, channels)
        Sums of columns times channels.
    count : array, (blocks,)
        Samples.
    middle : array, (blocks,)
        Mean time (s).
    """

    basis: Basis
    gram: Float
    moments: Float
    count: Float
    middle: Float

    def totals(self) -> tuple[Float, Float]:
        """Normal equations of all blocks together, (size, size) and (size, channels)."""
        return self.gram.sum(0), self.moments.sum(0)


def join(parts: list[BlockSums]) -> BlockSums:
    """Blocks of consecutive parts, one after the other.

    Parameters
    ----------
    parts : list of BlockSums
        With equal bases.
    """
    names = ("gram", "moments", "count", "middle")
    together = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
    return BlockSums(parts[0].basis, *together)


def even_step(time: Float, omega: float) -> float | None:
    """Sampling interval (s) of an even clock; None if it is not even.

    Parameters
    ----------
    time : array, (n,)
    omega : float
        Angular frequency (rad/s) of the highest harmonic.
    """
    if time.size < 2 * _BUFFER:
        return None  # too short for a table to save time
    step = float(time[-1] - time[0]) / (time.size - 1)
    ramp = step * np.arange(4 * _BUFFER)
    buffer = np.empty(ramp.size)
    for at in range(0, time.size, ramp.size):
        piece = time[at : at + ramp.size]
        off = np.subtract(piece, ramp[: piece.size], out=buffer[: piece.size])
        even = time[0] + step * at
        if not omega * max(off.max() - even, even - off.min()) <= _EVEN:
            return None
    return step


def sums(
    basis: Basis,
    time: Float,
    channels: list[Float],
    *,
    blocks: int = 1,
    step: float | None = None,
) -> BlockSums:
    """Sum a recording in blocks of equally many samples.

    Parameters
    ----------
    basis : Basis
    time : array, (n,)
    channels : list of array, (n,)
    blocks : int
        Approximate number of blocks; the last may be shorter than the others.
    step : float, optional
        Sampling interval (s) of an even clock, from `even_step`.
    """
    length = max(1, -(-time.size // blocks))
    if step is None:
        return _uneven(basis, time, channels, length)
    return _even(basis, time, channels, min(length, _BUFFER), step)


def _even(basis: Basis, time: Float, channels: list[Float], length: int, step: float) -> BlockSums:
    table = basis.columns(basis.centre + step * np.arange(float(length)))
    whole = time.size // length
    parts = [_turned(basis, time[0], channels, table, step, 0, whole)]
    if left := time.size - whole * length:
        tail = [channel[whole * length :] for channel in channels]
        parts.append(_turned(basis, time[0], tail, table[:, :left].copy(), step, whole * length, 1))
    return join(parts)


def _turned(
    basis: Basis,
    begin: float,
    channels: list[Float],
    table: Float,
    step: float,
    first: int,
    blocks: int,
) -> BlockSums:
    """Blocks of the table's length by a matrix product, then each rotated by its phase."""
    length = table.shape[1]
    raw = np.stack(
        [c[: blocks * length].reshape(blocks, length) @ table.T for c in channels], axis=-1
    )
    start = begin + step * (first + length * np.arange(blocks))
    shift = basis.shift(start)
    gram = shift @ (table @ table.T) @ shift.transpose(0, 2, 1)
    count = np.full(blocks, float(length))
    return BlockSums(basis, gram, shift @ raw, count, start + step * (length - 1) / 2)


def _uneven(basis: Basis, time: Float, channels: list[Float], length: int) -> BlockSums:
    blocks = -(-time.size // length)
    if length >= _BUFFER // 8:
        gram, moments = uneven_sums(basis, time, channels, length)
    else:
        gram = np.zeros((blocks, basis.size, basis.size))
        moments = np.zeros((blocks, basis.size, len(channels)))
        _short_blocks(basis, time, channels, length, gram, moments)
    edges = np.arange(0, time.size, length)
    count = np.diff(np.append(edges, time.size)).astype(float)
    return BlockSums(basis, gram, moments, count, np.add.reduceat(time, edges) / count)


def _short_blocks(
    basis: Basis, time: Float, channels: list[Float], length: int, gram: Float, moments: Float
) -> None:
    """Many blocks at once, padded to equal length by zeros."""
    together = max(1, _BUFFER // length)
    for b in range(0, gram.shape[0], together):
        at, stop = b * length, min((b + together) * length, time.size)
        count = -(-(stop - at) // length)
        padded = np.zeros((basis.size, count * length))
        padded[:, : stop - at] = basis.columns(time[at:stop])
        columns = padded.reshape(basis.size, count, length).transpose(1, 0, 2)
        values = np.zeros((count * length, len(channels)))
        for c, channel in enumerate(channels):
            values[: stop - at, c] = channel[at:stop]
        gram[b : b + count] = columns @ columns.transpose(0, 2, 1)
        moments[b : b + count] = columns @ values.reshape(count, length, -1)
