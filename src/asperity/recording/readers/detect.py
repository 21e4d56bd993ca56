"""What format a file is in: by what it holds, and by its extension only where that says nothing."""

from __future__ import annotations

from pathlib import Path

from asperity.errors import InputError
from asperity.recording.readers.compressed import GZIP, refuse_archive, refuse_document
from asperity.recording.readers.look.header import looks_like_look

#: Formats, with the module that reads each.
FORMATS = {
    "text": "text.file",
    "hdf5": "hdf5",
    "matlab": "matlab.file",
    "tdms": "tdms",
    "look": "look.file",
}

_HDF5 = b"\x89HDF\r\n\x1a\n"
_MATLAB_5 = b"MATLAB 5.0 MAT-file"
_HEAD = 4096


def format_of(path: Path) -> str:
    """Name of the format, a key of `FORMATS`; `InputError` if it is none of them."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if head.startswith(b"MATLAB 7.3 MAT-file"):
        return "hdf5"
    if head.startswith(_MATLAB_5) or (len(head) < 20 and _MATLAB_5.startswith(head)):
        return "matlab"
    if head.startswith((b"TDSm", b"TDSh")):
        return "tdms"
    # HDF5 may begin with a block of the user's, of 512 bytes or a power of two times that.
    if any(head[at : at + 8] == _HDF5 for at in (0, 512, 1024, 2048)):
        return "hdf5"
    if head.startswith(GZIP):
        return "text"
    refuse_archive(head, path)
    refuse_document(head, path)
    if looks_like_look(path):
        return "look"
    if is_text(head):
        return "text"
    # Version 4 of MATLAB has no signature.
    if path.suffix.lower() == ".mat":
        return "matlab"
    raise InputError(
        f"recording.path must be CSV or other text, HDF5, MATLAB, TDMS or LOOK, got '{path.name}', "
        "which looks like none of them; name it with format= if it is one"
    )


def wide_order(head: bytes) -> str:
    """Byte order of UTF-16 without its mark, ``"le"`` or ``"be"``; empty if it is none.

    Of a table in it, every other byte is zero.
    """
    for order, zeros, letters in (("le", head[1::2], head[::2]), ("be", head[::2], head[1::2])):
        if len(zeros) > 8 and zeros.count(0) > 0.9 * len(zeros) and letters.count(0) == 0:
            return order
    return ""


def is_text(head: bytes) -> bool:
    """Whether the beginning of a file is one of a text, in any encoding that is read."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")) or wide_order(head):
        return True
    control = sum(byte < 32 and byte not in b"\t\n\r\f\x1a" for byte in head)
    return control == 0
