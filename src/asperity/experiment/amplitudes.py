"""Amplitude protocol of Bureau et al. (2000): modulate, measure, switch off, measure F(0) again.

Bureau et al. (2000), Sec. II: the slider slides steadily; for each amplitude the modulation is
switched on, the mean force and its harmonics are read, and after switching off the unmodulated
force F(0) is measured again, which reveals a slow drift of the interface. The contacts carry a part
of the modulation that the exciter applies.
"""

from __future__ import annotations

import cmath
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from asperity.air import AirLayer, transfer_function
from asperity.arrays import Float
from asperity.errors import require
from asperity.experiment.recorded_motion import FORCE, LOAD, motion_rate, signals
from asperity.loads import Modulate, Programme, ProgrammeStep, Slide
from asperity.measurement.campaign import labelled_rows, modulated_rows
from asperity.measurement.measure import Measurement, measure
from asperity.parameters.arguments import at_least, number, typed
from asperity.questions.recording import Measurement as Question
from asperity.recording.trace import Trace
from asperity.slider import Slider
from asperity.tribometer.sensors import Given, convert_fields
from asperity.tribometer.tribometer import Tribometer
from asperity.units import to_si

if TYPE_CHECKING:
    import xarray


@typed
@dataclass(frozen=True)
class Exciter:
    """A harmonic normal load; an air layer may carry a part of it.

    Attributes
    ----------
    frequency : float or str
        Hz.
    transfer : complex
        T, modulation on the contacts over applied modulation, e^{+i w t}: eps_eff = abs(T) eps.
    """

    frequency: Given
    transfer: complex = 1.0

    def __post_init__(self) -> None:
        convert_fields(self, {"frequency": ("frequency", "positive")})

    @classmethod
    @typed
    def through_air(
        cls, frequency: Given, slider: Slider, lambda_z: Given, layer: AirLayer | None
    ) -> Exciter:
        """The exciter of a slider on elastic contacts and an air layer.

        Bureau et al. (2000), Appendix, Eq. (40).

        Parameters
        ----------
        frequency : float or str
            Hz.
        slider : Slider
            With mass and mean load.
        lambda_z : float or str
            Normal elastic length (m).
        layer : AirLayer or None
            None in a vacuum.
        """
        hertz = number(frequency, "exciter.frequency", "frequency", "positive")
        length = number(lambda_z, "exciter.lambda_z", "length", "positive")
        transfer = transfer_function(
            hertz, W0=np.asarray(slider.W0), M=np.asarray(slider.M), lambda_z=length, layer=layer
        )
        return cls(hertz, complex(transfer))

    @typed
    def steps(self, epsilon: float, duration: float, rise: float) -> tuple[Modulate, Modulate]:
        """The applied modulation, and that of the load on the contacts.

        Parameters
        ----------
        epsilon : float
            Applied relative amplitude.
        duration, rise : float
            Seconds; the amplitude rises and falls within `rise` each.

        Raises
        ------
        InputError
            If the load on the contacts would reach zero.
        """
        size, phase = cmath.polar(self.transfer)
        got = f"{epsilon:g} of which they bear {size * epsilon:g}"
        advice = f"lower it below {1 / (size or np.inf):.3g}"
        loaded = size * epsilon < 1
        require(loaded, "exciter.epsilon", "leave the contacts loaded", got, advice)
        common: dict[str, Any] = {"frequency": self.frequency, "rise": rise, "fall": rise}
        applied = Modulate(duration, epsilon, **common)
        return applied, Modulate(duration, size * epsilon, phase=phase, **common)


@dataclass(frozen=True, eq=False)
class AmplitudePoint:
    """An amplitude of the protocol.

    Attributes
    ----------
    epsilon : float
        Commanded.
    begin, end : float
        Begin and end of the part of the recording that is read (s), unmodulated sliding before and
        after it included.
    measurement : Measurement
    """

    epsilon: float
    begin: float
    end: float
    measurement: Measurement

    @property
    def drift(self) -> float:
        """F(0) after over F(0) before, minus 1; NaN if one of them is unknown."""
        before, after = self.measurement.before, self.measurement.after
        if before is None or after is None:
            return np.nan
        return after.value / before.value - 1


