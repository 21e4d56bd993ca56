"""Packed texts are unpacked in memory; archives and documents are refused with what to do."""

from __future__ import annotations

import json
import zlib
from pathlib import Path

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
_PIECE = 1 << 16


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
    """
    rest, parts = path.read_bytes(), []
    while rest.startswith(GZIP):
        stream = zlib.decompressobj(_WINDOW)
        try:
            parts.append(stream.decompress(rest))
        except zlib.error:
            return b"".join([*parts, _until_damage(rest)]), "its packed contents are damaged."
        if not stream.eof:
            return b"".join(parts), "its packed contents end too early."
        # Files may be packed piece by piece; zeros behind them pad a tape.
        rest = stream.unused_data.lstrip(b"\0")
    return b"".join(parts), ""


def _until_damage(packed: bytes) -> bytes:
    """What comes out of a damaged stream before the damage."""
    stream = zlib.decompressobj(_WINDOW)
    parts = []
    for at in range(0, len(packed), _PIECE):
        piece, before = packed[at : at + _PIECE], stream.copy()
        try:
            parts.append(stream.decompress(piece))
        except zlib.error:
            # Byte by byte, as a piece that fails gives nothing.
            try:
                for byte in piece:
                    parts.append(before.decompress(bytes([byte])))
            except zlib.error:
                break
    return b"".join(parts)
