"""Measurements as aligned text."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from asperity.cli.report import aligned

if TYPE_CHECKING:
    from asperity.instrument.finding import Finding
    from asperity.instrument.measure import Measurement
    from asperity.instrument.measure_static import StaticMeasurement
    from asperity.instrument.quality import Check


def modulated_text(found: Measurement, name: str) -> str:
    """A reading, as the command prints it.

    Parameters
    ----------
    found : Measurement
    name : str
        Of the recording.
    """
    reading, unit = found.reading, found.samples.unit
    rows = [
        _row("W0", reading.W0, reading.uncertainty("W0"), unit, "mean load"),
        _row("epsilon", reading.epsilon, reading.uncertainty("epsilon"), "", "amplitude of W/W0"),
        _row("frequency", reading.frequency, reading.uncertainty("frequency"), "Hz", ""),
        _row("mean_force", reading.mean_force, reading.uncertainty("mean_force"), unit, ""),
        _row(
            "mean_friction",
            reading.mean_friction,
            reading.uncertainty("mean_friction"),
            "",
            "mean of F/W0",
        ),
    ]
    if math.isfinite(found.delta_mu):
        rows.append(
            _row(
                "delta_mu",
                found.delta_mu,
                found.delta_mu_uncertainty,
                "",
                "mean_friction - F(0)/W0 without modulation",
            )
        )
    for side, level in (("before", found.before), ("after", found.after)):
        if level is not None:
            rows.append(_row(f"F0_{side}", level.value, level.uncertainty, unit, "no modulation"))
    for n in range(1, reading.harmonics.size + 1):
        phasor = reading.phasor(n)
        where = f"amplitude of F/W0 at {'' if n == 1 else n}f"
        rows.append(_row(f"mu{n}", phasor.amplitude, phasor.amplitude_uncertainty, "", where))
        rows.append(
            _row(f"phase{n}", phasor.phase, phasor.phase_uncertainty, "rad", "against the load")
        )
    head = (
        f"{name}: {reading.start:.6g} s to {reading.end:.6g} s, {reading.samples} samples, "
        f"{reading.periods:.5g} periods; window chosen by the {found.chosen_by}"
    )
    return "\n".join(
        [head, aligned(rows, "  "), *_quality(found.checks), *_seen(found.samples.findings)]
    )


def static_text(found: StaticMeasurement, name: str) -> str:
    """A recording without modulation, as the command prints it.

    Parameters
    ----------
    found : StaticMeasurement
    name : str
        Of the recording.
    """
    from asperity.units import format_si

    friction = found.friction
    rates = ", ".join(f"{rate:.4g} Hz ({100 * share:.0f} %)" for rate, share in found.rates)
    rows = [_row("friction", friction.value, friction.uncertainty, "", "mean of F/W")]
    if found.load is not None:
        rows.append(_row("load", found.load.value, found.load.uncertainty, found.load_unit, "mean"))
    head = (
        f"{name}: {friction.start:.10g} s to {friction.end:.10g} s, {found.time.size} samples "
        f"at {rates}"
    )
    table = [("from (s)", "to (s)", "velocity", "steady friction", "drift (1/s)", "scatter")]
    for s in found.segments:
        steady = " ".join(
            part for part in _row("", s.steady.value, s.steady.uncertainty, "", "")[1:3] if part
        )
        speed = format_si(s.velocity, "velocity", 4) if math.isfinite(s.velocity) else "-"
        table.append(
            (
                f"{s.start:.10g}",
                f"{s.end:.10g}",
                speed,
                steady,
                f"{s.slope:.2g}",
                f"{s.scatter:.2g}",
            )
        )
    lines = [head, aligned(rows, "  "), "segments", aligned(table, "  ")]
    for k, step in enumerate(found.steps, 1):
        told = [_row("change", step.change, step.uncertainty, "", "of the steady friction")]
        if math.isfinite(step.rate_dependence):
            told.append(
                _row(
                    "A - B",
                    step.rate_dependence,
                    step.rate_uncertainty,
                    "",
                    "change per unit of ln V",
                )
            )
            told.append(("peak", f"{step.peak:.4g}", "", "beyond the level before"))
        lines += [f"step {k}", aligned(told, "  ")]
    return "\n".join([*lines, *_quality(found.checks)])


def _row(name: str, value: float, doubt: float, unit: str, meaning: str) -> tuple[str, ...]:
    """A number with as many digits as its uncertainty allows: two uncertain ones."""
    if not (math.isfinite(doubt) and doubt > 0 and math.isfinite(value)):
        return name, f"{value:.9g} {unit}".strip(), "", meaning
    last = math.floor(math.log10(doubt)) - 1
    digits = max(0, min(15, -last))
    if value and (abs(value) < 1e-3 or abs(value) >= 1e6):
        power = math.floor(math.log10(abs(value)))
        shown = f"{value:.{max(0, min(15, power - last))}e}"
    else:
        shown = f"{value:.{digits}f}"
    return name, f"{shown} {unit}".strip(), f"+- {doubt:.2g}", meaning


def _quality(checks: Iterable[Check]) -> list[str]:
    rows = [(check.verdict, check.name, f"{check.number:.3g}", check.sentence) for check in checks]
    return ["quality", aligned(rows, "  ")]


def _seen(findings: Iterable[Finding]) -> list[str]:
    """What was found anywhere in the recording, read or not."""
    rows = [(f.severity, f.name, f.sentence) for f in findings]
    return ["whole recording", aligned(rows, "  ")] if rows else []
