"""The catalogue of slip events as CSV, NetCDF or JSON, and a recording as one row or one record."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import require
from asperity.measurement.campaign import first_columns
from asperity.measurement.levels_and_trends import mean_level
from asperity.measurement.stick_slip.threshold import linear_frequency
from asperity.measurement.verdicts.verdict import doubts_text, percent
from asperity.outputs import json, written_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from asperity.measurement.stick_slip.measure import StickSlipMeasurement


CONVENTIONS = (
    "forces are F/W; drop = force_before - force_after; recurrence and stick_duration run from the "
    "onset and the end of the event before to the onset; creep is what the force at onset lacks to "
    "the line of the middle half of the stick; slip and slip_velocity are those of the slider's "
    "displacement where it is recorded, else slip_velocity = V - dF/dt/K; uncertainties are "
    "standard uncertainties"
)
#: Columns of the catalogue: unit and meaning.
COLUMNS: dict[str, tuple[str, str]] = {
    "onset": ("s", "time at which the force begins to fall"),
    "end": ("s", "time at which it ceases to fall"),
    "timing_uncertainty": ("s", "of either"),
    "stick_duration": ("s", "from the end of the event before to the onset"),
    "slip_duration": ("s", "from onset to end"),
    "recurrence": ("s", "from the onset of the event before to the onset"),
    "force_before": ("1", "F/W at onset"),
    "force_after": ("1", "F/W at the end"),
    "drop": ("1", "fall of F/W"),
    "drop_uncertainty": ("1", ""),
    "loading_slope": ("1/s", "of F/W in the middle half of the stick"),
    "slope_uncertainty": ("1/s", ""),
    "creep": ("1", "what F/W at onset lacks to the line of that slope"),
    "creep_uncertainty": ("1", ""),
    "fall_rate": ("1/s", "steepest fall of F/W"),
    "slip": ("m", "of the slider"),
    "slip_velocity": ("m/s", "largest"),
    "energy": ("J", "released by the spring"),
}
_OF_MEASUREMENT = ("slip", "slip_velocity", "energy")


def column(measurement: StickSlipMeasurement, name: str) -> Float:
    """Values of a column of `COLUMNS`, one for each event."""
    source: Any = measurement if name in _OF_MEASUREMENT else measurement.events
    return np.asarray(getattr(source, name), dtype=float)


def _table(measurement: StickSlipMeasurement) -> pd.DataFrame:
    """Columns of `COLUMNS` and the regime, an event a row."""
    import pandas as pd

    table = pd.DataFrame({name: column(measurement, name) for name in COLUMNS})
    counts = [regime.stop - regime.first for regime in measurement.regimes]
    return table.assign(regime=np.repeat([r.kind for r in measurement.regimes], counts))


def catalogue(measurement: StickSlipMeasurement) -> xr.Dataset:
    """All events as a labelled table.

    Parameters
    ----------
    measurement : StickSlipMeasurement

    Returns
    -------
    xarray.Dataset
        A variable over ``event`` for each of `COLUMNS`, with units, and the regime.
    """
    import xarray as xr

    table = xr.Dataset.from_dataframe(_table(measurement).rename_axis("event"))
    for name, (unit, meaning) in COLUMNS.items():
        table[name].attrs = {"units": unit, "long_name": meaning}
    title = "slip events of a recording, by asperity measure"
    return table.assign_attrs(title=title, conventions=CONVENTIONS)


def write_catalogue(measurement: StickSlipMeasurement, path: Path) -> None:
    """Write the catalogue in the format that the ending of the path names.

    Parameters
    ----------
    measurement : StickSlipMeasurement
    path : Path
        ``.csv``, ``.nc`` or ``.json``.

    Raises
    ------
    InputError
        If the ending is another, or the file cannot be written.
    """
    ending = check_catalogue(path)
    units = {name: unit for name, (unit, _) in COLUMNS.items()}
    with written_file(path, "--events") as file:
        if ending == ".nc":
            catalogue(measurement).to_netcdf(file, engine="h5netcdf")
        elif ending == ".json":
            events = events_record(measurement)
            record = {"units": units, "conventions": CONVENTIONS, "events": events}
            file.write_text(json.to_json(record, indent=2) + "\n", encoding="utf-8")
        else:
            heads = {name: f"{name} ({unit})" for name, unit in units.items() if unit != "1"}
            _table(measurement).rename(columns=heads).to_csv(
                file, index=False, float_format="%.10g", lineterminator="\n"
            )


def check_catalogue(path: Path) -> str:
    """Ending of the catalogue's file; raises `InputError` for one that is not written."""
    ending = path.suffix.lower()
    rule, advice = "be a CSV, NetCDF or JSON file", "write it like events.csv"
    require(ending in (".csv", ".nc", ".json"), "measure.events", rule, f"'{path}'", advice)
    return ending


