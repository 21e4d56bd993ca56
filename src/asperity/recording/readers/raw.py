"""What a file holds, before units and roles are looked at: the common ground of all formats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.errors import InputError, closest
from asperity.recording.finding import Finding, with_cause

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

#: Attributes that formats and laboratories use, lower case without blanks and underscores.
_RATES = frozenset({"samplerate", "samplingrate", "samplefrequency", "samplingfrequency", "fs"})
_INTERVALS = frozenset({"dt", "sampleinterval", "samplinginterval", "timestep", "wfincrement"})
_UNITS = ("units", "unit", "Units", "Unit", "UNITS", "UNIT", "unit_string", "NI_UnitDescription")


@dataclass(frozen=True, eq=False)
class RawColumn:
    """A column as recorded.

    Attributes
    ----------
    label : str
        The whole heading, unit included; empty where the file has none.
    values : ndarray, shape (n,)
        Numbers, or date and time texts, as recorded.
    unit : str or None
        Where the format keeps the unit beside the name; None where the label may hold it.
    """

    label: str
    values: NDArray[Any]
    unit: str | None = None


@dataclass(frozen=True, eq=False)
class RawRecording:
    """Columns of one length, with what the format says about its clock.

    Attributes
    ----------
    columns : list of RawColumn
        In the order of the file.
    findings : list of Finding
        What is wrong with the file itself.
    provenance : dict
        Format, title and layout.
    start, step : float or None
        Clock of a file that keeps an interval instead of a column of times, in seconds.
    """

    columns: list[RawColumn]
    findings: list[Finding] = field(default_factory=list)
    provenance: dict[str, Any] = field(default_factory=dict)
    start: float = 0.0
    step: float | None = None


def truncated(path: Path, number: float, where: str, sentence: str, sure: bool = True) -> Finding:
    """The finding of a file that ends, or may end, too early, what is whole being read."""
    said = f"{path.name} {'is' if sure else 'may be'} cut short: {sentence}"
    return Finding("truncated", "error" if sure else "warning", number, where, said)


def refuse_truncated(path: Path, why: str) -> InputError:
    """The error for a file of which nothing can be used."""
    return InputError(
        f"recording.path must be a whole file, got '{path.name}', {why}; copy it again from where "
        "it was recorded"
    )


def interval_of(attributes: Mapping[str, Any]) -> float | None:
    """Seconds between samples by attributes such as ``sample_rate`` or ``dt``; None without."""
    for name, value in attributes.items():
        plain = name.rpartition("/")[2].lower().replace(" ", "").replace("_", "")
        if plain not in _RATES and plain not in _INTERVALS:
            continue
        try:
            number = float(np.squeeze(value))
        except (TypeError, ValueError):
            continue
        if number > 0 and np.isfinite(number):
            return 1 / number if plain in _RATES else number
    return None


def unit_of(attributes: Mapping[str, Any]) -> str | None:
    """Unit that a format keeps in an attribute of the column; None without."""
    for name in _UNITS:
        value = attributes.get(name)
        if isinstance(value, bytes):
            return value.decode("utf-8", errors="replace")
        if isinstance(value, str):
            return str(value)
    return None


def one_table(
    groups: Mapping[str, list[RawColumn]],
    path: Path,
    chosen: str | None,
    noticed: Sequence[Finding] = (),
) -> tuple[list[RawColumn], list[Finding]]:
    """The columns of one length that make the recording, and what was left out of it.

    Parameters
    ----------
    groups : mapping of str to list of RawColumn
        Columns by the group that they lie in.
    path : Path
        The file, for messages.
    chosen : str or None
        The group to read; without it all, if their longest columns are of one length.
    noticed : sequence of Finding
        What is wrong with the file: a cut is why columns are missing.

    Raises
    ------
    InputError
        If there is nothing to read, or more than one recording.
    """
    filled = {name: columns for name, columns in groups.items() if columns}
    if not filled and any(f.name in ("truncated", "damaged") for f in noticed):
        raise with_cause(refuse_truncated(path, "of which no column is left"), noticed)
    if chosen is not None:
        wanted = chosen.strip("/")
        if wanted not in filled:
            refused = InputError(
                f"read.group must be a group with columns, got '{chosen}'; "
                + (closest(wanted, filled) if filled else f"'{path.name}' has none")
            )
            raise with_cause(refused, noticed)
        filled = {wanted: filled[wanted]}
    if not filled:
        raise InputError(
            f"recording.path must hold columns of numbers, got '{path.name}' with none; give a "
            "recording"
        )
    longest = {name: max(c.values.size for c in columns) for name, columns in filled.items()}
    if len(set(longest.values())) > 1:
        listed = ", ".join(f"{name!r} ({rows} rows)" for name, rows in longest.items())
        raise InputError(
            f"read.group must be chosen in a file of several recordings, got none for {listed}; "
            f"choose one, like group='{max(longest, key=longest.__getitem__)}'"
        )
    rows = max(longest.values())
    kept = [c for columns in filled.values() for c in columns if c.values.size == rows]
    short = [c for columns in filled.values() for c in columns if c.values.size != rows]
    return kept, [_left_out(c, rows) for c in short]


def _left_out(column: RawColumn, rows: int) -> Finding:
    return Finding(
        "other length",
        "warning",
        column.values.size,
        column.label,
        f"'{column.label}' has {column.values.size} values where the recording has {rows} rows, "
        "and was left out.",
    )
