"""Readings of the amplitude protocol: one for each amplitude, and all as a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from asperity.measurement.measure import Measurement
from asperity.recording.trace import Trace

if TYPE_CHECKING:
    import xarray


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
    """Recording of the amplitude protocol, and its readings.

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
