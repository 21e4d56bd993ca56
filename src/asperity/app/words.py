"""Labels of the page for the arguments that sentences of the library name."""

from __future__ import annotations

from collections.abc import Mapping

from asperity.errors import Argument

_LABELS: Mapping[str, str] = {
    "measure.window": "Window",
    "measure.detrend": "Drift",
    "measure.load": "Normal load",
    "measure.force": "Shear force",
    "measure.steps": "Velocity steps",
    "measure.holds": "Holds",
    "measure.frequency": "Frequency",
    "measure.trace": "The recording",
    "lock_in.detrend": "Drift",
    "lock_in.harmonics": "Harmonics",
    "lock_in.frequency": "Frequency",
    "lock_in.load and force": "Normal load and shear force",
    "lock_in.load": "Normal load",
    "lock_in.time": "Time column",
    "measure.exact_frequency": "Take it as exact",
    "measure.harmonics": "Harmonics",
    "measure.steps and holds": "Velocity steps and holds",
    "rate": "Sampling rate",
    "format": "File format",
    "delimiter": "Delimiter",
    "decimal": "Decimal mark",
    "read.rate": "Sampling rate",
    "read.group": "Group",
    "read.format": "File format",
    "read.delimiter": "Delimiter",
    "read.decimal": "Decimal mark",
    "columns": "Role",
    "units": "Unit",
    "stress_to_force.area": "Area",
    "read.area": "Area",
    "recording.path": "The recording",
    "slice.start and slice.end": "Window",
    "free": "Free parameters",
    "fixed": "Fixed numbers",
    "laws": "Laws",
    "gauge": "Low-pass of the force gauge",
    "fit_rate": "Mean values per second for long recordings",
    "velocities": "Velocities between the steps",
}
_ROLES: Mapping[str, str] = {
    "time": "Time column",
    "W": "Normal load",
    "F": "Shear force",
    "velocity": "Velocity",
    "displacement": "Displacement",
    "friction": "Friction",
}


def in_labels(argument: Argument) -> str:
    """The words of the page: ``Normal load``, ``Unit of Fn: N``."""
    name, key, value = argument
    # A part of a list has the label of the list.
    while name.rpartition(".")[2].isdigit():
        name = name.rpartition(".")[0]
    head, _, field = name.partition(".")
    if head in ("data", "runs") and field:
        name = field.partition(".")[2] or field
    if name in ("numbers", "fixed", "start") and key:
        label = key
    elif name in ("columns", "Trace.channel") and key:
        label = _ROLES.get(key, f"Role {key}")
    elif name == "units" and key:
        label = f"Unit of {key}"
    elif name == "channels" and key:
        label = f"Channel {key}"
    elif name == "modulated":
        return "Velocity steps and holds"
    else:
        label = _LABELS.get(name, name)
    return f"{label}: {value}" if value and value != "..." else label
