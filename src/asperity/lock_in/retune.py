"""Change of the frequency of existing sums, so that a long recording is read once.

Over a block the phase of a slightly different frequency differs by a constant and a small linear
part. The constant rotates the sums exactly; the linear part follows from the columns that are
multiplied with time. The square of the linear part is neglected.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.blocks import BlockSums
from asperity.lock_in.reference import CONVERGED, frequency_step

Array = NDArray[np.float64]

#: Largest phase (rad) of the highest harmonic over half a block: its square is neglected.
_WITHIN = 3e-5
_MOST_STEPS = 4


def retuned_to_load(blocks: BlockSums) -> BlockSums | None:
    """Sums at the frequency of the load, their first channel.

    Parameters
    ----------
    blocks : BlockSums
        At a frequency that is accurate to a fraction of a radian over all blocks.

    Returns
    -------
    BlockSums or None
        None if the error of the frequency is too large for the length of the blocks.
    """
    moved = 0.0
    for _ in range(_MOST_STEPS):
        gram, moments = blocks.totals()
        change = frequency_step(blocks.basis, gram, moments[:, 0])
        if abs(change) * blocks.basis.half_width < CONVERGED:
            return blocks
        moved += abs(change)
        if not moved * blocks.basis.harmonics * _half_block(blocks) < _WITHIN:
            return None
        blocks = retuned(blocks, change)
    return None


def retuned(blocks: BlockSums, change: float) -> BlockSums:
    """The sums at another angular frequency, to first order within each block.

    Parameters
    ----------
    blocks : BlockSums
    change : float
        Change of omega (rad/s).
    """
    basis = blocks.basis
    turn = _turn(blocks, change)
    return replace(
        blocks,
        basis=replace(basis, omega=basis.omega + change),
        gram=turn @ blocks.gram @ turn.transpose(0, 2, 1),
        moments=turn @ blocks.moments,
    )


def _turn(blocks: BlockSums, change: float) -> Array:
    """Matrices from the old columns to the new ones, (blocks, size, size)."""
    basis = blocks.basis
    n, first, second = basis.harmonics, basis.drift, basis.linear
    k = np.arange(1, n + 1)
    away = blocks.middle - basis.centre
    angle = change * away[:, None] * k
    cosine, sine = np.cos(angle), np.sin(angle)
    rotation = np.zeros((away.size, 2 * n, 2 * n))
    i = np.arange(n)
    rotation[:, i, i] = rotation[:, n + i, n + i] = cosine
    rotation[:, i, n + i], rotation[:, n + i, i] = -sine, sine
    # Derivative of the rotation by the angle, times k change: the linear part of the phase.
    linear = np.zeros_like(rotation)
    linear[:, i, i] = linear[:, n + i, n + i] = -sine * k
    linear[:, i, n + i], linear[:, n + i, i] = -cosine * k, cosine * k
    linear *= change * basis.half_width
    u = (away / basis.half_width)[:, None, None]
    turn = np.zeros((away.size, basis.size, basis.size))
    turn[:, np.arange(first), np.arange(first)] = 1.0
    turn[:, first:second, first:second] = rotation - u * linear
    turn[:, first:second, second:] = linear
    turn[:, second:, first:second] = -(u**2) * linear
    turn[:, second:, second:] = rotation + u * linear
    return turn


def _half_block(blocks: BlockSums) -> float:
    """Half the length (s) of the longest block."""
    if blocks.middle.size < 2:
        return blocks.basis.half_width
    return float(np.diff(blocks.middle).max()) / 2
