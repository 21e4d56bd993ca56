"""MATLAB files of version 5 and older, read by SciPy; those of version 7.3 are HDF5.

SciPy trusts the tags of a version 5 file that is not compressed: of files with one to five changed
bytes, one in about 100 ends the interpreter. The elements of a file are therefore checked before
SciPy reads them; compressed elements have a checksum.
"""

from __future__ import annotations

import io
import math
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from asperity.recording.readers.raw import (
    RawColumn,
    RawRecording,
    beginning,
    group_columns,
    one_table,
    refuse_truncated,
)

_SIGNATURE = b"MATLAB 5.0 MAT-file"
_HEADER = 128
#: Bytes of a number, by the type of its element.
_SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_MATRIX, _COMPRESSED = 14, 15
_INT8, _INT32, _UINT32 = 1, 5, 6
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION = 1, 2, 3, 4, 5, 16
_NUMERIC = range(6, 16)
_COMPLEX = 0x0800
_DEEPEST = 64


def is_format(path: Path) -> bool:
    """By the signature of version 5; version 4 has none but a zero in its first four bytes."""
    head = beginning(path)
    if head.startswith(_SIGNATURE) or (len(head) < 20 and _SIGNATURE.startswith(head)):
        return True
    return path.suffix.lower() == ".mat" and 0 in head[:4]


def read(path: Path, *, group: str | None = None) -> RawRecording:
    """Columns of a MAT file.

    Parameters
    ----------
    path : Path
        One that is cut within a variable, or damaged, is refused.
    group : str or None
        The struct to read, where several hold recordings.
    """
    import scipy.io

    raw = path.read_bytes()
    if 0 not in raw[:4]:
        _refuse_unsound(path, raw)
    variables = scipy.io.loadmat(io.BytesIO(raw), simplify_cells=True)
    groups: dict[str, list[RawColumn]] = {}
    steps: list[float | None] = []

    def visit(arrays: Mapping[str, Any], name: str) -> None:
        groups[name], step = group_columns(arrays)
        steps.append(step)
        for key, value in arrays.items():
            if isinstance(value, Mapping):
                visit(value, f"{name}/{key}".strip("/"))

    visit({k: v for k, v in variables.items() if not k.startswith("__")}, "")
    columns, left_out = one_table(groups, path, group)
    step = next((s for s in steps if s is not None), None)
    return RawRecording(columns, left_out, {"format": "matlab 5", "group": group or ""}, step=step)


class _DamagedError(Exception):
    """An invalid element."""


class _Element(NamedTuple):
    """Type of an element, offset and size of its data."""

    kind: int
    first: int
    size: int


def _refuse_unsound(path: Path, raw: bytes) -> None:
    """Refuse a version 5 file with an element that exceeds the element around it."""
    order = {b"IM": "<", b"MI": ">"}.get(raw[126:128])
    if order is None:
        why = "which is cut within its header" if len(raw) < _HEADER else "whose header is damaged"
        raise refuse_truncated(path, why)
    try:
        for element in _elements(raw, _HEADER, len(raw), order):
            if element.kind == _MATRIX:
                _walk_matrix(raw, element, order, 0)
            elif element.kind != _COMPRESSED:
                raise _DamagedError
    except (_DamagedError, struct.error):
        raise refuse_truncated(path, "which is cut or damaged") from None


def _elements(raw: bytes, at: int, stop: int, order: str) -> Iterator[_Element]:
    while at < stop:
        if at + 8 > stop:
            raise _DamagedError
        kind, size = struct.unpack_from(f"{order}II", raw, at)
        first = at + 8
        if kind >> 16:
            # Four bytes at most stand in the tag itself.
            kind, size, first = kind & 0xFFFF, kind >> 16, at + 4
            at += 8
            if size > 4:
                raise _DamagedError
        else:
            # What is compressed is not padded.
            at = first + (size if kind == _COMPRESSED else -(-size // 8) * 8)
        if first + size > stop or (kind not in _SIZES and kind not in (_MATRIX, _COMPRESSED)):
            raise _DamagedError
        yield _Element(kind, first, size)


def _walk_matrix(raw: bytes, matrix: _Element, order: str, depth: int) -> None:
    if not matrix.size:
        # An empty cell.
        return
    if depth > _DEEPEST:
        raise _DamagedError
    parts = list(_elements(raw, matrix.first, matrix.first + matrix.size, order))
    if len(parts) < 3 or [p.kind for p in parts[:3]] != [_UINT32, _INT32, _INT8]:
        raise _DamagedError
    flags, sides = parts[:2]
    if flags.size != 8 or sides.size < 8 or sides.size % 4:
        raise _DamagedError
    (kind,) = struct.unpack_from(f"{order}I", raw, flags.first)
    lengths = struct.unpack_from(f"{order}{sides.size // 4}i", raw, sides.first)
    if min(lengths) < 0:
        raise _DamagedError
    _walk_contents(raw, parts[3:], kind, math.prod(lengths), order, depth)


def _walk_contents(
    raw: bytes, parts: list[_Element], flags: int, count: int, order: str, depth: int
) -> None:
    kind = flags & 0xFF
    arrays = 1 + bool(flags & _COMPLEX)
    if kind in _NUMERIC:
        sound = [p.size // _SIZES.get(p.kind, 1) for p in parts] == [count] * arrays
    elif kind in (_CHAR, _SPARSE):
        sound = len(parts) == (1 if kind == _CHAR else 2 + arrays)
    elif kind in (_CELL, _FUNCTION):
        sound = _walk_matrices(raw, parts, count if kind == _CELL else 1, order, depth)
    elif kind in (_STRUCT, _OBJECT):
        named = parts[kind == _OBJECT :]
        if len(named) < 2 or named[0].size != 4:
            raise _DamagedError
        (length,) = struct.unpack_from(f"{order}i", raw, named[0].first)
        if length < 1 or named[1].kind != _INT8 or named[1].size % length:
            raise _DamagedError
        fields = named[1].size // length
        sound = _walk_matrices(raw, named[2:], count * fields, order, depth)
    else:
        sound = False
    if not sound:
        raise _DamagedError


def _walk_matrices(raw: bytes, parts: list[_Element], count: int, order: str, depth: int) -> bool:
    if len(parts) != count or any(part.kind != _MATRIX for part in parts):
        return False
    for part in parts:
        _walk_matrix(raw, part, order, depth + 1)
    return True
