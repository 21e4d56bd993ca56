"""The elements of a MATLAB 5 file, walked before the library does.

SciPy trusts the tags of a file that is not compressed; a damaged one can end the interpreter. What
is compressed has a checksum of its own.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator

#: Bytes of a number, by the type of its element.
_SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_MATRIX, _COMPRESSED = 14, 15
_INT8, _INT32, _UINT32 = 1, 5, 6
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION = 1, 2, 3, 4, 5, 16
_NUMERIC = range(6, 16)
_COMPLEX = 0x0800
_DEEPEST = 64


class _DamagedError(Exception):
    """Whatever is wrong: the reader says it in its own words."""


def is_sound(raw: bytes, start: int, order: str) -> bool:
    """Whether all elements from `start` on lie within those that hold them, and are what they say.

    Parameters
    ----------
    raw : bytes
        The file.
    start : int
        Offset of the first element.
    order : {"<", ">"}
    """
    try:
        for kind, first, size in _elements(raw, start, len(raw), order):
            if kind == _MATRIX:
                _walk_matrix(raw, first, first + size, order, 0)
            elif kind != _COMPRESSED:
                return False
    except (_DamagedError, struct.error):
        return False
    return True


def _elements(raw: bytes, at: int, stop: int, order: str) -> Iterator[tuple[int, int, int]]:
    """Type, offset and size of the data of each element."""
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
        yield kind, first, size


def _walk_matrix(raw: bytes, at: int, stop: int, order: str, depth: int) -> None:
    if at == stop:
        # An empty cell.
        return
    if depth > _DEEPEST:
        raise _DamagedError
    parts = list(_elements(raw, at, stop, order))
    if len(parts) < 3 or [p[0] for p in parts[:2]] != [_UINT32, _INT32] or parts[0][2] != 8:
        raise _DamagedError
    (flags,) = struct.unpack_from(f"{order}I", raw, parts[0][1])
    if parts[1][2] < 8 or parts[1][2] % 4 or parts[2][0] != _INT8:
        raise _DamagedError
    sides = struct.unpack_from(f"{order}{parts[1][2] // 4}i", raw, parts[1][1])
    if min(sides) < 0:
        raise _DamagedError
    _walk_contents(raw, parts[3:], flags, math.prod(sides), order, depth)


def _walk_contents(
    raw: bytes, parts: list[tuple[int, int, int]], flags: int, count: int, order: str, depth: int
) -> None:
    kind = flags & 0xFF
    arrays = 1 + bool(flags & _COMPLEX)
    if kind in _NUMERIC:
        if [size // _SIZES.get(k, 1) for k, _, size in parts] != [count] * arrays:
            raise _DamagedError
    elif kind == _CHAR:
        if len(parts) != 1:
            raise _DamagedError
    elif kind == _SPARSE:
        if len(parts) != 2 + arrays:
            raise _DamagedError
    elif kind in (_CELL, _FUNCTION):
        _walk_matrices(raw, parts, count if kind == _CELL else 1, order, depth)
    elif kind in (_STRUCT, _OBJECT):
        named = parts[kind == _OBJECT :]
        if len(named) < 2 or named[0][2] != 4:
            raise _DamagedError
        (length,) = struct.unpack_from(f"{order}i", raw, named[0][1])
        if length < 1 or named[1][0] != _INT8 or named[1][2] % length:
            raise _DamagedError
        _walk_matrices(raw, named[2:], count * (named[1][2] // length), order, depth)
    else:
        raise _DamagedError


def _walk_matrices(
    raw: bytes, parts: list[tuple[int, int, int]], count: int, order: str, depth: int
) -> None:
    if len(parts) != count:
        raise _DamagedError
    for kind, first, size in parts:
        if kind != _MATRIX:
            raise _DamagedError
        _walk_matrix(raw, first, first + size, order, depth + 1)
