"""Options of the command line for the arguments that sentences of the library name."""

from __future__ import annotations

from collections.abc import Mapping

from asperity.errors import Argument

#: Options that choose the column of a role; other roles have --column.
COLUMN_OPTIONS: Mapping[str, str] = {"W": "--load", "F": "--force", "time": "--time"}

_OPTIONS: Mapping[str, str] = {
    "measure.window": "--window",
    "measure.detrend": "--detrend",
    "measure.load": "--load",
    "measure.force": "--force",
    "measure.steps": "--steps",
    "measure.holds": "--holds",
    "measure.frequency": "--frequency",
    "measure.trace": "the recording",
    "lock_in.detrend": "--detrend",
    "lock_in.harmonics": "--harmonics",
    "lock_in.frequency": "--frequency",
    "lock_in.load and force": "the load and the force",
    "lock_in.load": "the load",
    "lock_in.time": "the time column",
    "rate": "--rate",
    "read.rate": "--rate",
    "read.group": "--group",
    "read.format": "--format",
    "read.delimiter": "--delimiter",
    "read.decimal": "--decimal",
    "columns": "--column",
    "units": "--unit",
    "stress_to_force.area": "--area",
    "recording.path": "the recording",
    "slice.start and slice.end": "--window",
}


def in_options(argument: Argument) -> str:
    """The words of the command line: ``--load``, ``--column "velocity=speed"``."""
    name, key, value = argument
    if name in ("columns", "Trace.channel") and key:
        if key in COLUMN_OPTIONS:
            return f"{COLUMN_OPTIONS[key]} {_quoted(value)}".rstrip()
        return f'--column "{key}={value}"' if value else f"--column {key}=NAME"
    if name == "units" and key and value:
        return f'--unit "{key}={"UNIT" if value == "..." else value}"'
    option = _OPTIONS.get(name, name)
    return f"{option} {_quoted(value)}".rstrip()


def _quoted(value: str) -> str:
    return value if all(c.isalnum() or c in "_." for c in value) else f'"{value}"'
