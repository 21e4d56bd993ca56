"""The LOOK binary of xlook, the data program of the Penn State rock mechanics laboratory.

The header is big-endian: title (20 bytes), number of records (int32), number of channels (int32),
sweep (int32), ``dtime`` (float32); then 16 (older) or 32 headers of 84 bytes, one a channel: name
(13 bytes), units (13), gain (float32), comment (50), number of elements (int32). Channels that are
not used are called ``no_val``. The columns follow one after the other.

Older files hold big-endian float32, like the header; newer files hold float64 in the byte order of
the machine that wrote them, mostly little-endian. The header does not state the format: the size
of the file decides between 4 and 8 bytes, and the numbers themselves decide the byte order.
"""

from __future__ import annotations

import string
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import Argument
from asperity.recording.finding import Finding
from asperity.recording.readers.raw import RawColumn, RawRecording, beginning, unusable
from asperity.recording.roles import candidates

_START = struct.Struct(">20siiif")
_CHANNEL = struct.Struct(">13s13sf50si")
#: Possible numbers of channel headers, the newer format first.
_SLOTS = (32, 16)
_PRINTABLE = frozenset(string.printable.encode()) - frozenset(b"\t\n\r\x0b\x0c")
_UNUSED = "no_val"

#: Number formats, the more common first.
_TYPES = (">f4", "<f8", ">f8", "<f4")
_SAMPLE = 20_000
#: Recorded values lie between these limits, in any unit.
_SMALLEST, _LARGEST = 1e-12, 1e12


@dataclass(frozen=True)
class _Channel:
    """A channel that is in use."""

    name: str
    units: str
    comment: str
    elements: int


@dataclass(frozen=True)
class _Header:
    """Header of a file, read with one number of slots."""

    title: str
    dtime: float
    channels: tuple[_Channel, ...]
    size: int

    @property
    def elements(self) -> int:
        """Count of numbers after the header."""
        return sum(channel.elements for channel in self.channels)


def is_format(path: Path) -> bool:
    """Whether the beginning of a file makes sense as a header."""
    return bool(_headers(beginning(path)))


def read(path: Path) -> RawRecording:
    """Columns of a LOOK file; it has no groups."""
    raw = np.fromfile(path, dtype=np.uint8)
    headers = _headers(raw[: 1 << 12].tobytes())
    if not headers:
        raise unusable(path, "whose LOOK header is not whole or not one")
    pairs = [
        (header, dtype)
        for header in headers
        for dtype in _TYPES
        if header.size + header.elements * np.dtype(dtype).itemsize == raw.size
    ]
    if not pairs:
        raise unusable(path, "which has another number of values than its LOOK header says")
    scores = [_plausibility(raw, *pair) for pair in pairs]
    header, dtype = pairs[int(np.argmax(scores))]
    ambiguous = sum(max(scores) - score <= 0.05 for score in scores) > 1
    # A damaged file may hold signalling NaN.
    with np.errstate(all="ignore"):
        data = raw[header.size :].view(dtype).astype(np.float64)
    columns, findings = _columns(header, data)
    if ambiguous:
        text = f"The numbers were read as {dtype}, but another format makes as much sense."
        findings.append(Finding("byte order", "warning", np.dtype(dtype).itemsize, "data", text))
    columns, counted = _in_seconds(columns, header.dtime)
    findings += counted
    provenance = {
        "format": "look",
        "title": header.title,
        "dtime": header.dtime,
        "data": dtype,
        "comments": {c.name: c.comment for c in header.channels if c.comment not in ("", "none")},
    }
    return RawRecording(columns, findings, provenance)


def _headers(head: bytes) -> list[_Header]:
    """Every reading of `head` that makes sense, with 32 slots and with 16."""
    read = (_header(head, slots) for slots in _SLOTS)
    return [header for header in read if header is not None]


