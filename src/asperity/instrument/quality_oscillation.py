"""Oscillations that are slower than the modulation, in what a reading leaves of the force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.instrument.lock_in_basis import Basis
from asperity.instrument.lock_in_reading import Reading
from asperity.instrument.lock_in_solve import solved
from asperity.instrument.measure_series import block_means
from asperity.instrument.reference import Line, strongest_line

Array = NDArray[np.float64]

#: Samples of the piece in the middle that is searched for what is nearly as fast as the modulation.
_PIECE = 1 << 16


def slow_line(reading: Reading, time: Array, force: Array) -> Line | None:
    """The strongest line of the force's residual below the modulation.

    Parameters
    ----------
    reading : Reading
    time, force : array, (n,)
        Of the window.
    """
    basis, f = reading.blocks.basis, reading.frequency
    at = max(0, (time.size - _PIECE) // 2)
    piece = slice(at, at + _PIECE)
    left = _residual(basis, time[piece], force[piece])
    # Means over a third of a period keep what is slower than the modulation.
    span = float(time[piece][-1] - time[piece][0])
    blocks = int(min(left.size, max(64, 3 * f * span)))
    found = [_below(block_means(time[piece], blocks), block_means(left, blocks), 0.9 * f)]
    if time.size > _PIECE:
        count = reading.blocks.count
        slow = reading.residual[:-1, 0, 1].real / count[:-1]
        found.append(_below(reading.blocks.middle[:-1], slow, 0.9 * f))
    lines = [line for line in found if line is not None]
    return max(lines, key=lambda line: line.amplitude / line.background, default=None)


def _below(time: Array, values: Array, highest: float) -> Line | None:
    """The strongest line between drift and a frequency; None where there is no room for one."""
    if time.size < 32 or (time[-1] - time[0]) * highest < 3 or not values.any():
        return None
    lowest = 2.5 / float(time[-1] - time[0])
    return strongest_line(time, values, between=(lowest, highest))


def _residual(basis: Basis, time: Array, force: Array) -> Array:
    """What a fit of its own leaves of a piece."""
    own = Basis(
        basis.omega,
        basis.harmonics,
        basis.degree,
        float(time[0] + time[-1]) / 2,
        float(time[-1] - time[0]) / 2,
    )
    columns = own.columns(time)[: own.linear]
    beta = solved(columns @ columns.T, columns @ force)
    return force - beta @ columns
