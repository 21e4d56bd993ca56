"""CSV and other tables of text, parsed by pandas' compiled reader once the layout is known."""

from __future__ import annotations

import codecs
import io
import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from asperity.errors import InputError
from asperity.recording.finding import Finding
from asperity.recording.readers.compressed import GZIP, unpacked
from asperity.recording.readers.detect import is_text, wide_order
from asperity.recording.readers.raw import RawColumn, RawRecording, refuse_truncated, truncated
from asperity.recording.readers.text.columns import malformed, numbers_of, without_text_rows
from asperity.recording.readers.text.last_line import ending_of
from asperity.recording.readers.text.layout import Layout, layout_of
from asperity.recording.readers.text.lines import MISSING, lines_of

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

#: Where the table is looked for; farther only if it is not found: headers of some megabytes exist.
_HEADS = (1 << 16, 1 << 22)
_BUFFER = 1 << 20
#: Whole lines that a head must hold to show the layout.
_FEWEST_LINES = 8
_SKIPPED = re.compile(r"line (\d+)")


def load(path: Path, delimiter: str | None = None, decimal: str | None = None) -> RawRecording:
    """Columns of a text.

    Parameters
    ----------
    path : Path
        The file; UTF-8, UTF-16, or a Western code page; packed by gzip or not.
    delimiter, decimal : str or None
        Where the user knows better than the file shows.
    """
    with path.open("rb") as file:
        if file.read(2) == GZIP:
            text, why = unpacked(path)
            if not text:
                why = why.rstrip(".") or "it is empty"
                raise refuse_truncated(path, f"of which nothing can be unpacked: {why}")
            if not is_text(text[: 1 << 12]):
                raise InputError(
                    f"recording.path must hold a text if it is packed, got '{path.name}' with "
                    "something else; unpack it"
                )
            recorded = _of_any_encoding(io.BytesIO(text), path, delimiter, decimal)
            if why:
                recorded.findings.insert(0, truncated(path, 1, "the end", why))
            return recorded
        return _of_any_encoding(file, path, delimiter, decimal)


def _of_any_encoding(
    file: BinaryIO, path: Path, delimiter: str | None, decimal: str | None
) -> RawRecording:
    file.seek(0)
    mark = file.read(1 << 10)
    order = wide_order(mark)
    if order or mark.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        file.seek(0)
        wide = file.read().decode(f"utf-16-{order}" if order else "utf-16", errors="replace")
        wide = wide.removeprefix("\ufeff")
        return _load(io.BytesIO(wide.encode("utf-8")), 0, path, delimiter, decimal)
    start = 3 if mark.startswith(codecs.BOM_UTF8) else 0
    return _load(file, start, path, delimiter, decimal)


def _load(
    file: BinaryIO, start: int, path: Path, delimiter: str | None, decimal: str | None
) -> RawRecording:
    size = file.seek(0, io.SEEK_END)
    layout = _layout(file, start, size, path, delimiter, decimal)
    ending = ending_of(file, size, layout)
    frame, findings = _parse(file, layout, ending.stop, path)
    if not len(frame):
        raise InputError(
            f"recording.path must hold rows of numbers, got '{path.name}' with a heading only; "
            "give a recording"
        )
    frame, left_out = without_text_rows(frame, layout.width)
    findings += left_out
    columns = []
    for (i, column), _ in zip(frame.items(), range(layout.width), strict=False):
        values, found = numbers_of(column, layout.headings.names[i] or f"column {i}")
        unit = layout.headings.units[i] if layout.headings.units else None
        columns.append(RawColumn(layout.headings.names[i], values, unit))
        findings += found
    if layout.headings.found is not None:
        findings.insert(0, _mismatch(layout))
    step = layout.headings.step
    if step is not None and len(columns) > 1 and _is_empty(columns[0].values):
        # LabVIEW may write the interval in the header, and no times.
        del columns[0]
    else:
        step = None
    if ending.sentence:
        where = f"row {len(frame)}, the last"
        findings.insert(0, truncated(path, ending.rows, where, ending.sentence, ending.sure))
    provenance = {
        "format": "text",
        "delimiter": layout.delimiter or "blank",
        "decimal": layout.decimal,
    }
    return RawRecording(columns, findings, provenance, step=step)


