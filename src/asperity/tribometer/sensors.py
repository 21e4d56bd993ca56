"""Sensors of the virtual tribometer: from a quantity to the signal at the recorder."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.tribometer.filters import filtered, low_pass
from asperity.units import KINDS, to_si

Array = NDArray[np.float64]
#: Given as a number in SI or a text with its unit, and a float in SI from the construction on.
Given: TypeAlias = Any

#: Kinds of the fields of a sensor that are not in the unit of its quantity.
_KINDS = {
    "bandwidth": "frequency",
    "high_pass": "frequency",
    "delay": "time",
    "stiffness": "stiffness",
}
_POSITIVE = ("bandwidth", "stiffness")


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """A first-order sensor with noise, drift, delay and a smallest step.

    The reading of a quantity u is

        q[ u low-passed and delayed + noise + offset + drift t ],

    where the noise is Gaussian with the spectrum of the sensor itself: white up to `bandwidth`,
    of the stated rms, as an Ornstein-Uhlenbeck process.

    Parameters
    ----------
    bandwidth : float or str
        Corner of the first-order low-pass (Hz): gain 1/sqrt(1 + (f/bandwidth)^2), phase
        -arctan(f/bandwidth).
    noise : float or str
        Standard deviation, in the unit of the quantity.
    resolution : float or str
        Step q of the reading; 0 for none.
    offset : float or str
        Reading at zero.
    drift : float
        Change of the offset per second, in SI.
    delay : float or str
        Dead time (s): a phase of -2 pi f delay on top of that of the bandwidth.
    """

    #: Kind of noise, resolution and offset, and kind of the reading, as keys of `KINDS`.
    kind: ClassVar[str]
    reads: ClassVar[str]

    bandwidth: Given
    noise: Given = 0.0
    resolution: Given = 0.0
    offset: Given = 0.0
    drift: float = 0.0
    delay: Given = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            kind = _KINDS.get(field.name, self.kind)
            name = f"{type(self).__name__}.{field.name}"
            stated = getattr(self, field.name)
            value = to_si(stated, "dimensionless" if field.name == "drift" else kind, name)
            low = field.name not in ("offset", "drift")
            if low and (value < 0 or (value == 0 and field.name in _POSITIVE)):
                rule = "positive" if field.name in _POSITIVE else "not negative"
                raise InputError(
                    f"{name} must be {rule}, got {value:g} {KINDS[kind].si}; correct the value"
                )
            object.__setattr__(self, field.name, value)

    def read(self, values: Array, rate: float, random: np.random.Generator) -> Array:
        """The sensor's output at the samples of a quantity; its delay is the clock's work.

        Parameters
        ----------
        values : array, shape (n,)
            SI, evenly sampled.
        rate : float
            Samples per second (Hz).
        random : Generator

        Raises
        ------
        InputError
            If the samples are too far apart for the sensor's bandwidth.
        """
        if rate < 2 * self.bandwidth:
            raise InputError(
                f"{type(self).__name__}.bandwidth must be at most half the sampling rate of the "
                f"motion, {rate / 2:g} Hz, got {self.bandwidth:g} Hz; sample the motion faster"
            )
        seen = self._responded(values, rate)
        seen = seen + self._noise(values.size, rate, random)
        seen = seen + self.offset + self.drift * np.arange(values.size) / rate
        if self.resolution > 0:
            seen = self.resolution * np.rint(seen / self.resolution)
        return seen

    def _responded(self, values: Array, rate: float) -> Array:
        return filtered(values, rate, *low_pass(1, self.bandwidth))

    def _noise(self, n: int, rate: float, random: np.random.Generator) -> Array:
        """Ornstein-Uhlenbeck process, exact at the samples, from its stationary distribution."""
        from scipy.signal import lfilter

        if not self.noise:
            return np.zeros(n)
        kept = np.exp(-2 * np.pi * self.bandwidth / rate)
        steps = self.noise * np.sqrt(1 - kept**2) * random.standard_normal(n)
        steps[0] = self.noise * random.standard_normal()
        return np.asarray(lfilter([1.0], [1.0, -kept], steps))


@dataclass(frozen=True, kw_only=True)
class SpringGauge(Sensor):
    """A displacement gauge that reads the elongation F/K of the loading spring.

    Noise, resolution, offset (m) and drift (m/s) are lengths, as in a gauge's data sheet; the
    reading is a force, the elongation times `stiffness`.

    Parameters
    ----------
    stiffness : float or str
        Spring stiffness (N/m).
    """

    kind, reads = "length", "force"

    stiffness: Given

    def read(self, values: Array, rate: float, random: np.random.Generator) -> Array:
        """Shear force (N) as the gauge has it."""
        return self.stiffness * super().read(values / self.stiffness, rate, random)


@dataclass(frozen=True, kw_only=True)
class DisplacementGauge(Sensor):
    """A gauge of length, such as of the slider against the track."""

    kind = reads = "length"


@dataclass(frozen=True, kw_only=True)
class LoadCell(Sensor):
    """A load cell, in series with the normal load."""

    kind = reads = "force"


@dataclass(frozen=True, kw_only=True)
class Accelerometer(Sensor):
    """The modulated part of the load from an accelerometer on the exciter, on a known mean.

    Its reading is the force that accelerates the moving mass: an accelerometer sees none of what
    is constant, and its first-order high-pass leads by arctan(high_pass/f).

    Parameters
    ----------
    mean : float or str
        Load (N) that the modulated part is added to.
    high_pass : float or str
        Corner of the high-pass (Hz).
    """

    kind = reads = "force"

    mean: Given
    high_pass: Given

    def _responded(self, values: Array, rate: float) -> Array:
        seen = super()._responded(values, rate)
        if self.high_pass > 0:
            seen = seen - filtered(seen, rate, *low_pass(1, self.high_pass))
        return seen + self.mean
