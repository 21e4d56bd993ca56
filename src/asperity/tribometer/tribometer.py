"""The virtual tribometer: from the motion of a slider to what a laboratory would have recorded.

Force, load and displacement go through their sensors, an anti-alias filter and the recorder's clock
and converter into a `Trace`. No law and no solver is used here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.arrays import Complex, Float
from asperity.errors import InputError, require, require_known
from asperity.parameters.arguments import at_least, one_of, typed
from asperity.recording.defects.sampling import even_rate
from asperity.recording.trace import Channel, Trace, check
from asperity.tribometer.sensors import (
    Accelerometer,
    Given,
    Sensor,
    between,
    convert_fields,
    filtered,
    low_pass,
    resonant,
)
from asperity.units import KINDS, to_si

#: Kinds of the fields of a recorder that have a unit.
_KINDS = {"rate": "frequency", "cut_off": "frequency", "jitter": "time"}


@typed
@dataclass(frozen=True, kw_only=True)
class Recorder:
    """Anti-alias filter, clock and analogue-to-digital converter, the same for all channels.

    Parameters
    ----------
    rate : float or str
        Samples per second (Hz).
    jitter : float or str
        Standard deviation of the sampling instants (s); the time stamps do not include it.
    clock_error : float
        Relative error of the clock: a positive one samples late, so that recorded frequencies
        come out higher by this much.
    cut_off : float or str, optional
        Cut-off frequency (gain 1/sqrt 2) of the Butterworth low-pass before the converter (Hz).
    order : int
        Order of that filter.
    bits : int
        Bits of the converter; 0 for a converter without steps.
    ranges : mapping of str to (float or str, float or str)
        Lowest and highest value of the converter for a channel, by name; what lies
        outside is cut off. A channel without a range is not converted.
    """

    rate: Given
    jitter: Given = 0.0
    clock_error: float = 0.0
    cut_off: Given | None = None
    order: int = 4
    bits: int = 16
    ranges: Mapping[str, tuple[Given, Given]] = field(default_factory=dict)

    @staticmethod
    def kind_of(field: str) -> str:
        """Kind of the quantity of a field, a key of `KINDS`."""
        return _KINDS.get(field, "dimensionless")

    def __post_init__(self) -> None:
        rules = {"rate": "positive", "jitter": "not negative", "clock_error": "finite"}
        if self.cut_off is not None:
            rules["cut_off"] = "positive"
        convert_fields(self, {name: (self.kind_of(name), rule) for name, rule in rules.items()})
        for name, low, high in (("order", 1, 8), ("bits", 0, 32)):
            value, rule = getattr(self, name), f"lie between {low} and {high}"
            advice = f"give one such as {high // 2}"
            require(low <= value <= high, f"Recorder.{name}", rule, value, advice)

    @typed
    def step(self, channel: str, kind: str) -> tuple[float, float, float] | None:
        """Lowest value, highest value and step of the converter for a channel, in SI."""
        if channel not in self.ranges:
            return None
        low, high = (to_si(v, kind, f"Recorder.ranges['{channel}']") for v in self.ranges[channel])
        advice = "give the lowest value first"
        require(low < high, f"Recorder.ranges['{channel}']", "rise", f"{low:g} to {high:g}", advice)
        return low, high, (high - low) / (2**self.bits - 1) if self.bits else 0.0


@typed
@dataclass(frozen=True, kw_only=True)
class Tribometer:
    """Sensors by the name of the channel that each makes, and the recorder.

    Parameters
    ----------
    sensors : mapping of str to Sensor
        Such as ``{"shear force": SpringGauge(...), "normal force": LoadCell(...)}``. The names
        are the headings of the recording.
    recorder : Recorder
    """

    sensors: Mapping[str, Sensor]
    recorder: Recorder

    def __post_init__(self) -> None:
        for channel in self.recorder.ranges:
            require_known(channel, self.sensors, "Recorder.ranges", "be of channels with a sensor")
            self.recorder.step(channel, self.sensors[channel].reads)

    @typed
    def record(
        self,
        time: ArrayLike,
        signals: Mapping[str, ArrayLike],
        *,
        seed: Annotated[int, at_least(0)] | np.random.Generator = 0,
        provenance: Mapping[str, Any] | None = None,
    ) -> Trace:
        """Record signals with the sensors and the recorder.

        Parameters
        ----------
        time : array, shape (n,)
            Evenly spaced (s), closer than the recorder's samples: four times as close is enough
            for the numbers that tests ask for.
        signals : mapping of str to array, shape (n,)
            Input of each sensor in SI, such as the spring force for a gauge of the spring.
        seed : int or Generator
            Seed of all noise: the same seed makes the same recording.
        provenance : mapping, optional
            Kept in the trace.

        Returns
        -------
        Trace
            In SI, checked as a recording that has been read is.

        Raises
        ------
        InputError
            If signals and sensors do not belong together or the times are not even.
        """
        grid = np.asarray(to_si(time, "time", "Tribometer.time"), float)
        rate = even_rate(grid) if grid.ndim == 1 and grid.size > 3 else None
        if rate is None:
            rule, advice = "be evenly spaced", "sample the motion at a rate, like sampling='20 kHz'"
            raise InputError("Tribometer.time", rule, f"{grid.size} uneven times", advice)
        rule = f"be at least as fine as the recorder's clock, {self.recorder.rate:g} Hz"
        advice = "sample the motion faster"
        require(not rate < self.recorder.rate, "Tribometer.time", rule, f"{rate:g} Hz", advice)
        rule = f"be those of the sensors, {', '.join(self.sensors)}"
        got, advice = ", ".join(signals) or "none", "name each as its sensor is named"
        require(set(signals) == set(self.sensors), "Tribometer.signals", rule, got, advice)
        random = np.random.default_rng(seed)
        stamps, instants = self._clock(grid, random)
        channels = {}
        for name, sensor in self.sensors.items():
            values = np.asarray(signals[name], float)
            rule, got = "be as long as time", f"{values.shape} for {grid.shape}"
            advice = "give one value for each time"
            require(values.shape == grid.shape, f"Tribometer.signals['{name}']", rule, got, advice)
            channels[name] = self._channel(name, sensor, values, rate, instants, random)
        origin = {"format": "virtual tribometer", **(provenance or {})}
        trace = Trace(stamps, channels, provenance=origin)
        return Trace(stamps, channels, check(trace), origin)

    def _clock(self, grid: Float, random: np.random.Generator) -> tuple[Float, Float]:
        """Time stamps, and the true sampling instants since the first sample."""
        recorder = self.recorder
        length = grid[-1] - grid[0]
        # Plus half a unit in the last place, so that rounding does not lose the last sample.
        count = int(np.floor(length * recorder.rate / (1 + recorder.clock_error) + 1e-9)) + 1
        nominal = np.arange(count) / recorder.rate
        instants = nominal * (1 + recorder.clock_error)
        if recorder.jitter:
            instants = instants + recorder.jitter * random.standard_normal(count)
        return grid[0] + nominal, instants

    def _channel(
        self,
        name: str,
        sensor: Sensor,
        values: Float,
        rate: float,
        instants: Float,
        random: np.random.Generator,
    ) -> Channel:
        recorder = self.recorder
        seen = sensor.read(values, rate, random)
        if recorder.cut_off is not None:
            seen = filtered(seen, rate, *low_pass(recorder.order, recorder.cut_off))
        sampled = between(seen, rate, instants - sensor.delay)
        converter = recorder.step(name, sensor.reads)
        if converter is not None:
            low, high, step = converter
            sampled = np.clip(sampled, low, high)
            if step:
                sampled = low + step * np.rint((sampled - low) / step)
        unit = KINDS[sensor.reads].si
        return Channel(sampled, sensor.reads, unit, name, unit)


@typed
def channel_gain(tribometer: Tribometer, channel: str, frequency: ArrayLike) -> Complex:
    """Recorded over true amplitude of a harmonic signal, e^{+i w t}.

    A laboratory knows the gain from calibration, and divides amplitudes by its modulus.

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
        Gain of sensor and anti-alias filter, without the error of the clock.
    """
    sensor = tribometer.sensors[one_of(channel, tribometer.sensors, "channel_gain.channel")]
    recorder = tribometer.recorder
    s = 2j * np.pi * np.asarray(frequency, float)
    gain = _filter(s, *low_pass(1, sensor.bandwidth)) * np.exp(-s * sensor.delay)
    if sensor.resonance > 0:
        gain = gain * _filter(s, *resonant(sensor.resonance, sensor.damping))
    if isinstance(sensor, Accelerometer):
        gain = gain * (1 - _filter(s, *low_pass(1, sensor.high_pass)))
    if recorder.cut_off is not None:
        gain = gain * _filter(s, *low_pass(recorder.order, recorder.cut_off))
    return gain


def _filter(s: NDArray, poles: NDArray, residues: NDArray) -> NDArray:
    return (residues / (s[..., None] - poles)).sum(-1)
