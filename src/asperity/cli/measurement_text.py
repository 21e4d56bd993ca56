"""Measurements as aligned text."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from asperity.outputs.tables import Row, aligned, rounded
from asperity.parameters import Names, display_name, in_names

if TYPE_CHECKING:
    from asperity.measurement.measure import Measurement
    from asperity.measurement.sliding.measure import SlidingMeasurement
    from asperity.measurement.stick_slip.campaign import StickSlipCampaign
    from asperity.measurement.stick_slip.measure import StickSlipMeasurement
    from asperity.measurement.verdicts.verdict import Check
    from asperity.recording.finding import Finding


#: A velocity (m/s) below this, a tenth of a nanometre a day, is rounding.
_STILL = 1e-15


def modulated_text(measurement: Measurement, name: str, names: Names = "friction") -> str:
    """A reading, as the command prints it.

    Parameters
    ----------
    measurement : Measurement
    name : str
        Of the recording.
    names : {"friction", "geophysics"}
    """
    reading, unit = measurement.reading, measurement.samples.unit
    rows = [
        _row(number, getattr(reading, number), reading.uncertainty(number), of, meaning)
        for number, of, meaning in (
            ("W0", unit, "mean load"),
            ("epsilon", "", "amplitude of W/W0"),
            ("frequency", "Hz", ""),
            ("mean_force", unit, ""),
            ("mean_friction", "", "mean of F/W0"),
        )
    ]
    if math.isfinite(measurement.delta_mu):
        change, doubt = measurement.delta_mu, measurement.delta_mu_uncertainty
        meaning = "mean_friction - F(0)/W0 without modulation"
        rows.append(_row("delta_mu", change, doubt, "", meaning))
    for side, level in (("before", measurement.before), ("after", measurement.after)):
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
        f"{reading.periods:.5g} periods; window chosen by the {measurement.chosen_by}"
    )
    return "\n".join(
        [
            head,
            _named(rows, names),
            *_quality(measurement.checks),
            *_findings(measurement.samples.findings),
            *_unread(measurement.samples.unread),
        ]
    )


def amplitudes_text(rows: list[dict[str, Any]], name: str) -> str:
    """The amplitudes of a recording as a table.

    Parameters
    ----------
    rows : list of dict
        From `asperity.measurement.campaign.modulated_rows`.
    name : str
        Of the recording.
    """
    shown = ("epsilon", "frequency", "mean_friction", "delta_mu", "mu1", "phase1", "mu2")
    head = ("part", "from (s)", "to (s)", *shown, "verdict")
    table: list[tuple[str, ...]] = [head]
    reasons = []
    for row in rows:
        if row["reason"]:
            reasons.append(f"part {row['part']}: {row['reason']}")
            continue
        cells = []
        for number in shown:
            value, doubt = row.get(number), row.get(f"{number}_uncertainty", math.nan)
            if value is None or not math.isfinite(value):
                cells.append("-")
                continue
            cells.append(_number(value, doubt))
        times = f"{row['start']:.6g}", f"{row['end']:.6g}"
        table.append((str(row["part"]), *times, *cells, row["verdict"]))
    named = [f"part {row['part']}: {row['checks']}" for row in rows if row.get("checks")]
    count = f"{name}: {len(rows)} modulated {'part' if len(rows) == 1 else 'parts'}"
    return "\n".join([count, aligned(table, "  "), *reasons, *named])


def sliding_text(measurement: SlidingMeasurement, name: str, names: Names = "friction") -> str:
    """A recording without modulation, as the command prints it.

    Parameters
    ----------
    measurement : SlidingMeasurement
    name : str
        Of the recording.
    names : {"friction", "geophysics"}
    """
    friction = measurement.friction
    rates = ", ".join(f"{rate:.4g} Hz ({100 * share:.0f} %)" for rate, share in measurement.rates)
    rows = [_row("friction", friction.value, friction.uncertainty, "", "mean of F/W")]
    if (load := measurement.load) is not None:
        rows.append(_row("load", load.value, load.uncertainty, measurement.load_unit, "mean"))
    head = (
        f"{name}: {_time(friction.start)} s to {_time(friction.end)} s, "
        f"{measurement.time.size} samples at {rates}"
    )
    lines = [
        head,
        aligned(rows, "  "),
        *_segments(measurement),
        *_steps(measurement, names),
        *_holds(measurement),
    ]
    return "\n".join([*lines, *_quality(measurement.checks), *_unread(measurement.unread)])


def stick_slip_text(measurement: StickSlipMeasurement, name: str, names: Names = "friction") -> str:
    """A stick-slip recording, as the command prints it.

    Parameters
    ----------
    measurement : StickSlipMeasurement
    name : str
        Of the recording.
    names : {"friction", "geophysics"}
    """
    from asperity.measurement.stick_slip.catalogue import summary_rows

    time = measurement.time
    rate = (time.size - 1) / float(time[-1] - time[0])
    head = (
        f"{name}: {_time(time[0])} s to {_time(time[-1])} s, {time.size} samples at {rate:.4g} Hz"
    )
    parts = [(f"{r.start:.6g}", f"{r.end:.6g}", r.kind, r.evidence) for r in measurement.regimes]
    slope, doubt = measurement.loading_slope, measurement.loading_slope_uncertainty
    rows = [
        ("events", str(len(measurement.events)), "", ""),
        *summary_rows(measurement),
        _row("loading_slope", slope, doubt, "1/s", "median of F/W in the sticks"),
    ]
    stiffness, doubt = measurement.stiffness_from_slope
    if math.isfinite(stiffness):
        rows.append(_row("stiffness", stiffness, doubt, "N/m", "loading_slope W0/V"))
    smallest = f"{measurement.smallest_drop:.2g}"
    rows.append(("smallest_drop", smallest, "", "a smaller one may not have been seen"))
    return "\n".join(
        [
            head,
            "regimes",
            aligned([("from (s)", "to (s)", "regime", "evidence"), *parts], "  "),
            "slip events",
            _named(rows, names),
            *_quality(measurement.checks),
        ]
    )


def healing_text(campaign: StickSlipCampaign, names: Names = "friction") -> str:
    """Healing of each machine of a campaign, as the command prints it.

    Parameters
    ----------
    campaign : StickSlipCampaign
    names : {"friction", "geophysics"}
    """
    _, lines = campaign.summary()
    twice = "(B - A)" if names == "friction" else "(b - a)"
    return "\n".join(
        [
            "drop per e-fold of stick time; about 2 "
            f"{twice} of a rate-and-state law, far below the critical stiffness",
            aligned([(line.name, line.value) for line in lines], "  "),
        ]
    )


def _time(seconds: float) -> str:
    """A time of a recording, to a nanosecond: what a fit of the clock leaves about zero is zero."""
    return f"{round(float(seconds), 9) + 0.0:.10g}"


def _segments(measurement: SlidingMeasurement) -> list[str]:
    table = [("from (s)", "to (s)", "velocity", "mean friction", "drift (1/s)", "scatter")]
    for s in measurement.segments:
        steady = _number(s.steady.value, s.steady.uncertainty)
        table.append(
            (
                _time(s.start),
                _time(s.end),
                "hold" if s.hold else velocity_text(s.velocity),
                steady,
                f"{s.slope:.2g}",
                f"{s.scatter:.2g}",
            )
        )
    return [f"segments, chosen by the {measurement.chosen_by}", aligned(table, "  ")]


def velocity_text(velocity: float) -> str:
    """A velocity with four digits; "-" where it is not known, zero below an atom a day."""
    from asperity.units import format_si

    if not math.isfinite(velocity):
        return "-"
    return "0 m/s" if abs(velocity) < _STILL else format_si(velocity, "velocity", 4)


def _steps(measurement: SlidingMeasurement, names: Names) -> list[str]:
    lines = []
    for k, step in enumerate(measurement.steps, 1):
        meaning = (
            f"of steady friction at the step; noise {step.noise_uncertainty:.2g}, choice of "
            f"window and trend {step.choice_uncertainty:.2g}"
        )
        rows = [_row("change", step.change, step.uncertainty, "", meaning)]
        if math.isfinite(step.rate_dependence):
            slope, doubt = step.rate_dependence, step.rate_uncertainty
            meaning = f"d mu/d ln V; 95 %: +- {step.rate_interval_95:.2g}"
            rows.append(_row("A - B", slope, doubt, "", meaning))
            rows.append(("peak", f"{step.peak:.4g}", "", "beyond the level before"))
        if step.trend != "none":
            before, after = (_slope(measurement, s) for s in (step.slope_before, step.slope_after))
            rows.append(("trend", step.trend, "", f"{before} before, {after} after"))
        speeds = f"{velocity_text(step.velocity_before)} to {velocity_text(step.velocity_after)}"
        lines += [f"step {k} at {step.time:.10g} s, {speeds}", _named(rows, names)]
    return lines


def _slope(measurement: SlidingMeasurement, slope: float) -> str:
    return f"{1e-3 * slope:.2g} /mm" if measurement.velocity_from else f"{slope:.2g} /s"


def _holds(measurement: SlidingMeasurement) -> list[str]:
    if not measurement.holds:
        return []
    table: list[tuple[str, ...]] = [
        ("from (s)", "hold (s)", "level", "relaxation", "peak", "healing", "reload (1/mm)")
    ]
    for hold in measurement.holds:
        numbers = (
            (hold.level, hold.level_uncertainty),
            (hold.relaxation, hold.relaxation_uncertainty),
            (hold.peak, 0.0),
            (hold.healing, hold.healing_uncertainty),
        )
        cells = [_number(value, doubt) if doubt else f"{value:.5g}" for value, doubt in numbers]
        reload = f"{1e-3 * hold.reload_slope:.3g}" if math.isfinite(hold.reload_slope) else "-"
        table.append((f"{hold.start:.10g}", f"{hold.hold_time:.4g}", *cells, reload))
    lines = ["holds", aligned(table, "  ")]
    if measurement.healing is not None:
        rate = measurement.healing
        meaning = f"per decade of hold time, {rate.holds} holds; 95 %: +- {rate.interval_95:.2g}"
        row = _row("healing rate", rate.per_decade, rate.uncertainty, "", meaning)
        lines.append(aligned([row], "  "))
    return lines


def _row(name: str, value: float, doubt: float, unit: str, meaning: str) -> tuple[str, ...]:
    """A number with as many digits as its uncertainty allows: two uncertain ones."""
    number, uncertain = rounded(value, doubt)
    return name, f"{number} {unit}".strip(), uncertain, meaning


def _number(value: float, doubt: float) -> str:
    """A number and its uncertainty, as in `_row`."""
    return " ".join(part for part in rounded(value, doubt) if part)


def _named(rows: Iterable[Row], names: Names) -> str:
    """Rows in a set of names; a load that is a force is no stress."""
    texts = [list(row) for row in rows]
    for row in texts if names == "geophysics" else ():
        row[0] = "load" if row[0] == "W0" and "Pa" not in row[1] else display_name(row[0], names)
        row[-1] = in_names(row[-1], names)
    return aligned(texts, "  ")


def _quality(checks: Iterable[Check]) -> list[str]:
    """A row for each name of a check: the worst of that name, and the number of the others."""
    by_name: dict[str, list[Check]] = {}
    for check in checks:
        by_name.setdefault(check.name, []).append(check)
    from asperity.measurement.verdicts.verdict import worst

    rows = []
    for name, same in by_name.items():
        gravest = worst(same)
        check = next(c for c in same if c.verdict == gravest)
        more = f" (and {len(same) - 1} more)" if len(same) > 1 else ""
        rows.append((check.verdict, name, f"{check.number:.3g}", check.sentence + more))
    return ["quality", aligned(rows, "  ")]


def _findings(findings: Iterable[Finding]) -> list[str]:
    """Findings of the whole recording, within the window or not."""
    rows = [(f.severity, f.name, f.sentence) for f in findings]
    return ["whole recording", aligned(rows, "  ")] if rows else []


def _unread(count: int) -> list[str]:
    """One line for findings about columns that are not read."""
    findings = "finding is" if count == 1 else "findings are"
    return [f"{count} more {findings} about columns that were not read"] if count else []