def _mismatch(layout: Layout) -> Finding:
    """The finding of names that are more or fewer than the columns."""
    found, width = int(layout.headings.found or 0), layout.width
    first = min(found, width)
    rest = (
        f"columns {found} to {width - 1} have no name"
        if found < width
        else f"the last {found - width} names belong to no column"
    )
    return Finding(
        "heading mismatch",
        "warning",
        abs(found - width),
        "the heading",
        f"The heading has {found} names for {width} columns; the first {first} columns were given "
        f"the first {first} names, and {rest}. Where the names stopped to fit is not in the file: "
        "check that each column holds what its name says.",
    )


def _layout(
    file: BinaryIO, start: int, size: int, path: Path, delimiter: str | None, decimal: str | None
) -> Layout:
    for head in _HEADS:
        file.seek(start)
        lines = lines_of(file.read(head).rstrip(b"\0\x1a"), start)
        if start + head < size:
            # The last line is cut here; rows so long that few fit need a longer head.
            lines = lines[:-1]
            if len(lines) < _FEWEST_LINES and head != _HEADS[-1]:
                continue
        try:
            return layout_of(lines, path, delimiter, decimal)
        except InputError:
            if start + head >= size or head == _HEADS[-1]:
                raise
    raise AssertionError


def _is_empty(values: np.ndarray[Any, Any]) -> bool:
    return values.dtype.kind == "f" and bool(np.isnan(values).all())


class _Part(io.RawIOBase):
    """Bytes of a file from one offset to another, so that headings and a cut row are left out."""

    def __init__(self, file: BinaryIO, start: int, stop: int) -> None:
        self._file, self._left = file, stop - start
        file.seek(start)

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        got = self._file.read(min(len(buffer), self._left))
        buffer[: len(got)] = got
        self._left -= len(got)
        return len(got)


def _parsed_with_texts(parsed: Callable[..., pd.DataFrame], path: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        return parsed(low_memory=False)
    except (pd.errors.ParserError, pd.errors.EmptyDataError):
        raise InputError(
            f"recording.path must hold a table that can be parsed, got '{path.name}', in which a "
            "quote is opened and never closed, or a row goes on without end; correct the file"
        ) from None


def _parse(
    file: BinaryIO, layout: Layout, stop: int, path: Path
) -> tuple[pd.DataFrame, list[Finding]]:
    """The table, as numbers if all of it is numbers; and the rows that are none."""
    import pandas as pd

    options: dict[str, Any] = {
        "header": None,
        "names": list(range(layout.width + layout.closed)),
        "decimal": layout.decimal,
        "na_values": list(MISSING),
        "skipinitialspace": True,
        "on_bad_lines": "warn",
        "encoding_errors": "replace",
        "engine": "c",
        "sep": r"\s+" if layout.delimiter is None else layout.delimiter,
        "comment": layout.comment if len(layout.comment) == 1 else None,
        "thousands": {".": ",", ",": "."}[layout.decimal] if layout.grouped else None,
    }

    def parsed(**more: Any) -> pd.DataFrame:
        part = io.BufferedReader(_Part(file, layout.start, stop), _BUFFER)
        frame = pd.read_csv(part, **options, **more)
        if isinstance(frame.index, pd.RangeIndex):
            return frame
        # Surplus cells in the first row were taken for row labels, which moves all columns.
        part = io.BufferedReader(_Part(file, layout.start, stop), _BUFFER)
        return pd.read_csv(part, index_col=False, **options, **more)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            frame = parsed(dtype=np.float64)
        except ValueError:
            caught.clear()
            frame = _parsed_with_texts(parsed, path)
    rows = [int(n) for w in caught for n in _SKIPPED.findall(str(w.message))]
    rows = [*range(-layout.longer + 1, 1), *rows]
    return frame, [malformed(rows)] if rows else []
