"""A measurement as plain numbers and texts for JSON and tables."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Float

if TYPE_CHECKING:
    from asperity.measurement.levels_and_trends import MeanLevel
    from asperity.measurement.measure import Measurement
    from asperity.measurement.sliding.measure import SlidingMeasurement

CONVENTIONS = (
    "W/W0 = 1 + epsilon cos phi + ..., F/W0 = mean_friction + sum of mu_n cos(n phi + phase_n); "
    "peak amplitudes, phases in (-pi, pi]; uncertainties are standard uncertainties"
)
SLIDING_CONVENTIONS = (
    "rate_dependence = A - B = d mu_ss/d ln V, positive where friction rises with velocity; "
    "change = level after less level before, both extrapolated to the step; "
    "healing = peak after a hold less level before it; uncertainties are standard uncertainties"
)


def modulated_record(measurement: Measurement) -> dict[str, Any]:
    """All results of a lock-in reading.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    dict
        Of numbers, texts, lists and dicts, in SI.
    """
    reading = measurement.reading
    values = reading.observables()
    uncertainties = {name: reading.uncertainty(name) for name in values}
    intervals = {name: reading.half_width(name) for name in values}
    joint = observable_covariance(measurement)
    if isfinite(measurement.delta_mu_interval_95):
        intervals["delta_mu"] = measurement.delta_mu_interval_95
    return {
        "mode": measurement.mode,
        "verdict": measurement.verdict,
        **values,
        "static_friction": measurement.static_friction,
        "delta_mu": measurement.delta_mu,
        "uncertainties": {**uncertainties, "delta_mu": measurement.delta_mu_uncertainty},
        "intervals_95": intervals,
        "harmonics": _pairs(reading.harmonics),
        "load_harmonics": _pairs(reading.load_harmonics),
        "covariance": {"names": list(reading.names), "matrix": reading.covariance.tolist()},
        "observable_covariance": {"names": list(joint[0]), "matrix": joint[1].tolist()},
        "settlings": [
            {
                "order": settling.order,
                "decay": settling.decay,
                "amplitude": abs(settling.amplitude),
                "ends_in_window": settling.determined,
            }
            for settling in reading.settlings
            if settling.present
        ],
        "F0_before": _level(measurement.before),
        "F0_after": _level(measurement.after),
        "window": {
            "start": reading.start,
            "end": reading.end,
            "samples": reading.samples,
            "periods": reading.periods,
            "chosen_by": measurement.chosen_by,
        },
        "stretches": [
            {
                "start": float(measurement.samples.time[part.first]),
                "end": float(measurement.samples.time[part.stop - 1]),
                "amplitude": part.amplitude,
            }
            for part in measurement.stretches
        ],
        "checks": [asdict(check) for check in measurement.checks],
        "findings": [asdict(finding) for finding in measurement.samples.findings],
        "channels": {"W": measurement.samples.names[0], "F": measurement.samples.names[1]},
        "unit": measurement.samples.unit,
        "dropped_samples": measurement.samples.dropped,
        "conventions": CONVENTIONS,
    }


def observable_covariance(measurement: Measurement) -> tuple[tuple[str, ...], Float]:
    """Joint covariance of what fits compare: mean_friction, delta_mu, mu1, phase1, mu2, phase2.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    names : tuple of str
        Without delta_mu where the force at constant load was not recorded.
    covariance : array, shape (len(names), len(names))
        Covariance of amplitudes and phases (rad) to first order: the parts of a harmonic along its
        measured phasor, and across it over the amplitude. Its diagonal are the squares of the
        reported uncertainties.
    """
    reading = measurement.reading
    at = reading.names.index
    names, rows = ["mean_friction"], [np.eye(len(reading.names))[at("mean_friction")]]
    if isfinite(measurement.delta_mu_uncertainty):
        names.append("delta_mu")
        rows.append(rows[0])
    for n in range(1, min(reading.harmonics.size, 2) + 1):
        phasor = reading.phasor(n)
        if not phasor.amplitude:
            continue
        along, across = np.zeros((2, len(reading.names)))
        direction = phasor.value / phasor.amplitude
        along[[at(f"re{n}"), at(f"im{n}")]] = direction.real, direction.imag
        across[[at(f"re{n}"), at(f"im{n}")]] = -direction.imag, direction.real
        names += [f"mu{n}", f"phase{n}"]
        rows += [along, across / phasor.amplitude]
    J = np.array(rows)
    covariance = J @ reading.covariance @ J.T
    if "delta_mu" in names:
        # The errors of the level at constant load are independent of all others.
        covariance[1, 1] = measurement.delta_mu_uncertainty**2
    # Phases that may be any have a bound on what is reported of them.
    uncertainties = [
        measurement.delta_mu_uncertainty if n == "delta_mu" else reading.uncertainty(n)
        for n in names
    ]
    # By rounding, a variance of zero may be negative.
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.divide(uncertainties, spread, out=np.zeros_like(spread), where=spread > 0)
    covariance *= np.outer(scale, scale)
    return tuple(names), covariance


def sliding_record(measurement: SlidingMeasurement) -> dict[str, Any]:
    """All results of a recording without modulation.

    Parameters
    ----------
    measurement : SlidingMeasurement

    Returns
    -------
    dict
        As in `modulated_record`.
    """
    return {
        "mode": measurement.mode,
        "verdict": measurement.verdict,
        "friction": _level(measurement.friction),
        "load": _level(measurement.load),
        "unit": measurement.load_unit,
        "rates": [{"rate": rate, "share": share} for rate, share in measurement.rates],
        "samples": int(measurement.time.size),
        "velocity_from": measurement.velocity_from,
        "detrend": measurement.detrend,
        "chosen_by": measurement.chosen_by,
        "segments": [{**asdict(s), "steady": _level(s.steady)} for s in measurement.segments],
        "steps": [asdict(step) for step in measurement.steps],
        "holds": [asdict(hold) for hold in measurement.holds],
        "healing": None if measurement.healing is None else asdict(measurement.healing),
        "checks": [asdict(check) for check in measurement.checks],
        "conventions": SLIDING_CONVENTIONS,
    }


def _level(level: MeanLevel | None) -> dict[str, float] | None:
    return None if level is None else level._asdict()


def _pairs(values: Any) -> list[list[float]]:
    return [[float(c.real), float(c.imag)] for c in values]
