"""The paper's protocol: modulate, read, switch off, measure F(0) again, next amplitude.

Bureau et al. (2000), Sec. II: the slider slides steadily; for each amplitude the modulation is
switched on, the mean force and its harmonics are read, and after switching off the unmodulated
force is measured again, so that a slow drift of the interface shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.errors import InputError
from asperity.instrument.measure import Measurement, measure
from asperity.instrument.trace import Trace
from asperity.instrument.tribometer import Tribometer
from asperity.loads import Programme, Slide, Step
from asperity.slider import Slider
from asperity.study.experiment.exciter import Exciter
from asperity.study.experiment.motion import motion_rate, signals
from asperity.units import to_si

if TYPE_CHECKING:
    import xarray

#: Channels of the recording.
FORCE, LOAD = "shear force", "normal force"


@dataclass(frozen=True, eq=False)
class AmplitudePoint:
    """One amplitude of the protocol.

    Attributes
    ----------
    epsilon : float
        Commanded.
    begin, end : float
        Of the part of the recording that is read (s), unmodulated sliding before and after it
        included.
    measurement : Measurement
    """

    epsilon: float
    begin: float
    end: float
    measurement: Measurement

    @property
    def drift(self) -> float:
        """F(0) after over F(0) before, less 1; NaN where either was not found."""
        before, after = self.measurement.before, self.measurement.after
        if before is None or after is None:
            return np.nan
        return after.value / before.value - 1


@dataclass(frozen=True, eq=False)
class AmplitudeSeries:
    """What the protocol has recorded, and its readings.

    Attributes
    ----------
    trace : Trace
        The whole recording, as the tribometer made it.
    points : tuple of AmplitudePoint
    velocity, frequency : float
        SI.
    transfer : complex
        Of the exciter.
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
            phase2`` with ``..._uncertainty`` where there is one, ``drift`` and ``verdict``.
        """
        import xarray

        rows = [_row(point) for point in self.points]
        data = {
            name: ("epsilon", np.array([row[name] for row in rows]), {"units": unit})
            for name, unit in _UNITS.items()
        }
        data["verdict"] = ("epsilon", np.array([p.measurement.verdict for p in self.points]), {})
        about = {"units": "1", "long_name": "commanded relative amplitude of the load"}
        epsilon = [point.epsilon for point in self.points]
        attributes = {
            "velocity": f"{self.velocity!r} m/s",
            "frequency": f"{self.frequency!r} Hz",
            "borne_over_applied": abs(self.transfer),
            "simulated": "yes",
        }
        return xarray.Dataset(data, {"epsilon": ("epsilon", epsilon, about)}, attributes)


_UNITS = {
    "measured_epsilon": "1",
    "mean_friction": "1",
    "mean_friction_uncertainty": "1",
    "static_friction": "1",
    "delta_mu": "1",
    "delta_mu_uncertainty": "1",
    "mu1": "1",
    "mu1_uncertainty": "1",
    "phase1": "rad",
    "phase1_uncertainty": "rad",
    "mu2": "1",
    "mu2_uncertainty": "1",
    "phase2": "rad",
    "phase2_uncertainty": "rad",
    "drift": "1",
}


def _row(point: AmplitudePoint) -> dict[str, float]:
    found = point.measurement
    reading = found.reading
    row = {
        "measured_epsilon": reading.epsilon,
        "mean_friction": reading.mean_friction,
        "mean_friction_uncertainty": reading.uncertainty("mean_friction"),
        "static_friction": found.static_friction,
        "delta_mu": found.delta_mu,
        "delta_mu_uncertainty": found.delta_mu_uncertainty,
        "drift": point.drift,
    }
    for n in (1, 2):
        phasor = reading.phasor(n)
        row |= {
            f"mu{n}": phasor.amplitude,
            f"mu{n}_uncertainty": phasor.amplitude_uncertainty,
            f"phase{n}": phasor.phase,
            f"phase{n}_uncertainty": phasor.phase_uncertainty,
        }
    return row


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
    seed: int = 0,
    **options: Any,
) -> AmplitudeSeries:
    """Run the protocol on a simulated slider, and read the recording as one of a laboratory.

    Parameters
    ----------
    slider : Slider
        That slides steadily without modulation: K above its critical value, or with inertia.
    tribometer : Tribometer
        With the channels ``"shear force"`` and ``"normal force"``; the latter measures the load
        as applied, and knows nothing of the part that an air layer bears.
    exciter : Exciter
    epsilons : sequence of float
        Commanded amplitudes, in the order of the experiment.
    velocity : float or str
        Pulling velocity (m/s).
    sliding, modulated, rise : float or str
        Seconds of sliding before, between and after, of modulation, and of its coming and going.
    harmonics : int
        To read.
    seed : int
        Of the tribometer's noise.
    **options
        Of `asperity.solve.transient`, such as ``inertia=True``.

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
    applied: list[Step] = [Slide(off)]
    borne: list[Step] = [Slide(off)]
    for epsilon in epsilons:
        outer, inner = exciter.steps(epsilon, on, slow)
        applied += [outer, Slide(off)]
        borne += [inner, Slide(off)]
    W0 = np.asarray(slider.W0).item()
    programme = Programme(*borne, load=W0, velocity=speed)
    told = Programme(*applied, load=W0, velocity=speed)
    columns, last = signals(slider, programme, motion_rate(tribometer), ("force",), **options)
    if last.stopped is not None:
        raise InputError(
            f"amplitude_series.slider must slide to the end of the protocol, got a motion that "
            f"ended: {last.stopped}"
        )
    trace = tribometer.record(
        columns["time"],
        {FORCE: columns["force"], LOAD: told.load(columns["time"])},
        seed=seed,
        provenance=last.provenance,
    )
    points = []
    for i, epsilon in enumerate(epsilons):
        begin, end = i * (off + on), i * (off + on) + 2 * off + on
        part = trace.slice(begin, end)
        found = measure(
            part, load=LOAD, force=FORCE, frequency=exciter.frequency, harmonics=harmonics
        )
        points.append(AmplitudePoint(float(epsilon), begin, end, found))
    return AmplitudeSeries(trace, tuple(points), speed, exciter.frequency, exciter.transfer)
