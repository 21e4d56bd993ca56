"""Sensors of the virtual tribometer: from a quantity to the signal at the recorder.

Analogue filters act on a simulated signal, exact between its samples. A rational filter is a sum of
first-order ones, sum of r/(s - p), over its poles p. Each is a linear differential equation, y' = p
y + r u, solved over a sampling interval h with u the cubic polynomial through the four samples
around it:

    y(t + h) = e^{ph} y(t) + r sum over four samples of c_j u_j.

A smooth signal is filtered with an error of fourth order in h, and a step moves nothing but the
three intervals next to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Float
from asperity.errors import InputError, require
from asperity.parameters.arguments import number

#: Nodes of the quadrature over an interval, sufficient for e^{ps} of the fastest poles.
_NODES = 64


def low_pass(order: int, frequency: float) -> tuple[NDArray, NDArray]:
    """Poles (rad/s) and residues of a Butterworth low-pass with gain 1 at frequency 0.

    Parameters
    ----------
    order : int
        1 is a single pole.
    frequency : float
        Where the gain is 1/sqrt 2 (Hz).
    """
    corner = 2 * np.pi * frequency
    k = np.arange(1, order + 1)
    poles = corner * np.exp(1j * np.pi * (2 * k + order - 1) / (2 * order))
    others = [np.prod(p - np.delete(poles, i)) for i, p in enumerate(poles)]
    return poles, corner**order / np.array(others)


def resonant(frequency: float, damping: float) -> tuple[NDArray, NDArray]:
    """Poles (rad/s) and residues of a damped oscillator with gain 1 at frequency 0.

    Parameters
    ----------
    frequency : float
        Undamped (Hz).
    damping : float
        Damping ratio, below 1.
    """
    corner = 2 * np.pi * frequency
    pole = corner * complex(-damping, np.sqrt(1 - damping**2))
    poles = np.array([pole, pole.conjugate()])
    residues = corner**2 / np.array([pole - pole.conjugate(), pole.conjugate() - pole])
    return poles, residues


def filtered(values: Float, rate: float, poles: NDArray, residues: NDArray) -> Float:
    """Output of a filter at the samples of its input, which was steady before the first.

    Parameters
    ----------
    values : array, shape (n,)
    rate : float
        Samples per second (Hz).
    poles, residues : complex array
        Poles and residues of the transfer function, rad/s.

    Returns
    -------
    array, shape (n,)
    """
    from scipy.signal import lfilter

    n = values.size
    ends = np.concatenate([values[:1], values, np.repeat(values[-1:], 2)])
    stencils = [ends[j : j + n] for j in range(4)]
    total = np.zeros(n)
    for pole, residue in zip(poles, residues, strict=True):
        if pole.imag < -1e-9 * abs(pole):
            continue  # the conjugate pole counts twice
        weights = _weights(pole, 1 / rate)
        drive = sum(c * u for c, u in zip(weights, stencils, strict=True))
        start = -values[0] / pole
        # y_k of the interval that ends at sample k; the first is the steady state.
        y = lfilter([1.0], [1.0, -np.exp(pole / rate)], np.append(start, drive[:-1]))
        share = 1.0 if abs(pole.imag) <= 1e-9 * abs(pole) else 2.0
        total += share * (residue * y).real
    return total


def _weights(pole: complex, h: float) -> NDArray:
    """Integral over [0, h] of e^{p (h - s)} l_j(s), l_j the cubics of nodes -h, 0, h, 2h."""
    # The kernel decays within 1/|p| of the end; the nodes lie there.
    length = min(h, 40 / abs(pole.real)) if pole.real else h
    x, w = np.polynomial.legendre.leggauss(_NODES)
    s = h - length * (x + 1) / 2
    u = s / h
    return _cubics(u) @ (w * np.exp(pole * (h - s))) * length / 2


def _cubics(u: Float) -> Float:
    """Cubics that are 1 at one of the nodes -1, 0, 1, 2 and 0 at the others, shape (4, n)."""
    return np.array(
        [
            -u * (u - 1) * (u - 2) / 6,
            (u + 1) * (u - 1) * (u - 2) / 2,
            -(u + 1) * u * (u - 2) / 2,
            (u + 1) * u * (u - 1) / 6,
        ]
    )


def between(values: Float, rate: float, times: Float) -> Float:
    """Values at any times (s since the first sample), by the cubic through four samples.

    Before the first and after the last sample the signal is constant.
    """
    at = np.clip(times * rate, 0.0, values.size - 1.0)
    k = np.minimum(at.astype(int), max(values.size - 2, 0))
    around = np.clip(k + np.arange(-1, 3)[:, None], 0, values.size - 1)
    return (_cubics(at - k) * values[around]).sum(axis=0)


#: A number in SI or a text with its unit; converted to a float in SI at construction.
Given: TypeAlias = Any


def convert_fields(instrument: Any, rules: Mapping[str, tuple[str, str]]) -> None:
    """Replace fields of a frozen dataclass, numbers in SI or texts with units, by numbers in SI.

    Parameters
    ----------
    instrument : dataclass
    rules : mapping of str to (str, str)
        Kind and rule of each field, as `asperity.parameters.arguments.number` takes them.

    Raises
    ------
    InputError
        If a value breaks its rule.
    """
    for name, (kind, rule) in rules.items():
        label = f"{type(instrument).__name__}.{name}"
        object.__setattr__(instrument, name, number(getattr(instrument, name), label, kind, rule))


#: Kinds of the fields of a sensor that are not in the unit of its quantity.
_KINDS = {
    "bandwidth": "frequency",
    "high_pass": "frequency",
    "delay": "time",
    "resonance": "frequency",
    "damping": "dimensionless",
    "impulses": "dimensionless",
    "drift": "dimensionless",
    "stiffness": "stiffness",
}
#: Rules of the fields that may not be zero, or that may be negative.
_RULES = {
    **dict.fromkeys(("bandwidth", "high_pass", "stiffness"), "positive"),
    **dict.fromkeys(("offset", "drift"), "finite"),
}


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
        Step q of the reading; 0 for no steps.
    offset : float or str
        Reading at zero.
    drift : float
        Change of the offset per second, in SI.
    delay : float or str
        Dead time (s): a phase of -2 pi f delay on top of that of the bandwidth.
    resonance, damping : float or str
        Natural frequency and damping ratio of the gauge that carries the sensor (Hz, ratio); it
        rings after a slip. 0 Hz for a rigid gauge.
    impulses : float
        Share of the samples of the motion at which the reading jumps out and back.
    impulse_size : float or str
        Standard deviation of these jumps, in the unit of the quantity.
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
    resonance: Given = 0.0
    damping: Given = 0.05
    impulses: Given = 0.0
    impulse_size: Given = 0.0

    @classmethod
    def kind_of(cls, field: str) -> str:
        """Kind of the quantity of a field, a key of `KINDS`; a drift is a number in SI."""
        return _KINDS.get(field, cls.kind)

    def __post_init__(self) -> None:
        names = [field.name for field in fields(self)]
        rules = {n: (self.kind_of(n), _RULES.get(n, "not negative")) for n in names}
        convert_fields(self, rules)
        for name in ("damping", "impulses"):
            value, label = getattr(self, name), f"{type(self).__name__}.{name}"
            require(value < 1, label, "be below 1", f"{value:g}", "correct the value")

    def read(self, values: Float, rate: float, random: np.random.Generator) -> Float:
        """The sensor's output at the samples of a quantity; the recorder's clock adds the delay.

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
        for name in ("bandwidth", "resonance"):
            if rate < 2 * getattr(self, name):
                rule = f"be at most half the sampling rate of the motion, {rate / 2:g} Hz"
                got, advice = f"{getattr(self, name):g} Hz", "sample the motion faster"
                raise InputError(f"{type(self).__name__}.{name}", rule, got, advice)
        seen = self._responded(values, rate)
        seen = seen + self._noise(values.size, rate, random)
        seen = seen + self.offset + self.drift * np.arange(values.size) / rate
        if self.impulses:
            hit = random.random(values.size) < self.impulses
            seen = seen + hit * self.impulse_size * random.standard_normal(values.size)
        if self.resolution > 0:
            seen = self.resolution * np.rint(seen / self.resolution)
        return seen

    def _responded(self, values: Float, rate: float) -> Float:
        if self.resonance:
            values = filtered(values, rate, *resonant(self.resonance, self.damping))
        return filtered(values, rate, *low_pass(1, self.bandwidth))

    def _noise(self, n: int, rate: float, random: np.random.Generator) -> Float:
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

    def read(self, values: Float, rate: float, random: np.random.Generator) -> Float:
        """Shear force (N) from the elongation."""
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

    Its reading is the force that accelerates the moving mass: an accelerometer does not see what
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

    def _responded(self, values: Float, rate: float) -> Float:
        seen = super()._responded(values, rate)
        return seen - filtered(seen, rate, *low_pass(1, self.high_pass)) + self.mean