def events_record(measurement: StickSlipMeasurement) -> list[dict[str, Any]]:
    """Events as dicts of numbers."""
    return _table(measurement).to_dict("records")


def means(measurement: StickSlipMeasurement) -> dict[str, float]:
    """Number, means and spreads (standard deviations) of the events, as a campaign's row has them.

    Uncertainties of means are from the spread, with events as independent. The fitted shape of
    slips may be wrong, which is an error that all durations of a recording have in common.
    """
    events = measurement.events
    common = np.sqrt(2.0) * float(np.median(events.timing_uncertainty)) if len(events) else 0.0
    row: dict[str, float] = {"events": len(events)}
    for name in ("drop", "recurrence", "stick_duration", "slip_duration"):
        values = column(measurement, name)
        values = values[np.isfinite(values)]
        if values.size:
            spread = float(np.std(values, ddof=1)) if values.size > 1 else math.nan
            row |= {
                name: float(np.mean(values)),
                f"{name}_spread": spread,
                f"{name}_uncertainty": math.hypot(
                    spread / math.sqrt(values.size), common * name.endswith("_duration")
                ),
            }
    stiffness, uncertainty = measurement.stiffness_from_slope
    K, V, M, W0 = measurement.machine.numbers
    row |= {
        "force_before": float(np.mean(events.force_before)) if len(events) else math.nan,
        "loading_slope": measurement.loading_slope,
        "loading_slope_uncertainty": measurement.loading_slope_uncertainty,
        "stiffness_from_slope": stiffness,
        "stiffness_from_slope_uncertainty": uncertainty,
        "smallest_drop": measurement.smallest_drop,
    }
    frequency, error = linear_frequency(events, K * V / W0)
    row |= {"linear_frequency": frequency, "linear_frequency_uncertainty": error}
    machine = {"K": K, "V": V, "M": M, "W0": W0}
    return row | {name: number for name, number in machine.items() if np.isfinite(number)}


def stick_slip_row(path: Path, measurement: StickSlipMeasurement) -> dict[str, Any]:
    """The row of a recording in the table of a campaign.

    One that ends in steady sliding is a level too: a reading of the mean friction at epsilon = 0.
    """
    last = measurement.regimes[-1]
    level: dict[str, Any] = {}
    if last.kind == "steady sliding":
        part = slice(*np.searchsorted(measurement.time, (last.start, last.end)))
        mean = mean_level(measurement.time[part], measurement.friction[part])
        level = {"mean_friction": mean.value, "mean_friction_uncertainty": mean.uncertainty}
        level["epsilon"] = 0.0
    kind, time = "level" if level else "stick-slip", measurement.time
    return {
        **first_columns(path, 1, kind, time[0], time[-1], measurement),
        "regime": measurement.kind,
        **level,
        **means(measurement),
        "checks": doubts_text(measurement.checks),
    }


def stick_slip_record(measurement: StickSlipMeasurement) -> dict[str, Any]:
    """All results of a stick-slip recording as numbers, texts, lists and dicts in SI."""
    return {
        "mode": measurement.mode,
        "verdict": measurement.verdict,
        "regime": measurement.kind,
        "regimes": [asdict(regime) for regime in measurement.regimes],
        **means(measurement),
        "noise": measurement.noise,
        "impulses": int(measurement.impulses.size),
        "samples": int(measurement.time.size),
        "catalogue": events_record(measurement),
        "checks": [asdict(check) for check in measurement.checks],
        "channels": list(measurement.names),
        "units": {name: unit for name, (unit, _) in COLUMNS.items()},
        "conventions": CONVENTIONS,
    }


def summary_rows(measurement: StickSlipMeasurement) -> list[tuple[str, str, str, str]]:
    """Name, mean, spread and meaning of the columns of the events, as texts."""
    rows = []
    for name, meaning in (
        ("drop", "of F/W"),
        ("recurrence", "from onset to onset"),
        ("stick_duration", ""),
        ("slip_duration", ""),
        ("creep", "of F/W, before the onset"),
        ("slip", "of the slider"),
        ("slip_velocity", "largest in a slip"),
        ("energy", "released by the spring"),
    ):
        values = column(measurement, name)
        values = values[np.isfinite(values)]
        if not values.size:
            continue
        unit = COLUMNS[name][0]
        mean = float(np.mean(values))
        spread = percent(float(np.std(values)) / abs(mean)) if mean else "-"
        low, high = np.min(values), np.max(values)
        span = f"spread {spread}, {low:.3g} to {high:.3g}"
        rows.append((name, f"{mean:.4g}{'' if unit == '1' else ' ' + unit}", span, meaning))
    return rows
