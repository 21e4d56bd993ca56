"""A measurement as plain numbers and texts, for JSON and tables."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from asperity.instrument.measure import Measurement
    from asperity.instrument.measure_series import Level
    from asperity.instrument.measure_static import StaticMeasurement
    from asperity.instrument.quality import Check

CONVENTIONS = (
    "W/W0 = 1 + epsilon cos phi + ..., F/W0 = mean_friction + sum of mu_n cos(n phi + phase_n); "
    "peak amplitudes, phases in (-pi, pi]; uncertainties are standard uncertainties"
)
_SCALARS = ("W0", "epsilon", "frequency", "mean_force", "mean_friction")


def modulated_record(found: Measurement) -> dict[str, Any]:
    """Everything that a reading says.

    Parameters
    ----------
    found : Measurement

    Returns
    -------
    dict
        Of numbers, texts, lists and dicts, in SI.
    """
    reading = found.reading
    orders = range(1, reading.harmonics.size + 1)
    values = {name: float(getattr(reading, name)) for name in _SCALARS}
    for n in orders:
        phasor = reading.phasor(n)
        values |= {f"mu{n}": phasor.amplitude, f"phase{n}": phasor.phase}
    doubts = {name: reading.uncertainty(name) for name in values}
    return {
        "mode": "modulated",
        "verdict": found.verdict,
        **values,
        "static_friction": found.static_friction,
        "delta_mu": found.delta_mu,
        "uncertainties": {**doubts, "delta_mu": found.delta_mu_uncertainty},
        "intervals_95": {name: reading.half_width(name) for name in values},
        "harmonics": _pairs(reading.harmonics),
        "load_harmonics": _pairs(reading.load_harmonics),
        "covariance": {"names": list(reading.names), "matrix": reading.covariance.tolist()},
        "F0_before": _level(found.before),
        "F0_after": _level(found.after),
        "window": {
            "start": reading.start,
            "end": reading.end,
            "samples": reading.samples,
            "periods": reading.periods,
            "chosen_by": found.chosen_by,
        },
        "stretches": [
            {
                "start": float(found.samples.time[part.first]),
                "end": float(found.samples.time[part.stop - 1]),
                "amplitude": part.amplitude,
            }
            for part in found.stretches
        ],
        "checks": checks_record(found.checks),
        "findings": [asdict(finding) for finding in found.samples.findings],
        "channels": {"W": found.samples.names[0], "F": found.samples.names[1]},
        "unit": found.samples.unit,
        "dropped_samples": found.samples.dropped,
        "conventions": CONVENTIONS,
    }


def static_record(found: StaticMeasurement) -> dict[str, Any]:
    """Everything that a recording without modulation says.

    Parameters
    ----------
    found : StaticMeasurement

    Returns
    -------
    dict
        As of `modulated_record`.
    """
    return {
        "mode": "static",
        "verdict": found.verdict,
        "friction": _level(found.friction),
        "load": _level(found.load),
        "unit": found.load_unit,
        "rates": [{"rate": rate, "share": share} for rate, share in found.rates],
        "samples": int(found.time.size),
        "velocity_from": found.velocity_from,
        "segments": [{**asdict(s), "steady": _level(s.steady)} for s in found.segments],
        "steps": [asdict(step) for step in found.steps],
        "checks": checks_record(found.checks),
    }


def checks_record(checks: Iterable[Check]) -> list[dict[str, Any]]:
    """Checks as a list of dicts."""
    return [asdict(check) for check in checks]


def _level(level: Level | None) -> dict[str, float] | None:
    return None if level is None else level._asdict()


def _pairs(values: Any) -> list[list[float]]:
    return [[float(c.real), float(c.imag)] for c in values]
