"""Transfer function of a tribometer's channel, to correct readings for it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.tribometer.filters import low_pass
from asperity.tribometer.sensors import Accelerometer
from asperity.tribometer.tribometer import Tribometer


def channel_gain(
    tribometer: Tribometer, channel: str, frequency: ArrayLike
) -> NDArray[np.complex128]:
    """Recorded over true amplitude of a harmonic signal, e^{+i w t}.

    A laboratory knows it from calibration: amplitudes are divided by its modulus.

    Parameters
    ----------
    tribometer : Tribometer
    channel : str
        Name of a sensor.
    frequency : array_like
        Hz.

    Returns
    -------
    complex array, of the shape of `frequency`
        Sensor and anti-alias filter; a clock's error is not in it.
    """
    sensor, recorder = tribometer.sensors[channel], tribometer.recorder
    s = 2j * np.pi * np.asarray(frequency, float)
    gain = _filter(s, *low_pass(1, sensor.bandwidth)) * np.exp(-s * sensor.delay)
    if isinstance(sensor, Accelerometer) and sensor.high_pass > 0:
        gain = gain * (1 - _filter(s, *low_pass(1, sensor.high_pass)))
    if recorder.cut_off is not None:
        gain = gain * _filter(s, *low_pass(recorder.order, recorder.cut_off))
    return gain


def _filter(s: NDArray, poles: NDArray, residues: NDArray) -> NDArray:
    return (residues / (s[..., None] - poles)).sum(-1)