@dataclass(frozen=True, eq=False)
class AmplitudeSeries:
    """Recording of the amplitude protocol, and its readings.

    Attributes
    ----------
    trace : Trace
        The whole recording of the tribometer.
    points : tuple of AmplitudePoint
    velocity, frequency : float
        SI.
    transfer : complex
        Transfer function of the exciter.
    """

    trace: Trace
    points: tuple[AmplitudePoint, ...]
    velocity: float
    frequency: float
    transfer: complex

    def to_dataset(self) -> xarray.Dataset:
        """Readings over the commanded amplitude, each with its standard uncertainty.

        Returns
        -------
        xarray.Dataset
            ``measured_epsilon, mean_friction, static_friction, delta_mu, mu1, mu2, phase1,
            phase2`` with ``..._uncertainty`` where there is one, ``drift`` and ``verdict``; of
            the harmonics, those that were read.
        """
        rows = modulated_rows(Path(), [point.measurement for point in self.points])
        table = labelled_rows(rows).rename(epsilon="measured_epsilon").rename(row="epsilon")
        names = [name for stem in _NUMBERS for name in (stem, f"{stem}_uncertainty")]
        kept = ["measured_epsilon", *(name for name in names if name in table), "verdict"]
        about = {"units": "1", "long_name": "commanded relative amplitude of the load"}
        epsilon = [point.epsilon for point in self.points]
        drift = [point.drift for point in self.points]
        attributes = {
            "velocity": f"{self.velocity!r} m/s",
            "frequency": f"{self.frequency!r} Hz",
            "borne_over_applied": abs(self.transfer),
            "simulated": "yes",
        }
        data = table[kept].assign(drift=("epsilon", drift, {"units": "1"}))
        return data.assign_coords(epsilon=("epsilon", epsilon, about)).assign_attrs(attributes)


#: Numbers of a reading over the commanded amplitude, each with its uncertainty where it has one.
_NUMBERS = ("mean_friction", "static_friction", "delta_mu", "mu1", "phase1", "mu2", "phase2")


@dataclass(frozen=True, eq=False)
class AmplitudeMotion:
    """Motion of a slider through the amplitude protocol.

    Attributes
    ----------
    time : array, shape (n,)
        Evenly spaced (s).
    force : array, shape (n,)
        Force of the spring (N).
    load : array, shape (n,)
        As applied (N), air layer included.
    epsilons : tuple of float
        Commanded.
    velocity, sliding, modulated : float
        Velocity of the drive (m/s); durations (s) without and with modulation.
    exciter : Exciter
    provenance : mapping
        Provenance of the integration.
    """

    time: Float
    force: Float
    load: Float
    epsilons: tuple[float, ...]
    velocity: float
    sliding: float
    modulated: float
    exciter: Exciter
    provenance: Mapping[str, Any]

    def recorded(
        self, tribometer: Tribometer, *, seed: int = 0, harmonics: int = 2
    ) -> AmplitudeSeries:
        """Record the motion, and read the recording as one of a laboratory.

        Parameters
        ----------
        tribometer : Tribometer
            With the channels ``"shear force"`` and ``"normal force"``; the latter measures the
            load as applied, not the part of it that an air layer bears.
        seed : int
            Seed of the tribometer's noise: another seed makes another recording.
        harmonics : int
            To read.
        """
        trace = tribometer.record(
            self.time, {FORCE: self.force, LOAD: self.load}, seed=seed, provenance=self.provenance
        )
        frequency = self.exciter.frequency
        question = Question(load=LOAD, force=FORCE, frequency=frequency, harmonics=harmonics)
        points = []
        for i, epsilon in enumerate(self.epsilons):
            begin = i * (self.sliding + self.modulated)
            end = begin + 2 * self.sliding + self.modulated
            part = trace.slice(begin, end)
            measurement = measure(part, question)
            points.append(AmplitudePoint(epsilon, begin, end, measurement))
        return AmplitudeSeries(
            trace, tuple(points), self.velocity, frequency, self.exciter.transfer
        )


