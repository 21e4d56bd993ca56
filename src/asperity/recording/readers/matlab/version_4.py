"""The variables of a MATLAB 4 file, walked before the library reads them.

The format has no signature and no checksum: each variable is a header of five int32 (type, rows,
columns, whether imaginary, length of the name), its name, and its numbers. SciPy warns of, or
trusts, whatever a damaged header says.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

_HEADER = struct.Struct("5i")
#: Bytes of a number, by the tens digit of the type.
_SIZES = {0: 8, 1: 4, 2: 4, 3: 2, 4: 2, 5: 1}
_LONGEST_NAME = 256


class WholePart(NamedTuple):
    """How much of a file is sound: bytes and variables, and whether what follows is damaged."""

    stop: int
    variables: int
    damaged: bool


def whole_part(raw: bytes) -> WholePart:
    """The variables of a file that are whole, up to a cut or to damage.

    Parameters
    ----------
    raw : bytes
        The file.
    """
    at = count = 0
    order = _order(raw)
    while at < len(raw):
        if at + _HEADER.size > len(raw):
            return WholePart(at, count, damaged=False)
        kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", raw, at)
        name = raw[at + _HEADER.size : at + _HEADER.size + max(length, 0)]
        digits = (kind // 1000, kind // 100 % 10, kind // 10 % 10, kind % 10)
        sound = (
            digits[0] in (0, 1)
            and digits[1] == 0
            and digits[2] in _SIZES
            and digits[3] in (0, 1, 2)
            and min(rows, columns) >= 0
            and imaginary in (0, 1)
            and 1 <= length <= _LONGEST_NAME
        )
        if not sound:
            return WholePart(at, count, damaged=True)
        if len(name) == length and not name.rstrip(b"\0").decode("latin-1").isprintable():
            return WholePart(at, count, damaged=True)
        numbers = rows * columns * (1 + imaginary)
        behind = at + _HEADER.size + length + numbers * _SIZES[digits[2]]
        if behind > len(raw):
            return WholePart(at, count, damaged=False)
        at, count = behind, count + 1
    return WholePart(at, count, damaged=False)


def _order(raw: bytes) -> str:
    """Byte order: the type of the first variable is below 5000 in the right one."""
    (kind,) = struct.unpack_from("<i", raw.ljust(4, b"\0"))
    return "<" if 0 <= kind < 5000 else ">"
