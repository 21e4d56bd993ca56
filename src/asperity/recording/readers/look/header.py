"""Header of the LOOK binary of xlook, the data program of the Penn State rock mechanics laboratory.

Big-endian: title (20 bytes), number of records (int32), number of channels (int32), sweep (int32),
``dtime`` (float32); then 16 (older) or 32 headers of 84 bytes, one a channel: name (13 bytes),
units (13), gain (float32), comment (50), number of elements (int32). Channels that are not used are
called ``no_val``.
"""

from __future__ import annotations

import string
import struct
from dataclasses import dataclass
from pathlib import Path

_START = struct.Struct(">20siiif")
_CHANNEL = struct.Struct(">13s13sf50si")
#: Headers that a file may have room for, the newer first.
SLOTS = (32, 16)
_PRINTABLE = frozenset(string.printable.encode()) - frozenset(b"\t\n\r\x0b\x0c")
_UNUSED = "no_val"


@dataclass(frozen=True)
class LookChannel:
    """A channel that is in use."""

    name: str
    units: str
    comment: str
    elements: int


@dataclass(frozen=True)
class LookHeader:
    """Header of a file, read with one number of slots."""

    title: str
    records: int
    dtime: float
    channels: tuple[LookChannel, ...]
    size: int


def looks_like_look(path: Path) -> bool:
    """Whether the beginning of a file can be a LOOK header."""
    with path.open("rb") as file:
        head = file.read(header_size(SLOTS[0]))
    return bool(headers(head))


def header_size(slots: int) -> int:
    """Bytes before the data."""
    return _START.size + slots * _CHANNEL.size


def headers(head: bytes) -> list[LookHeader]:
    """Every reading of `head` that makes sense, with 32 slots and with 16."""
    found = (_header(head, slots) for slots in SLOTS if len(head) >= header_size(slots))
    return [header for header in found if header is not None]


def _header(head: bytes, slots: int) -> LookHeader | None:
    title, records, channels, _, dtime = _START.unpack_from(head)
    if records < 1 or not 1 <= channels <= slots or _text(title) is None:
        return None
    behind = head[header_size(slots) :][: len(_UNUSED)]
    if behind and _UNUSED.encode().startswith(behind):
        # The header goes on: a file of 32 slots that is cut within them.
        return None
    used = []
    for i in range(slots):
        fields = _CHANNEL.unpack_from(head, _START.size + i * _CHANNEL.size)
        name, units, comment = (_text(fields[k]) for k in (0, 1, 3))
        elements = fields[4]
        if name is None or units is None or not 0 <= elements <= records:
            return None
        # An empty slot of a program that does not write `no_val` holds nothing.
        if name and not name.startswith(_UNUSED):
            # xlook itself takes a channel without a count for a full one.
            used.append(LookChannel(name, units, comment or "", elements or records))
    if not used:
        return None
    return LookHeader(_text(title) or "", records, dtime, tuple(used), header_size(slots))


def _text(raw: bytes) -> str | None:
    """Text up to its NUL; None if it holds what no text does."""
    text = raw.partition(b"\0")[0]
    return text.decode("ascii").strip() if _PRINTABLE.issuperset(text) else None
