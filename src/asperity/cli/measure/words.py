"""Errors of the library in the words of the command line: the option in place of the argument."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from asperity.errors import InputError

#: Options that choose the column of a role; other roles have --column.
_OPTION_OF_ROLE = {"W": "--load", "F": "--force", "time": "--time"}
#: Beginnings of the library's sentences, and the words of the command line for them.
_SUBJECTS = {
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
    "read.rate": "--rate",
    "read.group": "--group",
    "read.format": "--format",
    "read.delimiter": "--delimiter",
    "read.decimal": "--decimal",
    "read.columns": "--column",
    "read.units": "--unit",
    "stress_to_force.area": "--area",
    "recording.path": "the recording",
    "slice.start and slice.end": "--window",
}


@contextmanager
def naming_options() -> Iterator[None]:
    """Raise an `InputError` of the library anew, with options named instead of arguments."""
    try:
        yield
    except InputError as error:
        raise InputError(in_options(str(error))) from None


def in_options(sentence: str) -> str:
    """A sentence of the library with options in place of arguments.

    Parameters
    ----------
    sentence : str

    Returns
    -------
    str
    """
    for name, option in _SUBJECTS.items():
        if sentence.startswith(f"{name} "):
            sentence = option + sentence[len(name) :]
            break
    sentence = re.sub(
        r"^Trace\.channel must name (a|one) channel, got '([\w ]+)'", _missing, sentence
    )
    sentence = re.sub(
        r"^columns\['(\w+)'\]", lambda found: _OPTION_OF_ROLE.get(found[1], "--column"), sentence
    )
    sentence = re.sub(r"^units\['[^']*'\]", "--unit", sentence)
    sentence = re.sub(r"^Trace\.channel\b", "--column", sentence)
    # Messages about unread columns name arguments of the library too.
    sentence = re.sub(r"columns=\{'(\w+)': (?:'([^']*)'|(\d+))\}", _column, sentence)
    sentence = re.sub(r"units=\{'([^']*)': '([^']*)'\}", r"""--unit "\1=\2\"""", sentence)
    return re.sub(r"units=\{'([^']*)': \.\.\.\}", r"""--unit "\1=UNIT\"""", sentence)


def _missing(found: re.Match[str]) -> str:
    how_many, name = found[1], found[2]
    if name in _OPTION_OF_ROLE:
        got = "none" if how_many == "a" else "several"
        return f"{_OPTION_OF_ROLE[name]} must name {how_many} column, got {got}"
    return f"--column must name {how_many} column, got '{name}'"


def _column(found: re.Match[str]) -> str:
    role, name = found[1], found[2] if found[2] is not None else found[3]
    shown = f'"{name}"' if re.search(r"[^\w.]", name) else name
    if role in _OPTION_OF_ROLE:
        return f"{_OPTION_OF_ROLE[role]} {shown}"
    return f'--column "{role}={name}"'
