"""What a reading of a modulated stretch is made of: the mean cycle, and what the fit leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from asperity.measurement.measure import Measurement

Array = NDArray[np.float64]

_BINS = 90
#: Samples of the spectrum.
_MOST = 1 << 18


class MeanCycle(NamedTuple):
    """Friction over the phase of the load, less its mean.

    Attributes
    ----------
    phase : array, shape (n,)
        Over 2 pi, in the middles of the bins.
    measured : array, shape (n,)
        Mean of F/W0 - mean_friction in each bin, without the fitted drift.
    fine_phase, fitted : array, shape (m,)
        Sum of the fitted harmonics.
    """

    phase: Array
    measured: Array
    fine_phase: Array
    fitted: Array


def mean_cycle(found: Measurement) -> MeanCycle:
    """The mean cycle of the force against the phase of the load.

    Parameters
    ----------
    found : Measurement
    """
    reading, cut = found.reading, slice(*found.window)
    time, force = found.samples.time[cut], found.samples.force[cut]
    middle, length = (reading.start + reading.end) / 2, reading.end - reading.start
    trend = reading.drift[1, 0] * (time - middle) / length if reading.drift.shape[1] else 0.0
    phase = reading.frequency * (time - middle) + reading.phase / (2 * np.pi)
    where = ((phase % 1.0) * _BINS).astype(int) % _BINS
    samples = np.bincount(where, minlength=_BINS)
    mean = np.bincount(where, force - trend, minlength=_BINS) / np.maximum(samples, 1) / reading.W0
    middles = (np.arange(_BINS) + 0.5) / _BINS
    filled = samples > 0
    fine = np.linspace(0, 1, 400)
    order = np.arange(1, reading.harmonics.size + 1)[:, None]
    fitted = (reading.harmonics[:, None] * np.exp(2j * np.pi * order * fine)).real.sum(0)
    return MeanCycle(middles[filled], (mean - reading.mean_friction)[filled], fine, fitted)


def residual_spectrum(found: Measurement) -> tuple[Array, Array]:
    """Amplitudes of F/W0 without the fitted harmonics, up to the order after the last one.

    Parameters
    ----------
    found : Measurement

    Returns
    -------
    frequency : array, shape (n,)
        In Hz.
    amplitude : array, shape (n,)
        Under a Hann window.
    """
    reading, cut = found.reading, slice(*found.window)
    time, force = found.samples.time[cut][:_MOST], found.samples.force[cut][:_MOST] / reading.W0
    middle = (reading.start + reading.end) / 2
    cycles = reading.frequency * (time - middle) + reading.phase / (2 * np.pi)
    order = np.arange(1, reading.harmonics.size + 1)
    for n, c in zip(order, reading.harmonics, strict=True):
        force = force - (c * np.exp(2j * np.pi * n * cycles)).real
    grid = np.linspace(time[0], time[-1], time.size)
    level = np.interp(grid, time, force)
    u = np.linspace(-1, 1, grid.size)
    level = level - np.polynomial.legendre.legval(u, np.polynomial.legendre.legfit(u, level, 1))
    hann = np.cos(np.pi / 2 * u) ** 2
    amplitude = 2 * np.abs(np.fft.rfft(hann * level)) / hann.sum()
    frequency = np.fft.rfftfreq(grid.size, grid[1] - grid[0])
    top = min(frequency[-1], (order.size + 1) * reading.frequency)
    shown = (frequency > frequency[1]) & (frequency <= top)
    return frequency[shown], amplitude[shown]