def _header(head: bytes, slots: int) -> _Header | None:
    size = _START.size + slots * _CHANNEL.size
    if len(head) < size:
        return None
    title, records, channels, _, dtime = _START.unpack_from(head)
    if records < 1 or not 1 <= channels <= slots or _text(title) is None:
        return None
    behind = head[size:][: len(_UNUSED)]
    if behind and _UNUSED.encode().startswith(behind):
        # The header is cut: a file of 32 slots that ends within them.
        return None
    used = []
    for i in range(slots):
        fields = _CHANNEL.unpack_from(head, _START.size + i * _CHANNEL.size)
        name, units, comment = (_text(fields[k]) for k in (0, 1, 3))
        elements = fields[4]
        if name is None or units is None or not 0 <= elements <= records:
            return None
        # An empty slot of a program that does not write `no_val` holds zeros.
        if name and not name.startswith(_UNUSED):
            # Like xlook: a channel without a count has all rows.
            used.append(_Channel(name, units, comment or "", elements or records))
    if not used:
        return None
    return _Header(_text(title) or "", dtime, tuple(used), size)


def _text(raw: bytes) -> str | None:
    """Text up to its NUL; None if it holds control characters."""
    text = raw.partition(b"\0")[0]
    return text.decode("ascii").strip() if _PRINTABLE.issuperset(text) else None


def _plausibility(raw: np.ndarray[Any, Any], header: _Header, dtype: str) -> float:
    """Share of plausible numbers, minus the roughness of the first columns.

    Half of a float64 is no plausible float32 and makes a rough column; two float32 in one float64
    make a column run on into the next.
    """
    with np.errstate(all="ignore"):
        data = raw[header.size :].view(dtype)[:_SAMPLE].astype(np.float64)
        size = np.abs(data)
        plausible = np.isfinite(data) & (size > _SMALLEST) & (size < _LARGEST)
        zeros = float((data == 0).mean())
        share = float(plausible.mean()) + 0.5 * zeros
        first = data[: header.channels[0].elements]
        spread = float(np.var(first))
        rough = float(np.mean(np.diff(first) ** 2)) / spread if first.size > 2 and spread else 0.0
    return share - 0.2 * min(rough, 2.0) if np.isfinite(rough) else share - 0.4


def _columns(header: _Header, data: np.ndarray[Any, Any]) -> tuple[list[RawColumn], list[Finding]]:
    """The channels in order; short channels are padded with NaN."""
    rows = max(channel.elements for channel in header.channels)
    columns, findings, at = [], [], 0
    for channel in header.channels:
        values = np.full(rows, np.nan)
        values[: channel.elements] = data[at : at + channel.elements]
        at += channel.elements
        columns.append(RawColumn(channel.name, values, channel.units))
        if channel.elements < rows:
            where, lacking = f"{channel.name}, row {channel.elements}", rows - channel.elements
            text = (
                f"'{channel.name}' has {channel.elements} values where others have {rows}; the "
                "missing values are NaN."
            )
            findings.append(Finding("short column", "warning", lacking, where, text))
    return columns, findings


def _in_seconds(columns: list[RawColumn], period: float) -> tuple[list[RawColumn], list[Finding]]:
    """A time column that counts sampling periods, times the period that the header states.

    Such a column holds whole numbers that rise by whole numbers, mostly by one, while the header
    states another period than one second.
    """
    if not (np.isfinite(period) and period > 0 and period != 1):
        return columns, []
    made, findings = [], []
    for column in columns:
        is_time = bool(candidates("time", {column.label: None}))
        if not is_time or not _counts(column.values):
            made.append(column)
            continue
        made.append(RawColumn(column.label, column.values * period, "s"))
        text = (
            f"'{column.label}' counts samples, and the header states a period of {period:.9g} s; "
            "times are the count times this period. If the column is in seconds after all, read "
            f"with {Argument('rate', value='1 Hz')}."
        )
        findings.append(Finding("sample count", "warning", period, column.label, text))
    return made, findings


def _counts(values: np.ndarray[Any, Any]) -> bool:
    steps = np.diff(values[np.isfinite(values)])
    if steps.size < 2:
        return False
    whole = bool(np.all(steps == np.rint(steps))) and bool(np.all(steps >= 1))
    return whole and float(np.mean(steps == 1)) > 0.5 and values[0] == np.rint(values[0])
