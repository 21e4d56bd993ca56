"""Measurements of any kind as sections of a report, records for JSON, and rows of tables."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.errors import symbol
from asperity.measurement.campaign import Row, modulated_rows, sliding_rows
from asperity.measurement.record import modulated_record, sliding_record
from asperity.measurement.stick_slip.catalogue import (
    stick_slip_record,
    stick_slip_row,
    summary_rows,
)
from asperity.measurement.verdicts.verdict import Check, worst
from asperity.outputs.sections import Section, rounded
from asperity.parameters import Names
from asperity.units import display_unit, format_si, quantity_text

if TYPE_CHECKING:
    from asperity.measurement.measure import Measurement
    from asperity.measurement.sliding.measure import SlidingMeasurement
    from asperity.measurement.stick_slip.campaign import StickSlipCampaign
    from asperity.measurement.stick_slip.measure import StickSlipMeasurement
    from asperity.recording.finding import Finding


#: A velocity (m/s) below this, a tenth of a nanometre a day, is rounding.
_STILL = 1e-15


def measured_record(measurement: Any) -> dict[str, Any]:
    """A measurement of any kind for JSON."""
    if measurement.mode == "modulated":
        return modulated_record(measurement)
    if measurement.mode == "stick-slip":
        return stick_slip_record(measurement)
    return sliding_record(measurement)


def measured_rows(path: Path, measurement: Any) -> list[Row]:
    """Rows of a recording in a table.

    Parameters
    ----------
    path : Path
    measurement : a measurement of any kind, or a list of Measurement or InputError
        A list holds the modulated stretches.
    """
    if isinstance(measurement, list):
        return modulated_rows(path, measurement)
    if measurement.mode == "modulated":
        return modulated_rows(path, [measurement])
    if measurement.mode == "stick-slip":
        return [stick_slip_row(path, measurement)]
    return sliding_rows(path, measurement)


def measured_sections(measurement: Any, name: str, names: Names = "friction") -> list[Section]:
    """A measurement of any kind.

    Parameters
    ----------
    measurement : Measurement, SlidingMeasurement or StickSlipMeasurement
    name : str
        Name of the recording.
    names : {"friction", "geophysics"}
        In which a load that is a force keeps a name of its own: it is no stress.
    """
    if measurement.mode == "modulated":
        return _modulated(measurement, name, names)
    if measurement.mode == "stick-slip":
        return _stick_slip(measurement, name)
    return _sliding(measurement, name)


def _modulated(measurement: Measurement, name: str, names: Names) -> list[Section]:
    reading, unit = measurement.reading, measurement.samples.unit
    rows = [
        _row(symbol(number), getattr(reading, number), reading.uncertainty(number), of, meaning)
        for number, of, meaning in (
            ("W0", unit, "mean load"),
            ("epsilon", "", f"amplitude of W/{symbol('W0')}"),
            ("frequency", "Hz", f"period {_duration(1 / reading.frequency)}"),
            ("mean_force", unit, ""),
            ("mean_friction", "", f"mean of F/{symbol('W0')}"),
        )
    ]
    if names == "geophysics" and "Pa" not in unit:
        rows[0] = ("load", *rows[0][1:])
    if math.isfinite(measurement.delta_mu):
        change, doubt = measurement.delta_mu, measurement.delta_mu_uncertainty
        meaning = f"mean_friction - F(0)/{symbol('W0')} without modulation"
        rows.append(_row("delta_mu", change, doubt, "", meaning))
    for side, level in (("before", measurement.before), ("after", measurement.after)):
        if level is not None:
            rows.append(_row(f"F0_{side}", level.value, level.uncertainty, unit, "no modulation"))
    for n in range(1, reading.harmonics.size + 1):
        phasor = reading.phasor(n)
        where = f"amplitude of F/{symbol('W0')} at {'' if n == 1 else n}f"
        rows.append(_row(f"mu{n}", phasor.amplitude, phasor.amplitude_uncertainty, "", where))
        rows.append(
            _row(f"phase{n}", phasor.phase, phasor.phase_uncertainty, "rad", "against the load")
        )
    head = (
        f"{name}: {_time(reading.start)} s to {_duration(reading.end)}, {reading.samples} samples, "
        f"{reading.periods:.5g} periods; window chosen by the {measurement.chosen_by}"
    )
    return [
        Section(head, rows=tuple(rows)),
        _quality(measurement.checks),
        *_findings(measurement.samples.findings),
        *_unread(measurement.samples.unread),
    ]


def amplitude_sections(rows: list[dict[str, Any]], name: str) -> list[Section]:
    """The amplitudes of a recording as a table.

    Parameters
    ----------
    rows : list of dict
        From `asperity.measurement.campaign.modulated_rows`.
    name : str
        Name of the recording.
    """
    shown = ("epsilon", "frequency", "mean_friction", "delta_mu", "mu1", "phase1", "mu2")
    table = []
    for row in rows:
        if not row["reason"]:
            values = [(row.get(n), row.get(f"{n}_uncertainty", math.nan)) for n in shown]
            cells = ["-" if v is None or not math.isfinite(v) else _number(v, d) for v, d in values]
            times = _duration(row["start"]), _duration(row["end"])
            table.append((str(row["part"]), *times, *cells, row["verdict"]))
    notes = [f"part {row['part']}: {row['reason']}" for row in rows if row["reason"]]
    notes += [f"part {row['part']}: {row['checks']}" for row in rows if row.get("checks")]
    count = f"{name}: {len(rows)} modulated {'part' if len(rows) == 1 else 'parts'}"
    units = {"frequency": "frequency (Hz)", "phase1": "phase1 (rad)"}
    head = ("part", "from", "to", *(units.get(n, n) for n in shown), "verdict")
    return [Section(count, head=head, rows=tuple(table)), Section("", tuple(notes))]


def _sliding(measurement: SlidingMeasurement, name: str) -> list[Section]:
    friction = measurement.friction
    rates = ", ".join(f"{rate:.4g} Hz ({100 * share:.0f} %)" for rate, share in measurement.rates)
    rows = [_row("friction", friction.value, friction.uncertainty, "", "mean of F/W")]
    if (load := measurement.load) is not None:
        rows.append(_row("load", load.value, load.uncertainty, measurement.load_unit, "mean"))
    head = (
        f"{name}: {_time(friction.start)} s to {_time(friction.end)} s, "
        f"{measurement.time.size} samples at {rates}"
    )
    segments = tuple(
        (
            _time(s.start),
            _time(s.end),
            "hold" if s.hold else velocity_text(s.velocity),
            _number(s.steady.value, s.steady.uncertainty),
            f"{s.slope:.2g}",
            f"{s.scatter:.2g}",
        )
        for s in measurement.segments
    )
    columns = ("from (s)", "to (s)", "velocity", "mean friction", "drift (1/s)", "scatter")
    return [
        Section(head, rows=tuple(rows)),
        Section(f"segments, chosen by the {measurement.chosen_by}", head=columns, rows=segments),
        *_steps(measurement),
        *_holds(measurement),
        _quality(measurement.checks),
        *_unread(measurement.unread),
    ]


def _stick_slip(measurement: StickSlipMeasurement, name: str) -> list[Section]:
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
        rows.append(_row("stiffness", stiffness, doubt, "N/m", f"loading_slope {symbol('W0/V')}"))
    smallest = f"{measurement.smallest_drop:.2g}"
    rows.append(("smallest_drop", smallest, "", "a smaller one may not have been seen"))
    columns = ("from (s)", "to (s)", "regime", "evidence")
    return [
        Section(head),
        Section("regimes", head=columns, rows=tuple(parts)),
        Section("slip events", rows=tuple(rows)),
        _quality(measurement.checks),
    ]


def healing_section(campaign: StickSlipCampaign) -> Section:
    """Healing of each machine of a campaign.

    Parameters
    ----------
    campaign : StickSlipCampaign
    """
    title = (
        f"drop per e-fold of stick time; about 2 ({symbol('B - A')}) of a rate-and-state law, far "
        "below the critical stiffness"
    )
    return Section(title, rows=tuple((line.name, line.value) for line in campaign.summary()[1]))


def _time(seconds: float) -> str:
    """A time of a recording, to 0.01 ms: what a fit of the clock leaves about zero is zero."""
    return f"{round(float(seconds), 5) + 0.0:.10g}"


def _duration(seconds: float) -> str:
    """A duration in the unit that reads best, hours and days among them."""
    for unit, size in (("d", 86400), ("h", 3600)):
        if seconds >= 2 * size:
            return f"{seconds / size:.6g} {unit}"
    return quantity_text(seconds, "s", 6)


def velocity_text(velocity: float) -> str:
    """A velocity with four digits; "-" where it is not known, zero below an atom a day."""
    if not math.isfinite(velocity):
        return "-"
    return "0 m/s" if abs(velocity) < _STILL else format_si(velocity, "velocity", 4)


def _steps(measurement: SlidingMeasurement) -> list[Section]:
    sections = []
    for k, step in enumerate(measurement.steps, 1):
        meaning = (
            f"of steady friction at the step; noise {step.noise_uncertainty:.2g}, choice of "
            f"window and trend {step.choice_uncertainty:.2g}"
        )
        rows = [_row("change", step.change, step.uncertainty, "", meaning)]
        if math.isfinite(step.rate_dependence):
            slope, doubt = step.rate_dependence, step.rate_uncertainty
            meaning = f"d mu/d ln V; 95 %: +- {step.rate_interval_95:.2g}"
            rows.append(_row(symbol("A - B"), slope, doubt, "", meaning))
            rows.append(("peak", f"{step.peak:.4g}", "", "beyond the level before"))
        if step.trend != "none":
            # Trends are over slip where both velocities are known, and over time otherwise.
            known = abs(step.velocity_before * step.velocity_after) > 0
            scale, unit = (1e-3, "/mm") if known else (1.0, "/s")
            before, after = (
                f"{scale * s:.2g} {unit}" for s in (step.slope_before, step.slope_after)
            )
            rows.append(("trend", step.trend, "", f"{before} before, {after} after"))
        speeds = f"{velocity_text(step.velocity_before)} to {velocity_text(step.velocity_after)}"
        sections.append(Section(f"step {k} at {step.time:.10g} s, {speeds}", rows=tuple(rows)))
    return sections


def _holds(measurement: SlidingMeasurement) -> list[Section]:
    if not measurement.holds:
        return []
    table = []
    for hold in measurement.holds:
        numbers = (
            (hold.level, hold.level_uncertainty),
            (hold.relaxation, hold.relaxation_uncertainty),
            (hold.peak, 0.0),
            (hold.healing, hold.healing_uncertainty),
            (1e-3 * hold.reload_slope, 1e-3 * hold.reload_uncertainty),
        )
        cells = [_number(value, doubt) if doubt else f"{value:.5g}" for value, doubt in numbers]
        cells[-1] = cells[-1] if math.isfinite(hold.reload_slope) else "-"
        table.append((f"{hold.start:.10g}", f"{hold.hold_time:.4g}", *cells))
    head = ("from (s)", "hold (s)", "level", "relaxation", "peak", "healing", "reload (1/mm)")
    sections = [Section("holds", head=head, rows=tuple(table))]
    if (rate := measurement.healing) is not None:
        meaning = f"per decade of hold time, {rate.holds} holds; 95 %: +- {rate.interval_95:.2g}"
        row = _row("healing rate", rate.per_decade, rate.uncertainty, "", meaning)
        sections.append(Section("", rows=(row,)))
    return sections


def _row(name: str, value: float, doubt: float, unit: str, meaning: str) -> tuple[str, ...]:
    """A number rounded to two digits of its uncertainty."""
    # In a unit with a prefix, such as MPa, or in days.
    unit, power = display_unit(value, unit)
    number, uncertain = rounded(value * 10.0**-power, doubt * 10.0**-power)
    return name, f"{number} {unit}".strip(), uncertain, meaning


def _number(value: float, doubt: float) -> str:
    """A number and its uncertainty, as in `_row`."""
    return " ".join(part for part in rounded(value, doubt) if part)


def _quality(checks: Iterable[Check]) -> Section:
    """A row for each name of a check: the worst of that name, and the number of the others."""
    by_name: dict[str, list[Check]] = {}
    for check in checks:
        by_name.setdefault(check.name, []).append(check)
    rows = []
    for name, same in by_name.items():
        gravest = worst(same)
        check = next(c for c in same if c.verdict == gravest)
        more = f" (and {len(same) - 1} more)" if len(same) > 1 else ""
        rows.append((check.verdict, name, f"{check.number:.3g}", check.sentence + more))
    return Section("quality", rows=tuple(rows))


def _findings(findings: Iterable[Finding]) -> list[Section]:
    """Findings of the whole recording, within the window or not."""
    rows = tuple((f.severity, f.name, f.sentence) for f in findings)
    return [Section("whole recording", rows=rows)] if rows else []


def _unread(count: int) -> list[Section]:
    """One line for findings about columns that are not read."""
    findings = "finding is" if count == 1 else "findings are"
    text = f"{count} more {findings} about columns that were not read"
    return [Section(text)] if count else []
