"""Names of the command line for arguments in messages of the library: their options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from asperity.errors import Argument, InputError, naming, symbol

#: Fields of an operating point, and fields whose options take NAME=VALUE.
POINT_OPTIONS: Mapping[str, str] = {"law": "--law", "material": "--material"}
_PAIRS = ("fixed", "numbers", "start", "prior")
#: Arguments that are options under their own name.
_SAME = ("workers", "cluster", "thresholds", "out", "show", "x", "y", "at")
_OPTIONS: Mapping[str, str] = {
    "measure.trace": "the recording",
    "measure.steps and holds": "--steps and --holds",
    "measure.events": "--events",
    "modulated": "--no-modulation",
    "lock_in.harmonics": "--harmonics",
    "lock_in.frequency": "--frequency",
    "lock_in.load and force": "the load and the force",
    "lock_in.load": "the load",
    "lock_in.time": "the time column",
    "stress_to_force.area": "--area",
    "recording": "the recording",
    "write.path": "--out",
    "slice.start and slice.end": "--window",
    "seed": "--seed",
    "span": "--stiffness-from",
    **{name: f"--{name}" for name in (*_SAME, "chains", "draws", "table")},
}


def in_options(argument: Argument, options: Mapping[str, str] | None = None) -> str:
    """An argument as the command line writes it: ``--load``, ``--column "velocity=speed"``.

    Parameters
    ----------
    argument : Argument
    options : mapping of str to str, optional
        Options of the current command by field, if they differ from those of other commands.
    """
    from asperity.questions.options import (
        COLUMN_OPTIONS,
        MEASURE_OPTIONS,
        SOURCE_OPTIONS,
        number_option,
        quoted,
    )

    options = options or {}
    # An item of a list has the option of the list.
    name, key, value = argument.whole, argument.key, argument.value
    if name in ("columns", "Trace.channel") and key:
        if key in COLUMN_OPTIONS:
            return f"{COLUMN_OPTIONS[key]} {quoted(value)}".rstrip()
        return f'--column "{key}={value}"' if value else f"--column {key}=NAME"
    if name == "numbers":
        has_options = f"numbers.{key}" not in options
        return number_option(
            key, value, options.get(name, "--set"), has_options=has_options
        ).rstrip()
    if name == "channels" and value:
        return f'--channel "{key} = {value}"'
    if name == "units" and key and value:
        return f'--unit "{key}={"UNIT" if value == "..." else value}"'
    known = {**_OPTIONS, **SOURCE_OPTIONS, **options}
    known |= {f"read.{n}": option for n, option in SOURCE_OPTIONS.items()}
    known |= {f"measure.{n}": option for n, option in MEASURE_OPTIONS.items()}
    option = known.get(name)
    if option and option.startswith("--set "):
        return number_option(option.removeprefix("--set "), has_options=False)
    if option is None:
        whole, _, part = name.partition(".")
        option = name
        if whole in _PAIRS and whole in options:
            option, name, key = known[whole], whole, part
    key = symbol(key) if name in _PAIRS else key
    if name in _PAIRS and key and value:
        return f"{option} {quoted(f'{key}={value}', also='=')}"
    # A switch has no value.
    value = "" if value in ("True", "False") else value
    return " ".join([option, *([key] if key else []), *([quoted(value)] if value else [])])


@contextmanager
def fields_as_options(options: Mapping[str, str]) -> Iterator[None]:
    """Let messages name the fields of a question by the options of the current command.

    Parameters
    ----------
    options : mapping of str to str
        Option of each field.
    """

    def words(argument: Argument) -> str:
        head, _, field = argument.name.partition(".")
        # All files of data have the same options.
        if head == "data" and field:
            argument = argument._replace(name=field.partition(".")[2] or field)
        return in_options(argument, options)

    with naming(words):
        try:
            yield
        except InputError as error:
            raise error.worded() from None
