"""Questions as options of the command line: the option of each field, and questions as commands."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from typing import Any

from asperity.errors import symbol
from asperity.parameters import DRIVE, MACHINE
from asperity.questions.fit import Fit
from asperity.questions.record import Record
from asperity.questions.recording import OF_MODULATION, Measurement, Source

#: Options that choose the column of a role; other roles have --column.
COLUMN_OPTIONS: Mapping[str, str] = {"W": "--load", "F": "--force", "time": "--time"}


def _named(record: type[Record], *others: str, without: tuple[str, ...] = ()) -> dict[str, str]:
    """The option of each field of a record and of `others`, by the name of the field."""
    names = [name for name in (*record.model_fields, *others) if name not in without]
    return {name: f"--{name.replace('_', '-')}" for name in names}


SOURCE_OPTIONS: Mapping[str, str] = {
    **_named(Source, without=("title",)),
    "columns": "--column",
    "units": "--unit",
    "channels": "--channel",
}

MEASURE_OPTIONS: Mapping[str, str] = {
    **_named(Measurement, "conditions"),
    "modulated": "--no-modulation",
    "stiffness": "--set K",
    "velocity": "--set V",
    "mass": "--set M",
    "normal_load": "--set W0",
}

FIT_OPTIONS: Mapping[str, str] = {
    # Starts and their seed have no option.
    **_named(Fit, "laws", "window", "steps", "velocities", without=("data", "starts", "seed")),
    "fixed": "--fix",
    "numbers": "--fix",
}

#: Units of fields that are numbers in SI.
_UNITS = {
    "frequency": "Hz",
    "gauge": "Hz",
    "velocities": "m/s",
    "area": "m^2",
    "stiffness": "N/m",
    "velocity": "m/s",
    "mass": "kg",
    "normal_load": "N",
}
#: Fields that are one span; in a list of spans each item is one.
_SPANS = ("window", "stiffness_from")


def as_options(fields: Mapping[str, Any], options: Mapping[str, str]) -> list[str]:
    """Fields of a question as options, each quoted for a shell.

    Parameters
    ----------
    fields : mapping
        Values by field; one that is None or False is left out.
    options : mapping of str to str
        Option of each field; a field without an option is left out.
    """
    parts = []
    for name, value in fields.items():
        option = options.get(name)
        if option is None or value is None or value is False or value == ():
            continue
        if value is True:
            parts.append(option)
        elif isinstance(value, Mapping):
            texts = (_pair(key, one) for key, one in value.items())
            parts += [f"{option} {shlex.quote(text)}" for text in texts]
        else:
            # A number of the machine is a NAME=VALUE pair of an option, as in --set K=...
            option, _, key = option.partition(" ")
            text = _text(value, _UNITS.get(name, ""), span=name in _SPANS)
            parts.append(f"{option} {shlex.quote(f'{key}={text}' if key else text)}")
    return parts


def _pair(name: str, value: Any) -> str:
    if value is None:  # the material of a prior
        return name
    if isinstance(value, Mapping):
        mean, _, unit = str(value["mean"]).partition(" ")
        return f"{name}={mean}+-{str(value['std']).partition(' ')[0]} {unit}".rstrip()
    return f"{name}={value}"


def _text(value: Any, unit: str, *, span: bool) -> str:
    if isinstance(value, float):
        return f"{value!r} {unit}".rstrip() if unit else f"{value:.15g}"
    if not isinstance(value, list | tuple):
        return str(value)
    if span:
        return ":".join("" if math.isinf(end) else f"{end:.15g}" for end in value)
    return ",".join(_text(v, unit, span=isinstance(v, list | tuple)) for v in value)


def number_option(
    name: str, value: str = "", pairs: str = "--set", *, has_options: bool = True
) -> str:
    """The option of a number of a point: ``-V "1 um/s"``, ``--inertia``, ``--set "K=0.3 N/um"``.

    Parameters
    ----------
    name : str
    value : str
        With its unit; empty for the option alone.
    pairs : str
        Option that takes NAME=VALUE.
    has_options : bool
        Whether the command has the options of `Parameter.options`.
    """
    parameter = {**DRIVE, **MACHINE}.get(name)
    if has_options and parameter is not None and parameter.options:
        value = "" if parameter.rule == "switch" else value
        return f"{parameter.options[0]} {quoted(value) if value else ''}".rstrip()
    name = symbol(name)
    return f"{pairs} {quoted(f'{name}={value}', also='=') if value else name}"


def quoted(value: str, also: str = "") -> str:
    """A value as written in a shell: quoted unless it is a word or a plain number."""
    return value if all(c.isalnum() or c in "_." + also for c in value) else f'"{value}"'


def source_options(source: Source) -> list[str]:
    """The options with which a file is read."""
    parts = []
    for role, column in source.columns.items():
        option = COLUMN_OPTIONS.get(role)
        text = str(column) if option else f"{role}={column}"
        parts.append(f"{option or '--column'} {shlex.quote(text)}")
    channels = {f"{name} ": f" {expression}" for name, expression in source.channels.items()}
    fields = source.model_dump(exclude={"columns", "title", "channels"}, exclude_defaults=True)
    return parts + as_options({**fields, "channels": channels}, SOURCE_OPTIONS)


def measure_options(question: Measurement, *, modulated: bool) -> list[str]:
    """A measurement as options of the command line.

    Parameters
    ----------
    question : Measurement
    modulated : bool
        Whether the recording was read as modulated: options of the other kind are left out.
    """
    of_steps, of_modulation = {"steps", "velocities", "holds"}, set(OF_MODULATION) - {"detrend"}
    other = of_steps if modulated else of_modulation
    fields = question.model_dump(exclude={*other, "modulated"}, exclude_defaults=True)
    switch = [] if modulated else [MEASURE_OPTIONS["modulated"]]
    return switch + as_options(fields, MEASURE_OPTIONS)
