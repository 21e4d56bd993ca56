"""Names of the page for arguments in messages of the library: their labels."""

from __future__ import annotations

from collections.abc import Mapping

from asperity.errors import Argument, symbol

#: Label of each field on the page.
LABELS: Mapping[str, str] = {
    "window": "Window",
    "slice.start and slice.end": "Window",
    "detrend": "Drift",
    "load": "Normal load",
    "force": "Shear force",
    "load and force": "Normal load and shear force",
    "time": "Time column",
    "steps": "Velocity steps",
    "holds": "Holds",
    "steps and holds": "Velocity steps and holds",
    "frequency": "Frequency",
    "exact_frequency": "Take it as exact",
    "harmonics": "Harmonics",
    "trace": "The recording",
    "recording": "The recording",
    "rate": "Sampling rate",
    "group": "Group",
    "format": "File format",
    "delimiter": "Delimiter",
    "decimal": "Decimal mark",
    "columns": "Role",
    "units": "Unit",
    "area": "Area",
    "free": "Free parameters",
    "fixed": "Fixed numbers",
    "laws": "Laws",
    "prior": "Published uncertainties as priors",
    "gauge": "Low-pass of the force gauge",
    "drift": "Friction also drifts over time",
    "profile": "Intervals by profile likelihood",
    "inertia": "With the inertia of the slider",
    "fit_rate": "Mean values per second for long recordings",
    "velocities": "Velocities between steps",
    "whole_periods": "Whole periods only",
    "stick_slip": "What it is: stick-slip",
    "measure.stiffness": "Spring stiffness K",
    "measure.velocity": "Pulling velocity V",
    "measure.mass": "Mass M",
    "measure.normal_load": "Normal load W0",
    "trend": "Trend of the friction over slip",
    "initial": "State at the beginning",
    "posterior": "Posterior of one law by sampling",
    "draws": "Draws of each chain",
    "chains": "Chains",
}
#: Functions of the library whose arguments are fields of the Data tab.
_OF_DATA = ("measure", "read", "lock_in", "stress_to_force")
#: Quantity of a channel by its role.
ROLES: Mapping[str, str] = {
    "time": "time",
    "W": "normal load",
    "F": "shear force",
    "velocity": "velocity",
    "displacement": "displacement",
    "friction": "friction",
}


def in_labels(argument: Argument) -> str:
    """An argument as the page labels it: ``Normal load``, ``Unit of Fn: N``."""
    # An item of a list has the label of the list.
    name, key, value = argument.whole, argument.key, argument.value
    head, _, field = name.partition(".")
    if head in ("data", "runs") and field:
        head, _, field = (field.partition(".")[2] or field).rpartition(".")
        name = field
    elif head in _OF_DATA:
        name = field
    elif head in ("fixed", "prior", "start") and field:
        name, key = head, field
    if name in ("numbers", "start") and key:
        label = symbol(key)
    elif name in ("fixed", "prior") and key:
        label = f"{LABELS[name]}, {symbol(key)}"
    elif name in ("columns", "Trace.channel") and key == "time":
        label = LABELS["time"]
    elif name in ("columns", "Trace.channel") and key:
        label = ROLES[key].capitalize() if key in ROLES else f"Role {key}"
    elif name == "units" and key:
        label = f"Unit of {key}"
    elif name == "channels" and key:
        label = f"Channel {key}"
    elif name == "modulated":
        return f"What it is{': velocity steps and holds' if value == 'False' else ''}"
    else:
        label = LABELS.get(argument.whole) or LABELS.get(name, name)
    return f"{label}: {value}" if value and value != "..." else label
