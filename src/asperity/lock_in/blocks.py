"""Normal equations of the lock-in, block by block.

The columns of `asperity.lock_in.basis` are closed under a shift of time, so a block of
evenly sampled data needs no sine or cosine of its own: one table serves all blocks, each rotated
by its phase. The sums of each block are kept, so that the residual near any harmonic follows from
them without a second pass over the samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.basis import Basis
from asperity.lock_in.uneven_clock import uneven_sums

Array = NDArray[np.float64]

#: Largest deviation of an even clock from an even grid, as phase (rad) of the highest harmonic.
_EVEN = 1e-8
#: Samples in one table or one buffer: small enough for the second-level cache.
_BUFFER = 4096


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
    gram: Array
    moments: Array
    count: Array
    middle: Array

    def totals(self) -> tuple[Array, Array]:
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


def even_step(time: Array, omega: float) -> float | None:
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
    time: Array,
    channels: list[Array],
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


def _even(basis: Basis, time: Array, channels: list[Array], length: int, step: float) -> BlockSums:
    table = basis.columns(basis.centre + step * np.arange(float(length)))
    whole = time.size // length
    parts = [_turned(basis, time[0], channels, table, step, 0, whole)]
    if rest := time.size - whole * length:
        tail = [channel[whole * length :] for channel in channels]
        parts.append(_turned(basis, time[0], tail, table[:, :rest].copy(), step, whole * length, 1))
    return join(parts)


def _turned(
    basis: Basis,
    begin: float,
    channels: list[Array],
    table: Array,
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


def _uneven(basis: Basis, time: Array, channels: list[Array], length: int) -> BlockSums:
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
    basis: Basis, time: Array, channels: list[Array], length: int, gram: Array, moments: Array
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
