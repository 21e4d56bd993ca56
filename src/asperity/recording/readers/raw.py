"""Raw columns of a file, before units and roles are determined: common to all formats.

HDF5, MATLAB and TDMS files hold named arrays in groups; which of them are the columns of one
recording is decided here.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError, closest, known_as, require
from asperity.parameters.arguments import typed
from asperity.recording.finding import Finding, with_cause

#: Names as `plain` has them: of a sampling rate (Hz), of an interval (s), of the lists that name
#: the columns of a matrix, and of units.
_RATES = frozenset({"samplerate", "samplingrate", "samplefrequency", "samplingfrequency", "fs"})
_INTERVALS = frozenset({"dt", "sampleinterval", "samplinginterval", "timestep", "wfincrement"})
_NAMES = frozenset({"columns", "columnnames", "names", "channels", "channelnames", "labels"})
_NAMES |= {"headers", "header", "varnames", "variablenames"}
_UNITS = frozenset({"units", "unit", "columnunits", "channelunits", "unitnames"})
#: Largest number of columns of a matrix.
_MOST_COLUMNS = 256
#: Bytes that show the format of a file.
_HEAD = 4096
#: Clocks that differ by less than this share of their interval are one clock.
_ONE_CLOCK = 0.01


@typed
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
        Where the format keeps the unit next to the name; None where the label may hold it.

    Raises
    ------
    TypeError
        If label or unit is no text.
    InputError
        If the values are no array of one dimension.
    """

    label: str
    values: NDArray[Any]
    unit: str | None = None

    def __post_init__(self) -> None:
        rule, got = "be an array of one dimension", f"{self.values.ndim} in '{self.label}'"
        require(self.values.ndim == 1, "RawColumn.values", rule, got, "correct the reader")


@typed
@dataclass(frozen=True, eq=False)
class RawRecording:
    """Columns of one length, with what the format says about its clock.

    Attributes
    ----------
    columns : sequence of RawColumn
        In the order of the file.
    findings : sequence of Finding
        Findings on the file itself.
    provenance : dict
        Format, title and layout.
    start, step : float or None
        Clock of a file that keeps an interval instead of a column of times, in seconds.

    Raises
    ------
    TypeError
        If columns or findings are other things.
    InputError
        If columns differ in length, or start and step are no times.
    """

    columns: Sequence[RawColumn]
    findings: Sequence[Finding] = ()
    provenance: dict[str, Any] = field(default_factory=dict)
    start: float = 0.0
    step: float | None = None

    def __post_init__(self) -> None:
        sizes = sorted({column.values.size for column in self.columns})
        rule, got = "be of one length", f"{sizes} rows"
        require(len(sizes) == 1, "RawRecording.columns", rule, got, "correct the reader")
        if not (np.isfinite(self.start) and (self.step is None or 0 < self.step < np.inf)):
            rule, got = "be positive and start finite, in seconds", f"{self.step} and {self.start}"
            raise InputError("RawRecording.step", rule, got, "correct the reader")


def beginning(path: Path) -> bytes:
    """The first bytes of a file, by which its format is recognised."""
    with path.open("rb") as file:
        return file.read(_HEAD)


def truncated(number: float, where: str, sentence: str, sure: bool = True) -> Finding:
    """The finding of a file that is or may be cut; the complete rows are read."""
    whole = f"the file {'is' if sure else 'may be'} cut short: {sentence}"
    return Finding("truncated", "error" if sure else "warning", number, where, whole)


def unusable(
    path: Path,
    why: str,
    rule: str = "be a whole file",
    advice: str = "copy it again from where it was recorded",
) -> InputError:
    """The error for a file of which nothing can be used."""
    return InputError("recording", rule, f"'{known_as(path).name}', {why}", advice)


def plain(name: str) -> str:
    """A name in lower case without separators, to be looked up."""
    return name.lower().replace("_", "").replace(" ", "")


def interval_of(attributes: Mapping[str, Any]) -> float | None:
    """Seconds between samples by attributes such as ``sample_rate`` or ``dt``; None without."""
    for name, value in attributes.items():
        key = plain(name.rpartition("/")[2])
        if key not in _RATES and key not in _INTERVALS:
            continue
        try:
            number = float(np.squeeze(value))
        except (TypeError, ValueError):
            continue
        interval = 1 / number if number and key in _RATES else number
        if 0 < interval < np.inf:
            return interval
    return None


