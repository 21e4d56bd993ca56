"""Curves of a measurement for pictures: mean cycle, spectrum of the residual, some slip events."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from asperity.arrays import Bool, Float
from asperity.lock_in.reference import spectrum

if TYPE_CHECKING:
    from asperity.measurement.measure import Measurement
    from asperity.measurement.stick_slip.measure import StickSlipMeasurement

#: Phases of a mean cycle, and number of enlarged events.
_BINS, _CLOSE = 90, 8


class MeanCycle(NamedTuple):
    """Friction over the phase of the load, less its mean.

    Attributes
    ----------
    phase : array, shape (n,)
        Over 2 pi, in the middles of the bins.
    measured : array, shape (n,)
        Mean of F/W0 - mean_friction in each bin, without the fitted drift and settling.
    fine_phase, fitted : array, shape (m,)
        Sum of the fitted harmonics.
    """

    phase: Float
    measured: Float
    fine_phase: Float
    fitted: Float


def mean_cycle(measurement: Measurement) -> MeanCycle:
    """The mean cycle of the force against the phase of the load.

    Parameters
    ----------
    measurement : Measurement
    """
    reading, cut = measurement.reading, slice(*measurement.window)
    time, force = measurement.samples.time[cut], measurement.samples.force[cut]
    friction, phase = reading.without_settling(time, force) / reading.W0, reading.cycles(time)
    level = Polynomial.fit(time, friction - reading.waves(phase, 1), reading.drift.shape[1])
    where = ((phase % 1.0) * _BINS).astype(int) % _BINS
    samples = np.bincount(where, minlength=_BINS)
    mean = np.bincount(where, friction - level(time), minlength=_BINS) / np.maximum(samples, 1)
    filled = samples > 0
    middles, fine = ((np.arange(_BINS) + 0.5) / _BINS)[filled], np.linspace(0, 1, 400)
    return MeanCycle(middles, mean[filled], fine, reading.waves(fine, 1))


def residual_spectrum(measurement: Measurement) -> tuple[Float, Float]:
    """Amplitudes of the residual of F/W0 in the middle of the window, up to the next harmonic.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    frequency : array, shape (n,)
        In Hz.
    amplitude : array, shape (n,)
        Under a Hann window.
    """
    reading, cut = measurement.reading, slice(*measurement.window)
    time, force = measurement.samples.time[cut], measurement.samples.force[cut]
    piece, left = reading.residual_of_piece(time, force)
    frequency, amplitude = spectrum(time[piece], left / reading.W0)
    top = min(frequency[-1], (reading.harmonics.size + 1) * reading.frequency)
    shown = (frequency > frequency[1]) & (frequency <= top)
    return frequency[shown], amplitude[shown]


def middle_events(measurement: StickSlipMeasurement) -> tuple[slice, Bool]:
    """Some events in the middle of a recording, and the samples around them, for a picture."""
    time, events = measurement.time, measurement.events
    first = max((len(events) - _CLOSE) // 2, 0)
    last = min(first + _CLOSE, len(events)) - 1
    begin, end = float(events.onset[first]), float(events.end[last])
    around = max((end - begin) / (2 * _CLOSE), float(events.slip_duration[first]))
    return slice(first, last + 1), (time >= begin - around) & (time <= end + around)
