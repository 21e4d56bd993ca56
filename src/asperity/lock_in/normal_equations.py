"""Normal equations of a lock-in: basis columns, their sums over blocks of samples, the solution.

A reading is least squares on

    u^0 .. u^d,  cos k phi, sin k phi,  u cos k phi, u sin k phi   (k = 1..n)

with u = (t - centre)/half_width and phi = omega (t - centre). The last 2n columns are the
derivatives with respect to the frequency. The set is closed under a shift of time, so a block of
evenly sampled data needs no separate sines and cosines: one table serves all blocks, each rotated
by its phase. The sums of each block are kept, so that the residual near any harmonic follows from
them without a second pass over the samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.arrays import Float
from asperity.errors import require

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
        trigonometric = out[self.drift : self.linear]
        cosine, sine = trigonometric[: self.harmonics], trigonometric[self.harmonics :]
        # The tangent of half the phase gives both; a cosine and a sine would take longer.
        shifted *= self.omega / 2
        tangent = np.tan(shifted, out=shifted)
        np.multiply(tangent, tangent, out=cosine[0])
        cosine[0] += 1.0
        np.divide(tangent, cosine[0], out=sine[0])
        sine[0] *= 2.0
        np.multiply(tangent, sine[0], out=cosine[0])
        np.subtract(1.0, cosine[0], out=cosine[0])
        for k in range(1, self.harmonics):
            # e^(i(k+1)phi) = e^(ik phi) e^(i phi): one tangent a sample, however many harmonics.
            np.multiply(cosine[k - 1], cosine[0], out=cosine[k])
            cosine[k] -= sine[k - 1] * sine[0]
            np.multiply(sine[k - 1], cosine[0], out=sine[k])
            sine[k] += cosine[k - 1] * sine[0]
        np.multiply(out[self.drift : self.linear], u, out=out[self.linear :])
        return out

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

    def to(self, other: Basis) -> Float:
        """The matrix that transforms the columns into those of another window, (size, size).

        Parameters
        ----------
        other : Basis
            With the same frequency, harmonics and degree.
        """
        moved = self.shift(np.array([2 * self.centre - other.centre]))[0]
        scale = np.ones(self.size)
        ratio = self.half_width / other.half_width
        scale[: self.drift] = ratio ** np.arange(self.drift)
        scale[self.linear :] = ratio
        return scale[:, None] * moved


def inverted(normal: Float) -> Float:
    """Inverse of a symmetric positive definite matrix, (p, p); `InputError` if it is singular."""
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

    def after(self, first: int, basis: Basis) -> BlockSums:
        """The blocks from number `first` on, with the columns of their own window."""
        change = self.basis.to(basis)
        gram = change @ self.gram[first:] @ change.T
        moments = change @ self.moments[first:]
        return BlockSums(basis, gram, moments, self.count[first:], self.middle[first:])


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


def merged(blocks: BlockSums, wanted: int) -> BlockSums:
    """Sums of neighbouring blocks joined to about `wanted`; a short remainder joins the last."""
    together = -(-blocks.count.size // wanted)
    if together == 1 and blocks.count[-1] > 0.5 * blocks.count[0]:
        return blocks
    edges = np.arange(0, blocks.count.size, together)
    if edges.size > 1 and blocks.count[edges[-1] :].sum() < 0.5 * blocks.count[:together].sum():
        edges = edges[:-1]

    def added(values: Float) -> Float:
        return np.add.reduceat(values, edges, axis=0)

    count = added(blocks.count)
    middle = added(blocks.middle * blocks.count) / count
    return BlockSums(blocks.basis, added(blocks.gram), added(blocks.moments), count, middle)


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
    basis: Basis, time: Float, channels: list[Float], *, blocks: int = 1, step: float | None = None
) -> BlockSums:
    """Sum a recording in blocks of equally many samples.

    Parameters
    ----------
    basis : Basis
    time : array, (n,)
    channels : list of array, (n,)
    blocks : int
        Approximate number of blocks, more of a long recording; the last may be shorter.
    step : float, optional
        Sampling interval (s) of an even clock, from `even_step`.
    """
    length = min(max(1, -(-time.size // blocks)), _BUFFER)
    if step is None:
        return _uneven(basis, time, channels, length)
    return _even(basis, time, channels, length, step)


def _even(basis: Basis, time: Float, channels: list[Float], length: int, step: float) -> BlockSums:
    """Blocks by matrix products with one table of columns, each then rotated by its phase."""
    columns = basis.columns(basis.centre + step * np.arange(float(length)))
    whole = time.size // length * length
    parts = []
    for first, stop, count in ((0, whole, length), (whole, time.size, time.size - whole)):
        if not count:
            continue
        table = columns[:, :count]
        start = time[0] + step * np.arange(first, stop, count)
        shift = basis.shift(start)
        raw = [channel[first:stop].reshape(-1, count) @ table.T for channel in channels]
        gram = shift @ (table @ table.T) @ shift.transpose(0, 2, 1)
        samples, middle = np.full(start.size, float(count)), start + step * (count - 1) / 2
        parts.append(BlockSums(basis, gram, shift @ np.stack(raw, axis=-1), samples, middle))
    return join(parts)


def _uneven(basis: Basis, time: Float, channels: list[Float], length: int) -> BlockSums:
    """Sums of blocks with columns of their samples; several short blocks are computed together."""
    edges = np.arange(0, time.size, length)
    gram = np.empty((edges.size, basis.size, basis.size))
    moments = np.empty((edges.size, basis.size, len(channels)))
    together = max(1, _BUFFER // length)
    buffer = np.empty((basis.size, together * length))
    for first in range(0, edges.size, together):
        piece = time[edges[first] :][: buffer.shape[1]]
        columns = basis.columns(piece, out=buffer[:, : piece.size])
        for b, at in enumerate(edges[first : first + together], first):
            block = columns[:, at - edges[first] :][:, :length]
            gram[b] = block @ block.T
            for c, channel in enumerate(channels):
                moments[b, :, c] = block @ channel[at : at + length]
    count = np.diff(np.append(edges, time.size)).astype(float)
    return BlockSums(basis, gram, moments, count, np.add.reduceat(time, edges) / count)