def as_texts(value: Any) -> list[str] | None:
    """A value as a list of texts: one text, or an array of texts; None for anything else."""
    if isinstance(value, bytes):
        return [value.decode("utf-8", errors="replace")]
    if isinstance(value, str):
        parts = [p.strip() for p in value.split(",")]
        return parts if len(parts) > 1 else [value]
    if not isinstance(value, np.ndarray | Sequence) or np.asarray(value).dtype.kind not in "OSU":
        return None
    texts = [
        v.decode("utf-8", errors="replace") if isinstance(v, bytes) else v
        for v in np.asarray(value).reshape(-1).tolist()
    ]
    return texts if texts and all(isinstance(v, str) for v in texts) else None


class Stated(NamedTuple):
    """A clock that a file states instead of a column of times.

    Attributes
    ----------
    start, step : float
        First time and interval (s).
    rows : int or None
        Length of the columns with this clock; None for columns of any length.
    """

    start: float
    step: float
    rows: int | None = None


class Group(NamedTuple):
    """Columns of a group of a file, and the clocks that the group and its columns state."""

    columns: list[RawColumn]
    clocks: list[Stated]


def group_of(
    arrays: Mapping[str, Any],
    attributes: Mapping[str, Mapping[str, Any]] | None = None,
    of_group: Mapping[str, Any] | None = None,
) -> Group:
    """Columns and clocks of the arrays of one group.

    Units may stand in an array's attributes, in a text of the group called like it with ``_unit``
    or ``_units`` behind, or in a group ``units`` with a text of its name. Sampling intervals may
    stand in attributes of arrays or of the group, or in numbers of the group.
    """
    texts = {key: v for key, v in arrays.items() if as_texts(v) is not None}
    units = next(
        (v for k, v in arrays.items() if plain(k) in _UNITS and isinstance(v, Mapping)), {}
    )
    columns: list[RawColumn] = []
    numbers = {k: v for k, v in arrays.items() if np.size(v) == 1}
    steps: list[tuple[float | None, int | None]] = [
        (interval_of(numbers), None),
        (interval_of(of_group or {}), None),
    ]
    for name, values in arrays.items():
        if isinstance(values, Mapping) or name in texts:
            continue
        stated = (attributes or {}).get(name, {})
        about = {**texts, **stated}
        for key in (f"{name}_unit", f"{name}_units"):
            if key in texts:
                about = {"units": texts[key], **about}
        if name in units:
            about = {"units": units[name], **about}
        made = _columns_of(name, values, about)
        columns += made
        steps.append((interval_of(stated), made[0].values.size if made else None))
    return Group(columns, [Stated(0.0, step, rows) for step, rows in steps if step is not None])


def _columns_of(name: str, values: Any, about: Mapping[str, Any]) -> list[RawColumn]:
    """Columns of one array: itself if it is a vector, the fields of a table, or those of a matrix.

    Parameters
    ----------
    name : str
    values : array
        Array of one or two dimensions; no other array is a recording.
    about : mapping
        Texts by name: lists of names and of units count for a matrix.
    """
    array = np.asarray(values)
    if array.dtype.names:
        flat, names = array.reshape(-1), list(array.dtype.names)
        units = _texts_in(about, _UNITS, len(names))
        return [
            RawColumn(field, np.ascontiguousarray(flat[field]), unit)
            for field, unit in zip(names, units or [""] * len(names), strict=True)
            if flat[field].dtype.kind in "iuf" and flat[field].ndim == 1
        ]
    # What holds complex numbers is left out with a finding; a switch is 0 and 1.
    if array.dtype.kind not in "iufbc":
        return []
    array = np.squeeze(array)
    if array.ndim == 1 and array.size > 1:
        unit = _texts_in(about, _UNITS, 1)
        return [RawColumn(name, array, unit[0] if unit else None)]
    if array.ndim != 2 or min(array.shape) > _MOST_COLUMNS:
        return []
    # Rows are samples, of which a recording has more than channels.
    matrix = array if array.shape[0] >= array.shape[1] else array.T
    width = matrix.shape[1]
    names = _texts_in(about, _NAMES, width) or [f"{name}[{i}]" for i in range(width)]
    units = _texts_in(about, _UNITS, width)
    return [
        RawColumn(names[i], np.ascontiguousarray(matrix[:, i]), units[i] if units else None)
        for i in range(width)
    ]


