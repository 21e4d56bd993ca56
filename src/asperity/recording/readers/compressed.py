"""Packed texts are unpacked in memory; archives and documents are refused with what to do."""

from __future__ import annotations

import contextlib
import io
import json
import zlib
from pathlib import Path
from typing import Any, BinaryIO

from asperity.errors import InputError

GZIP = b"\x1f\x8b"
_ARCHIVES = {
    b"PK\x03\x04": "a zip archive or a spreadsheet",
    b"BZh": "packed by bzip2",
    b"\xfd7zXZ": "packed by xz",
    b"\x28\xb5\x2f\xfd": "packed by zstd",
    b"7z\xbc\xaf": "a 7z archive",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet or document",
}
#: A window of zlib that expects the header of gzip.
_WINDOW = 31
#: Bytes that are unpacked at a time; of zeros, a thousand times as many come out.
_PIECE = 1 << 14
#: Bytes that a packed text may hold: at 40 a row, seven hours at 1 kHz. What is not packed may be
#: of any size.
LARGEST = 1 << 30


def refuse_archive(head: bytes, path: Path) -> None:
    """Refuse what must be unpacked or exported first.

    Raises
    ------
    InputError
        If a file begins as an archive does.
    """
    for mark, kind in _ARCHIVES.items():
        if head.startswith(mark):
            raise InputError(
                f"recording.path must be the recording itself, got '{path.name}', {kind}; unpack "
                "it, or save the sheet as CSV"
            )


def refuse_document(head: bytes, path: Path) -> None:
    """Refuse texts that are no tables, in which a table would be looked for at length.

    Raises
    ------
    InputError
        If the beginning of a file is one of JSON, XML or HTML.
    """
    text = head.decode("utf-8-sig", errors="replace").lstrip()
    kind = ""
    if text.startswith(("<?xml", "<!DOCTYPE", "<!doctype", "<html", "<HTML", "<svg")):
        kind = "XML or HTML"
    elif text.startswith(("{", "[")) and _is_json(text):
        kind = "JSON"
    if kind:
        raise InputError(
            f"recording.path must hold a table of numbers, got '{path.name}', which is {kind}; "
            "save it as CSV, or add a reader for it"
        )


def _is_json(text: str) -> bool:
    """Whether the beginning of a text is that of JSON, which may be cut."""
    try:
        json.JSONDecoder().raw_decode(text)
    except json.JSONDecodeError as error:
        # Where only the cut is wrong, the rest is JSON; headings in brackets fail at once.
        return error.pos > 0.9 * len(text) or "Unterminated" in error.msg
    except RecursionError:  # brackets in brackets without end
        return True
    # Values one after the other, a line each; "[1], [2]" is a heading.
    return text.startswith("{") or text.rstrip().endswith("]")


def unpacked(path: Path) -> tuple[bytes, str]:
    """Contents of a gzip file, and what is wrong with it.

    Parameters
    ----------
    path : Path

    Returns
    -------
    (bytes, str)
        What could be unpacked, and a sentence that is empty for a whole file.

    Raises
    ------
    InputError
        As soon as more comes out of it than `LARGEST`.
    """
    whole = io.BytesIO()
    with path.open("rb") as file:
        why = _unpack(file, whole, path)
    return whole.getvalue(), why


def _unpack(file: BinaryIO, whole: io.BytesIO, path: Path) -> str:
    """Unpack piece by piece into `whole`; what is wrong, in a sentence."""
    stream, piece = zlib.decompressobj(_WINDOW), file.read(_PIECE)
    while True:
        before = stream.copy()
        try:
            whole.write(stream.decompress(piece))
        except zlib.error:
            _until_damage(before, piece, whole)
            return "its packed contents are damaged."
        if whole.tell() > LARGEST:
            raise InputError(
                f"recording.path must unpack to at most {LARGEST // 1024**2} MB, got "
                f"'{path.name}', which goes on; unpack it, and see what it holds"
            )
        if not stream.eof:
            piece = file.read(_PIECE)
            if not piece:
                return "its packed contents end too early."
            continue
        # Files may be packed piece by piece; zeros behind them pad a tape.
        piece = stream.unused_data.lstrip(b"\0")
        while len(piece) < len(GZIP) and (more := file.read(_PIECE)):
            piece = (piece + more).lstrip(b"\0")
        if not piece.startswith(GZIP):
            return ""
        stream = zlib.decompressobj(_WINDOW)


def _until_damage(stream: Any, packed: bytes, whole: io.BytesIO) -> None:
    """Unpack what comes before the damage, byte by byte, as a piece that fails gives nothing."""
    with contextlib.suppress(zlib.error):
        for byte in packed:
            whole.write(stream.decompress(bytes([byte])))
