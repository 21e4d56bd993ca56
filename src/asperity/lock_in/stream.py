"""A lock-in for recordings that do not fit into memory, or are not finished yet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.lock_in.basis import Basis
from asperity.lock_in.blocks import BlockSums, even_step, join, sums
from asperity.lock_in.demodulation import BLOCKS, DRIFTS, read
from asperity.lock_in.reading import LockInReading

Array = NDArray[np.float64]

#: Largest error of the frequency, as phase (rad) at the ends of the window. It is corrected to
#: first order; the remaining relative error is about a hundredth.
_OFF = 0.1


class LockInStream:
    """Lock-in of samples that are added one piece after the other.

    Only sums are kept: about a thousand small matrices, however long the recording.

    Parameters
    ----------
    frequency : float
        Modulation frequency (Hz), accurate to a tenth of a radian at the ends of the window. The
        remaining error is fitted and corrected.
    start, end : float
        First and last time (s) of all samples that will be added.
    harmonics : int
    detrend : {"none", "linear", "quadratic"}

    Raises
    ------
    InputError
        If `detrend` is not known, or the window or the frequency is not positive.
    """

    def __init__(
        self,
        frequency: float,
        *,
        start: float,
        end: float,
        harmonics: int = 4,
        detrend: str = "linear",
    ) -> None:
        if detrend not in DRIFTS:
            raise InputError(
                f"LockInStream.detrend must be none, linear or quadratic, got '{detrend}'; choose "
                "one"
            )
        if not (end > start and frequency > 0):
            raise InputError(
                f"LockInStream.end must follow start and frequency be positive, got {start:g} s, "
                f"{end:g} s and {frequency:g} Hz; give them in this order"
            )
        half = (end - start) / 2
        self._basis = Basis(2 * np.pi * frequency, harmonics, DRIFTS[detrend], start + half, half)
        self._parts: list[BlockSums] = []

    def add(self, time: Array, load: Array, force: Array) -> None:
        """Add the next samples, arrays (n,) each.

        Raises
        ------
        InputError
            If they lie outside the window or are not finite.
        """
        basis = self._basis
        first, last = basis.centre - basis.half_width, basis.centre + basis.half_width
        slack = 1e-9 * basis.half_width
        if not (time[0] >= first - slack and time[-1] <= last + slack):
            raise InputError(
                f"LockInStream.add must get times from {first:.10g} s to {last:.10g} s, got "
                f"{time[0]:.10g} s to {time[-1]:.10g} s; give start and end of all that follows"
            )
        share = (time[-1] - time[0]) / (2 * basis.half_width)
        step = even_step(time, basis.omega * basis.harmonics)
        blocks = max(1, round(BLOCKS * share))
        part = sums(basis, time, [load, force], blocks=blocks, step=step)
        if not np.isfinite(part.moments).all():
            raise InputError(
                "LockInStream.add must get finite values, got some that are not; leave their "
                "samples out"
            )
        self._parts.append(part)

    def read(self) -> LockInReading:
        """The reading of all samples added so far.

        Raises
        ------
        InputError
            If there are none, or the frequency is not accurate enough.
        """
        if not self._parts:
            raise InputError(
                "LockInStream.add must be called before read, got no samples; add some"
            )
        reading = read(join(self._parts))
        off = 2 * np.pi * reading.frequency - self._basis.omega
        if abs(off) * self._basis.half_width > _OFF:
            raise InputError(
                f"LockInStream.frequency must be good to {_OFF} rad at the ends of the window, got "
                f"{self._basis.omega / (2 * np.pi):.10g} Hz where about "
                f"{reading.frequency:.10g} Hz was measured; start again with that"
            )
        return reading