def _texts_in(about: Mapping[str, Any], wanted: frozenset[str], number: int) -> list[str] | None:
    """The list of `number` texts in `about` under one of the wanted names; None without it."""
    for name, value in about.items():
        if plain(name) in wanted:
            texts = as_texts(value)
            if texts is not None and len(texts) == number:
                return texts
    return None


def one_recording(
    groups: Mapping[str, Group],
    path: Path,
    chosen: str | None,
    provenance: Mapping[str, Any],
    noticed: Sequence[Finding] = (),
) -> RawRecording:
    """The columns of one length in a file, with their clock and findings about other columns.

    Parameters
    ----------
    groups : mapping of str to Group
        By their paths.
    path : Path
        The file, for messages.
    chosen : str or None
        The group to read; without it all, if their longest columns are of one length.
    provenance : mapping
        Format and title.
    noticed : sequence of Finding
        Findings on the file: if it was cut off, columns are missing.

    Raises
    ------
    InputError
        If there is nothing to read, or more than one recording.
    """
    filled = {name: group.columns for name, group in groups.items() if group.columns}
    if chosen is not None:
        wanted = chosen.strip("/")
        if wanted not in filled:
            advice = closest(wanted, filter(None, filled)) if any(filled) else "leave it out"
            refused = InputError("read.group", "be a group with columns", f"'{chosen}'", advice)
            raise with_cause(refused, noticed)
        filled = {wanted: filled[wanted]}
    if not filled:
        raise unusable(path, "which has none", "hold columns of numbers", "give a recording")
    longest = {name: max(c.values.size for c in columns) for name, columns in filled.items()}
    if len(set(longest.values())) > 1:
        listed = ", ".join(f"{name!r} ({rows} rows)" for name, rows in longest.items())
        advice = f"choose one, like group='{max(longest, key=longest.__getitem__)}'"
        rule = "be chosen in a file of several recordings"
        raise InputError("read.group", rule, f"none for {listed}", advice)
    rows = max(longest.values())
    kept = [c for columns in filled.values() for c in columns if c.values.size == rows]
    findings = [
        _left_out(c, rows) for columns in filled.values() for c in columns if c.values.size != rows
    ]
    clocks = _clocks(groups, filled, rows)
    if len(clocks) > 1:
        listed = " and ".join(f"{clock.step:g} s from {clock.start:g} s on" for clock in clocks)
        text = f"Its columns have intervals of {listed}, none of which was used."
        findings.append(Finding("several clocks", "note", len(clocks), "the file", text))
    start, step, _ = clocks[0] if len(clocks) == 1 else (0.0, None, None)
    about = {**provenance, "group": chosen or ""}
    return RawRecording(kept, [*noticed, *findings], about, start, step)


def _clocks(groups: Mapping[str, Group], used: Collection[str], rows: int) -> list[Stated]:
    """Different clocks of columns of `rows` rows in the groups `used`.

    Where these state none, those of the groups around them count, or of groups without columns.
    """
    around = [n for n in groups if not n or any(u.startswith(f"{n}/") for u in used)]
    empty = [n for n, group in groups.items() if not group.columns]
    for names in (used, around, empty):
        clocks: list[Stated] = []
        for clock in (c for n in names for c in groups[n].clocks if c.rows in (None, rows)):
            limit = _ONE_CLOCK * clock.step
            if not any(np.allclose(clock[:2], c[:2], rtol=0, atol=limit) for c in clocks):
                clocks.append(clock)
        if clocks:
            return clocks
    return []


def _left_out(column: RawColumn, rows: int) -> Finding:
    count = column.values.size
    text = f"'{column.label}' has {count} values where the recording has {rows} rows"
    return Finding("other length", "warning", count, column.label, f"{text}, and was left out.")
