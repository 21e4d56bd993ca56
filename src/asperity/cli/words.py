"""Options of the command line for the arguments that sentences of the library name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from asperity.errors import Argument, InputError, naming

#: Options that choose the column of a role; other roles have --column.
COLUMN_OPTIONS: Mapping[str, str] = {"W": "--load", "F": "--force", "time": "--time"}

_OPTIONS: Mapping[str, str] = {
    "measure.window": "--window",
    "measure.detrend": "--detrend",
    "measure.load": "--load",
    "measure.force": "--force",
    "measure.steps": "--steps",
    "measure.holds": "--holds",
    "measure.steps and holds": "--steps and --holds",
    "measure.frequency": "--frequency",
    "measure.exact_frequency": "--exact-frequency",
    "measure.harmonics": "--harmonics",
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

#: Options of the fields of a fit and of a comparison.
FIT_OPTIONS: Mapping[str, str] = {
    **{
        name: f"--{name.replace('_', '-')}"
        for name in (
            *("law", "laws", "free", "start", "prior", "material", "window", "windows", "steps"),
            *("velocities", "stiffness_from", "trend", "drift", "initial", "gauge"),
            *("gauge_order", "fit_rate", "profile", "inertia", "radiation_damping"),
        )
    },
    "fixed": "--fix",
}


def in_options(argument: Argument, own: Mapping[str, str] = _OPTIONS) -> str:
    """The words of the command line: ``--load``, ``--column "velocity=speed"``."""
    name, key, value = argument
    # A part of a list has the option of the list.
    while name.rpartition(".")[2].isdigit():
        name = name.rpartition(".")[0]
    if name in ("columns", "Trace.channel") and key:
        if key in COLUMN_OPTIONS:
            return f"{COLUMN_OPTIONS[key]} {_quoted(value)}".rstrip()
        return f'--column "{key}={value}"' if value else f"--column {key}=NAME"
    if name == "modulated":
        return "--no-modulation"
    if name == "units" and key and value:
        return f'--unit "{key}={"UNIT" if value == "..." else value}"'
    option = own.get(name) or _OPTIONS.get(name, name)
    return " ".join([option, *([key] if key else []), *([_quoted(value)] if value else [])])


def _quoted(value: str) -> str:
    return value if all(c.isalnum() or c in "_." for c in value) else f'"{value}"'


@contextmanager
def fields_as_options(own: Mapping[str, str]) -> Iterator[None]:
    """Name fields of a question, which other commands mean otherwise, by this command's options.

    Parameters
    ----------
    own : mapping of str to str
        Option of each field.
    """

    def words(argument: Argument) -> str:
        name = argument.name
        # What files are given is a list, of which every part has the same options.
        if name.startswith("data.") and name.count(".") >= 2:
            name = name.split(".", 2)[2]
        name, dot, part = name.partition(".")
        if dot and name in own and not argument.key:
            key = "" if part.isdigit() else part
            return in_options(Argument(name, key, argument.value), own)
        return in_options(argument._replace(name=name + dot + part), own)

    chosen: Callable[[Argument], str] = words
    with naming(chosen):
        try:
            yield
        except InputError as error:
            raise InputError(str(error)) from None
