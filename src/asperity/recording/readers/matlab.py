"""MATLAB files of version 5 and older, read by SciPy; those of version 7.3 are HDF5.

SciPy trusts the sizes in a version 5 file that is not compressed, and a wrong one can end the
interpreter: they are checked before. Compressed elements have a checksum.
"""

from __future__ import annotations

import io
import math
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.recording.readers.raw import (
    Group,
    RawRecording,
    beginning,
    group_of,
    one_recording,
)

_SIGNATURE = b"MATLAB 5.0 MAT-file"
_HEADER = 128
#: Bytes of a number, by the type of its element; and the types of matrices and of what is packed.
_SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_MATRIX, _COMPRESSED = 14, 15
#: Classes of matrices that hold numbers.
_NUMBERS = range(6, 16)


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
        order = {b"IM": "<", b"MI": ">"}[raw[126:128]]
        _checked(raw, _HEADER, len(raw), order)
    variables = scipy.io.loadmat(io.BytesIO(raw), simplify_cells=True)
    groups: dict[str, Group] = {}

    def visit(arrays: Mapping[str, Any], name: str) -> None:
        groups[name] = group_of(arrays)
        for key, value in arrays.items():
            if isinstance(value, Mapping):
                visit(value, f"{name}/{key}".strip("/"))

    visit({k: v for k, v in variables.items() if not k.startswith("__")}, "")
    return one_recording(groups, path, group, {"format": "matlab 5"})


def _checked(raw: bytes, at: int, stop: int, order: str) -> list[tuple[int, int, int]]:
    """Type, first byte and size of the elements of a stretch; ValueError if a size is wrong."""
    elements = []
    while at < stop:
        kind, size = struct.unpack_from(f"{order}II", raw, at)
        # Four bytes at most stand in the tag itself.
        short = kind >> 16
        if short:
            kind, size, first, at = kind & 0xFFFF, short, at + 4, at + 8
        else:
            first = at + 8
            # What is compressed is not padded.
            at = first + (size if kind == _COMPRESSED else -(-size // 8) * 8)
        if first + size > stop or kind not in {*_SIZES, _MATRIX, _COMPRESSED}:
            raise ValueError("an element is longer than what it lies in, or of no known type")
        elements.append((kind, first, size))
        if kind == _MATRIX and size:
            flags, sides, _, *data = _checked(raw, first, first + size, order)
            (what,) = struct.unpack_from(f"{order}I", raw, flags[1])
            lengths = struct.unpack_from(f"{order}{sides[2] // 4}i", raw, sides[1])
            wrong = any(n != _SIZES.get(k, 0) * math.prod(lengths) for k, _, n in data)
            if flags[2] != 8 or min(lengths) < 0 or (what & 0xFF in _NUMBERS and wrong):
                raise ValueError("a matrix has not as many numbers as it says")
    return elements
