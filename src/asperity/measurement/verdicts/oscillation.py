"""Oscillations that are no harmonics, in what a reading leaves of the force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.basis import Basis
from asperity.lock_in.normal_equations import solved
from asperity.lock_in.reading import LockInReading
from asperity.lock_in.reference import SpectralLine, strongest_line
from asperity.measurement.series import block_means

Array = NDArray[np.float64]

#: Samples of the piece in the middle that is searched for what is nearly as fast as the modulation.
_PIECE = 1 << 16
#: Stick-slip of laboratory sliders is slower than this (Hz).
_STICK_SLIP = 20.0


def slow_line(reading: LockInReading, time: Array, force: Array) -> SpectralLine | None:
    """The strongest line of the force's residual below the modulation, or below 20 Hz.

    Parameters
    ----------
    reading : LockInReading
    time, force : array, (n,)
        Of the window.
    """
    f = reading.frequency
    piece, left = left_of_piece(reading, time, force)
    # Stick-slip may be faster than a slow modulation.
    highest = max(0.9 * f, _STICK_SLIP)
    # Means over a third of a period keep what is slower.
    span = float(time[piece][-1] - time[piece][0])
    blocks = int(min(left.size, max(64, 3.3 * highest * span)))
    found = [_below(block_means(time[piece], blocks), block_means(left, blocks), highest)]
    if time.size > _PIECE:
        count = reading.blocks.count
        slow = reading.residual[:-1, 0, 1].real / count[:-1]
        found.append(_below(reading.blocks.middle[:-1], slow, 0.9 * f))
    # Above the modulation, harmonics beyond those that are fitted are no oscillations of their own.
    width = 2 / span
    lines = [
        line
        for line in found
        if line is not None
        and (
            line.frequency < 0.9 * f
            or abs(line.frequency / f - round(line.frequency / f)) * f > width
        )
    ]
    # A background of nothing, as of a force that stands still, is divided by all the same.
    return max(lines, key=lambda line: line.amplitude / max(line.background, 1e-300), default=None)


def left_of_piece(reading: LockInReading, time: Array, values: Array) -> tuple[slice, Array]:
    """What a fit of its own leaves of a channel in the middle of a window, and where that is."""
    at = max(0, (time.size - _PIECE) // 2)
    piece = slice(at, at + _PIECE)
    return piece, _residual(reading.blocks.basis, time[piece], values[piece])


def _below(time: Array, values: Array, highest: float) -> SpectralLine | None:
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