@typed
def amplitude_motion(
    slider: Slider,
    exciter: Exciter,
    epsilons: Sequence[float],
    *,
    rate: float,
    velocity: float | str,
    sliding: float | str = "2 s",
    modulated: float | str = "4 s",
    rise: float | str = "0.1 s",
    **options: Any,
) -> AmplitudeMotion:
    """Integrate the protocol; parameters as `amplitude_series` describes them.

    Parameters
    ----------
    rate : float
        Samples of the motion per second (Hz), from `motion_rate` for a tribometer.

    Raises
    ------
    InputError
        If a value breaks its rule, or the motion ends before the protocol does.
    """
    speed = to_si(velocity, "velocity", "amplitude_series.velocity")
    off, on, slow = (
        to_si(value, "time", f"amplitude_series.{name}")
        for name, value in (("sliding", sliding), ("modulated", modulated), ("rise", rise))
    )
    applied: list[ProgrammeStep] = [Slide(off)]
    borne: list[ProgrammeStep] = [Slide(off)]
    require(epsilons, "amplitude_motion.epsilons", "hold an amplitude", "none", "give one")
    for epsilon in epsilons:
        outer, inner = exciter.steps(epsilon, on, slow)
        applied += [outer, Slide(off)]
        borne += [inner, Slide(off)]
    W0 = np.asarray(slider.W0).item()
    borne_load = Programme(*borne, load=W0, velocity=speed)
    applied_load = Programme(*applied, load=W0, velocity=speed)
    rule = "amplitude_series.slider must slide to the end of the protocol"
    columns, provenance = signals(slider, borne_load, rate, ("force",), rule, options)
    time = columns["time"]
    return AmplitudeMotion(
        time, columns["force"], applied_load.load(time), tuple(map(float, epsilons)),
        speed, off, on, exciter, provenance,
    )  # fmt: skip


@typed
def amplitude_series(
    slider: Slider,
    tribometer: Tribometer,
    exciter: Exciter,
    epsilons: Sequence[float],
    *,
    velocity: float | str,
    sliding: float | str = "2 s",
    modulated: float | str = "4 s",
    rise: float | str = "0.1 s",
    harmonics: int = 2,
    seed: Annotated[int, at_least(0)] = 0,
    **options: Any,
) -> AmplitudeSeries:
    """Run the protocol on a simulated slider, and read the recording as one of a laboratory.

    Parameters
    ----------
    slider : Slider
        That slides steadily without modulation: K above its critical value, or with inertia.
    tribometer : Tribometer
        With the channels ``"shear force"`` and ``"normal force"``; the latter measures the load
        as applied, not the part of it that an air layer bears.
    exciter : Exciter
    epsilons : sequence of float
        Commanded amplitudes, in the order of the experiment.
    velocity : float or str
        Pulling velocity (m/s).
    sliding, modulated, rise : float or str
        Durations (s): sliding before, between and after the modulations; each modulation; the rise
        and fall of its amplitude.
    harmonics : int
        To read.
    seed : int
        Seed of the tribometer's noise.
    **options
        Options of `asperity.transients.transient`, such as ``inertia=True``.

    Raises
    ------
    InputError
        If a value breaks its rule, or the motion ends before the protocol does.
    """
    motion = amplitude_motion(
        slider, exciter, epsilons, rate=motion_rate(tribometer), velocity=velocity,
        sliding=sliding, modulated=modulated, rise=rise, **options,
    )  # fmt: skip
    return motion.recorded(tribometer, seed=seed, harmonics=harmonics)
