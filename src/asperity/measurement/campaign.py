"""Many recordings measured alike: one table, a row for each amplitude, velocity step and hold.

Files are measured in separate processes. Finished rows are kept next to the output as lines of
JSON, so that an interrupted campaign goes on where it stopped; at the end the table is written as
CSV or NetCDF. A file that cannot be measured is a row with its reason.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity._processes import process_pool
from asperity.errors import InputError, require
from asperity.measurement.record import observable_covariance
from asperity.measurement.verdicts.verdict import Judged, doubts_text
from asperity.outputs import UnfinishedText, output_file, write_table, written_file
from asperity.parameters.arguments import typed

if TYPE_CHECKING:
    import xarray as xr

    from asperity.measurement.measure import Measurement
    from asperity.measurement.sliding.holds import HoldReading
    from asperity.measurement.sliding.measure import SlidingMeasurement
    from asperity.measurement.sliding.velocity_steps import VelocityStep

Row = dict[str, Any]

#: Columns that stand first; the others follow in the order of their first row.
_FIRST = ("file", "part", "kind", "start", "end", "verdict", "reason")
#: Kinds of rows without modulation.
_SLIDING_KINDS = ("step", "hold", "level", "stick-slip")
#: Fields of steps and holds that the table does not have, or has under another name.
_LEFT_OUT = {"time", "start", "end", "dof", "uncertainty", "slope_before", "slope_after", "choices"}


@dataclass(frozen=True)
class CampaignSummary:
    """Outcome of a campaign.

    Attributes
    ----------
    files, rows, failed, sliding : int
        Files measured, rows of the table, rows without result among them, and files that were read
        without modulation.
    out : Path
    table : list of dict
        The rows.
    """

    files: int
    rows: int
    failed: int
    sliding: int
    out: Path
    table: list[Row]


@typed
def run_campaign(
    files: Sequence[Path],
    rows_of: Callable[[Path], list[Row]],
    out: Path,
    *,
    inputs: Mapping[str, Any],
    resume: bool = False,
    jobs: int = 1,
    progress: Callable[[int, int, str], None] | None = None,
) -> CampaignSummary:
    """Measure files one by one and write their rows as one table.

    Parameters
    ----------
    files : sequence of Path
    rows_of : callable
        Rows of one file; it can be sent to another process, and lets no `InputError` out.
    out : Path
        ``.csv`` or ``.nc``.
    inputs : mapping
        All that the rows depend on except the files, as JSON values.
    resume : bool
        Go on after an interruption.
    jobs : int
        Processes.
    progress : callable, optional
        Called with files done, all files, and the name of the last.

    Raises
    ------
    InputError
        If `out` cannot be written, or what an interrupted campaign has left belongs to others.
    Interrupted
        On Ctrl-C.
    """
    out = table_file(out, "--out", {f"recording '{f}'": f for f in files})
    report = progress or (lambda done, total, label: None)
    unfinished = UnfinishedText(out, {**inputs, "files": {str(f): _stamp(f) for f in files}})
    done = int(unfinished.start(resume).get("files", 0))
    report(done, len(files), "")
    with unfinished.interruptible(lambda: f"{done} of {len(files)} files"):
        for path, rows in _measured(files[done:], rows_of, jobs):
            text = "".join(f"{json.dumps(row)}\n" for row in rows)
            failed = sum(bool(row["reason"]) for row in rows)
            unfinished.append(text, len(rows), files=1, failed=failed)
            done += 1
            report(done, len(files), path.name)
        table = [json.loads(line) for line in unfinished.text().splitlines()]
        write_rows(out, table, "--out")
        unfinished.discard()
    failed = sum(bool(row["reason"]) for row in table)
    sliding = {row["file"] for row in table if row["kind"] in _SLIDING_KINDS}
    return CampaignSummary(len(files), len(table), failed, len(sliding), out, table)


def table_file(
    path: str | os.PathLike[str], name: str, inputs: Mapping[str, Path] | None = None
) -> Path:
    """Path of a table that can be written; parameters as of `asperity.outputs.output_file`.

    Raises
    ------
    InputError
        If its end names neither CSV nor NetCDF, or it cannot be written.
    """
    rule, advice = "be a CSV or a NetCDF file", "write it like campaign.csv"
    require(Path(path).suffix.lower() in (".csv", ".nc"), name, rule, f"'{path}'", advice)
    return output_file(path, name, example="campaign.csv", inputs=inputs)


def write_rows(path: Path, table: list[Row], name: str) -> None:
    """Write rows as CSV or NetCDF, completely or not at all.

    Parameters
    ----------
    path : Path
        From `table_file`.
    table : list of dict
        From `modulated_rows` and `sliding_rows`.
    name : str
        Name of the argument in messages.
    """
    with written_file(path, name) as file:
        (write_csv if path.suffix.lower() == ".csv" else _write_netcdf)(file, table)


def _stamp(path: Path) -> str:
    """Size and time of change of a file; what is not there has none."""
    try:
        status = path.stat()
    except OSError:
        return "missing"
    return f"{status.st_size} bytes, {status.st_mtime_ns}"


def _measured(
    files: Sequence[Path], rows_of: Callable[[Path], list[Row]], jobs: int
) -> Iterator[tuple[Path, list[Row]]]:
    jobs = min(jobs, len(files))
    if jobs <= 1:
        for path in files:
            yield path, rows_of(path)
        return
    with process_pool(jobs, "jobs") as pool:
        yield from zip(files, pool.map(rows_of, files), strict=True)


def failed_row(path: Path, part: int, reason: str) -> Row:
    """The row of what could not be measured."""
    return {"file": str(path), "part": part, "kind": "", "verdict": "", "reason": reason}


def first_columns(
    path: Path, part: int, kind: str, start: float, end: float, measurement: Judged
) -> Row:
    """The columns that every row has but the checks, which stand last."""
    verdict = measurement.verdict
    values = (str(path), part, kind, float(start), float(end), verdict, "")
    return dict(zip(_FIRST, values, strict=True))


def modulated_rows(path: Path, measurements: Iterable[Measurement | InputError]) -> list[Row]:
    """Rows of the amplitudes of one recording, in their order.

    Parameters
    ----------
    path : Path
    measurements : iterable of Measurement or InputError
        From `asperity.measurement.measure.measure_amplitudes`.
    """
    rows = []
    for part, measurement in enumerate(measurements, 1):
        if isinstance(measurement, InputError):
            rows.append(failed_row(path, part, str(measurement)))
            continue
        reading = measurement.reading
        row = first_columns(path, part, "amplitude", reading.start, reading.end, measurement)
        observables = reading.observables()
        row |= observables
        row |= {f"{name}_uncertainty": reading.uncertainty(name) for name in observables}
        row |= {
            "static_friction": measurement.static_friction,
            "delta_mu": measurement.delta_mu,
            "delta_mu_uncertainty": measurement.delta_mu_uncertainty,
            "delta_mu_interval_95": measurement.delta_mu_interval_95,
            "unit": measurement.samples.unit,
            "checks": doubts_text(measurement.checks),
        }
        observed, covariance = observable_covariance(measurement)
        row |= {
            f"{first}_{second}_cov": float(covariance[i, j])
            for j, second in enumerate(observed)
            for i, first in enumerate(observed[:j])
        }
        rows.append(row)
    return rows


def sliding_rows(path: Path, measurement: SlidingMeasurement) -> list[Row]:
    """Rows of the velocity steps and holds of one recording; of its mean friction without any."""
    friction, healing = measurement.friction, measurement.healing
    parts: list[tuple[str, float, float, Row]] = [
        *(("step", s.time, s.time, _columns_of_step(s)) for s in measurement.steps),
        *(("hold", h.start, h.end, _columns_of(h)) for h in measurement.holds),
    ]
    parts = sorted(parts, key=lambda part: part[1]) or [("level", friction.start, friction.end, {})]
    more = {
        "mean_friction": friction.value,
        "mean_friction_uncertainty": friction.uncertainty,
        "healing_per_decade": healing.per_decade if healing else math.nan,
        "healing_per_decade_uncertainty": healing.uncertainty if healing else math.nan,
        "checks": doubts_text(measurement.checks),
    }
    return [
        first_columns(path, k, kind, start, end, measurement) | columns | more
        for k, (kind, start, end, columns) in enumerate(parts, 1)
    ]


def _columns_of_step(step: VelocityStep) -> Row:
    # Without velocities the settling slip is a time.
    slip = step.settling_slip if math.isfinite(step.velocity_before) else math.nan
    more = {"change_uncertainty": step.uncertainty, "settling_slip": slip}
    return _columns_of(step) | more


def _columns_of(reading: VelocityStep | HoldReading) -> Row:
    return {f.name: getattr(reading, f.name) for f in fields(reading) if f.name not in _LEFT_OUT}


def _columns(table: list[Row]) -> list[str]:
    names = dict.fromkeys(_FIRST)
    for row in table:
        names |= dict.fromkeys(row)
    names.pop("checks", None)
    return [*names, "checks"]


def write_csv(path: Path, table: list[Row]) -> None:
    """Write rows as a table with a column for each of their fields.

    Parameters
    ----------
    path : Path
    table : list of dict
        From `modulated_rows` and `sliding_rows`.
    """
    names = _columns(table)
    write_table(path, names, ([_cell(row.get(name, "")) for name in names] for row in table))


def _cell(value: Any) -> Any:
    """Text of a cell; empty for an unknown value."""
    return "" if isinstance(value, float) and not math.isfinite(value) else value


def _write_netcdf(path: Path, table: list[Row]) -> None:
    data = labelled_rows(table).assign_attrs(title="asperity measure: one row a file and part")
    data.to_netcdf(path, engine="h5netcdf")


def labelled_rows(table: list[Row]) -> xr.Dataset:
    """Rows as a Dataset over ``row``, numbers with their units; a text is empty where unknown."""
    import pandas as pd

    frame = pd.DataFrame(table, columns=_columns(table))
    numbers = [
        n for n in frame if frame[n].map(lambda v: v is None or not isinstance(v, str)).all()
    ]
    texts = frame.columns.difference(numbers, sort=False)
    frame = frame.astype(dict.fromkeys(numbers, float)).fillna(dict.fromkeys(texts, ""))
    data = frame.rename_axis("row").to_xarray().drop_vars("row")
    for name in numbers:
        data[name].attrs = {"units": _unit(str(name))}
    return data


def _unit(name: str) -> str:
    """SI unit of a column; empty for W0 and mean_force, whose unit is in the column 'unit'."""
    stem = re.sub(r"_(uncertainty|interval_95|spread)$", "", name)
    # All phases have one unit, as have the velocities before and after a step.
    return _UNITS.get(re.sub(r"\d+$|_(before|after)$", "", stem), _UNITS.get(stem, "1"))


#: Units of the columns that are no pure numbers.
_UNITS = {
    **dict.fromkeys(("start", "end", "hold_time", "peak_time", "recurrence"), "s"),
    **dict.fromkeys(("stick_duration", "slip_duration"), "s"),
    **dict.fromkeys(("frequency", "linear_frequency"), "Hz"),
    **dict.fromkeys(("reload_slope", "reload"), "1/m"),
    **dict.fromkeys(("K", "stiffness_from_slope"), "N/m"),
    **dict.fromkeys(("velocity", "V"), "m/s"),
    **dict.fromkeys(("W0", "mean_force"), ""),
    "settling_slip": "m",
    "loading_slope": "1/s",
    "M": "kg",
    "phase": "rad",
}
