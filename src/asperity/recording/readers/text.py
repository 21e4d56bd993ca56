"""CSV and other tables of text, parsed by pandas' compiled reader once the layout is known.

A table may be packed by gzip. Archives, spreadsheets and documents are refused with what to do.
"""

from __future__ import annotations

import codecs
import gzip
import io
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from asperity.errors import InputError
from asperity.recording.finding import Finding
from asperity.recording.readers.layout import (
    MISSING,
    Headings,
    Layout,
    cells_of,
    digits,
    layout_of,
    lines_of,
    names_a_quantity,
)
from asperity.recording.readers.raw import (
    RawColumn,
    RawRecording,
    beginning,
    truncated,
    unusable,
)

if TYPE_CHECKING:
    import pandas as pd

#: Bytes searched for the table, first and at most: headers of some megabytes exist.
_HEADS = (1 << 16, 1 << 22)
#: Smallest number of complete lines from which the layout is determined.
_FEWEST_LINES = 8
#: Beginning of JSON; headings in brackets begin with a letter.
_JSON = re.compile(r"\{|\[\s*[-\d\[{\"]")
_SKIPPED = re.compile(r"line (\d+)")
_GZIP = b"\x1f\x8b"
_ARCHIVES = {
    b"PK\x03\x04": "a zip archive or a spreadsheet",
    b"BZh": "packed by bzip2",
    b"\xfd7zXZ": "packed by xz",
    b"\x28\xb5\x2f\xfd": "packed by zstd",
    b"7z\xbc\xaf": "a 7z archive",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet or document",
}
#: Bytes that a packed text may hold: at 40 a row, seven hours at 1 kHz. What is not packed may be
#: of any size.
LARGEST = 1 << 30
_TAIL = 1 << 16
#: Number of rows that must agree before a last line without line end is accepted.
_ENOUGH = 5
#: Exchanges decimal commas and points: what has the other mark is no number.
_MARKS = str.maketrans(",.", ".,")
#: Characters of a row of words shown in its finding.
_SHOWN = 60


def is_format(path: Path) -> bool:
    """Whether a file is a text, in any encoding that is read, or may be one that is packed.

    Raises
    ------
    InputError
        If it must be unpacked or exported first, or is a document and no table.
    """
    head = beginning(path)
    for mark, kind in _ARCHIVES.items():
        if head.startswith(mark):
            advice = "unpack it, or save the sheet as CSV"
            raise unusable(path, kind, "be the recording itself", advice)
    if kind := _document(head):
        # A table would be looked for in it at length.
        advice = "save it as CSV, or add a reader for it"
        raise unusable(path, f"which is {kind}", "hold a table of numbers", advice)
    return head.startswith(_GZIP) or _is_text(head)


def read(path: Path, *, delimiter: str | None = None, decimal: str | None = None) -> RawRecording:
    """Columns of a text.

    Parameters
    ----------
    path : Path
        The file; UTF-8, UTF-16, or a Western code page; packed by gzip or not.
    delimiter, decimal : str or None
        The user's choice, in place of the recognised one.
    """
    if beginning(path).startswith(_GZIP):
        return _of_any_encoding(io.BytesIO(_unpacked(path)), path, delimiter, decimal)
    with path.open("rb") as file:
        return _of_any_encoding(file, path, delimiter, decimal)


def _document(head: bytes) -> str:
    """Type of the document that a text begins; empty for a table."""
    text = head.decode("utf-8-sig", errors="replace").lstrip()
    if text.startswith(("<?xml", "<!DOCTYPE", "<!doctype", "<html", "<HTML", "<svg")):
        return "XML or HTML"
    return "JSON" if _JSON.match(text) else ""


def _wide_order(head: bytes) -> str:
    """Byte order of UTF-16 without its mark, ``"le"`` or ``"be"``; empty if it is none.

    Of a table in it, every other byte is zero.
    """
    for order, zeros, letters in (("le", head[1::2], head[::2]), ("be", head[::2], head[1::2])):
        if len(zeros) > 8 and zeros.count(0) > 0.9 * len(zeros) and letters.count(0) == 0:
            return order
    return ""


def _is_text(head: bytes) -> bool:
    """Whether the beginning of a file is one of a text, in any encoding that is read."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")) or _wide_order(head):
        return True
    control = sum(byte < 32 and byte not in b"\t\n\r\f\x1a" for byte in head)
    return control == 0


def _unpacked(path: Path) -> bytes:
    """Contents of a gzip file, which are to be a text of at most `LARGEST` bytes."""
    with gzip.open(path) as packed:
        text = packed.read(LARGEST + 1)
    if len(text) > LARGEST:
        rule = f"unpack to at most {LARGEST // 1024**2} MB"
        raise unusable(path, "which goes on", rule, "unpack it, and see what it holds")
    if not _is_text(text[: 1 << 12]):
        raise unusable(
            path, "which holds something else", "hold a text if it is packed", "unpack it"
        )
    return text


def _of_any_encoding(
    file: BinaryIO, path: Path, delimiter: str | None, decimal: str | None
) -> RawRecording:
    file.seek(0)
    mark = file.read(1 << 10)
    order = _wide_order(mark)
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
    ending = _ending_of(file, size, layout)
    frame, findings = _parse(file, layout, ending.stop)
    if not len(frame):
        raise unusable(path, "which has a heading only", "hold rows of numbers", "give a recording")
    frame, left_out = _without_text_rows(frame, layout)
    findings += left_out
    columns = []
    for i, name in enumerate(layout.headings.names):
        values, texts = _numbers_of(frame[i], layout.decimal, name or f"column {i}")
        unit = layout.headings.units[i] if layout.headings.units else None
        columns.append(RawColumn(name, values, unit))
        findings += texts
    if layout.headings.names_in_file is not None:
        findings.insert(0, _mismatch(layout))
    step, first = layout.headings.step, columns[0].values
    if step is not None and len(columns) > 1 and first.dtype.kind == "f" and np.isnan(first).all():
        # LabVIEW may write the interval in the header, and no times.
        del columns[0]
    else:
        step = None
    if ending.sentence:
        where = f"row {len(frame)}, the last"
        findings.insert(0, truncated(ending.rows, where, ending.sentence, ending.sure))
    provenance = {
        "format": "text",
        "delimiter": layout.delimiter or "blank",
        "decimal": layout.decimal,
    }
    return RawRecording(columns, findings, provenance, step=step)


def _mismatch(layout: Layout) -> Finding:
    """The finding of names that are more or fewer than the columns."""
    count, width = int(layout.headings.names_in_file or 0), layout.width
    first = min(count, width)
    others = (
        f"columns {count} to {width - 1} have no name"
        if count < width
        else "the last name belongs to no column"
        if count == width + 1
        else f"the last {count - width} names belong to no column"
    )
    text = (
        f"The heading has {count} names for {width} columns; the first {first} columns were given "
        f"the first {first} names, and {others}. The file does not say from which column on "
        "the names are wrong: check that each column holds what its name says."
    )
    if width == 2 * count and layout.delimiter == ",":
        text += " Commas seem to be decimal marks, too: save it with semicolons between cells."
    return Finding("heading mismatch", "warning", abs(count - width), "the heading", text)


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


def _parse(file: BinaryIO, layout: Layout, stop: int) -> tuple[pd.DataFrame, list[Finding]]:
    """The table, as numbers if all cells are numbers, and the malformed rows."""
    import pandas as pd

    options: dict[str, Any] = {
        "header": None,
        # Surplus cells of the first row are no row labels, which would shift all columns.
        "index_col": False,
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
        end = file.seek(0, io.SEEK_END)
        file.seek(layout.start)
        # A copy of the rows where bytes behind them do not count.
        rows = file if stop == end else io.BytesIO(file.read(stop - layout.start))
        return pd.read_csv(rows, **options, **more)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            frame = parsed(dtype=np.float64)
        except ValueError:
            caught.clear()
            frame = parsed(low_memory=False)
    longer = [int(n) for w in caught for n in _SKIPPED.findall(str(w.message))]
    longer = [*range(-layout.longer + 1, 1), *longer]
    if not longer:
        return frame, []
    text = (
        f"{len(longer)} {'row has' if len(longer) == 1 else 'rows have'} more cells than the table "
        "has columns, and could not be read."
    )
    where = f"line {max(longer[0], 1)} of the table"
    return frame, [Finding("malformed row", "error", len(longer), where, text)]


@dataclass(frozen=True)
class _Ending:
    """End of the complete rows of a text.

    Attributes
    ----------
    stop : int
        Offset in bytes behind the last row that counts.
    rows : int
        Number of rows left out at the end.
    sentence : str
        The reason; empty for a complete text.
    sure : bool
        Whether the file must have been cut, or only may have been.
    """

    stop: int
    rows: int = 0
    sentence: str = ""
    sure: bool = True


def _ending_of(file: BinaryIO, size: int, layout: Layout) -> _Ending:
    """Judge the last line by its end, its cells and its digits.

    A line without its end is whole if all its cells are there and the last one has as many digits
    behind its mark as the rows before it, all of which must agree; programs that leave out the last
    line end are that regular. Otherwise its last number may be short, and the row is left out.
    """
    begin = max(layout.start, size - _TAIL)
    file.seek(begin)
    tail = file.read(size - begin)
    padded = len(tail) - len(tail.rstrip(b"\0"))
    tail = tail.rstrip(b"\0\x1a")
    stop = begin + len(tail)
    lines = [line for line in lines_of(tail, begin) if not line.blank]
    if not lines or (lines[-1].ended and not padded):
        return _Ending(stop)
    last = lines[-1]
    if padded and last.ended:
        return _Ending(stop, 0, f"it ends with {padded} empty bytes where rows should be.")
    if last.text.count('"') % 2:
        return _Ending(last.start, 1, "its last row has an open quote, and was left out.")
    cells = cells_of(last.text, layout.delimiter)
    width = layout.width + layout.closed
    if last.comment:
        return _Ending(stop)
    if len(cells) < width:
        why = f"its last row has {len(cells)} of {width} cells, and was left out."
        return _Ending(last.start, 1, why)
    whole = _is_whole(cells, layout)
    if whole:
        return _Ending(stop)
    why = "its last row has no line end and its last number may be short; it was left out."
    return _Ending(last.start, 1, why, sure=whole is not None)


def _is_whole(cells: list[str], layout: Layout) -> bool | None:
    """Whether the last number is complete; None if unknown."""
    if layout.closed:
        # The delimiter after the last number exists.
        return True
    column = layout.width - 1
    last = digits(cells[column], layout.decimal)
    usual = {digits(row[column], layout.decimal) for row in layout.sample}
    # Whole numbers can be cut and look whole; and few rows may agree by chance.
    if len(usual) > 1 or len(layout.sample) < _ENOUGH or usual == {(0, 0)}:
        return None
    return usual == {last}


def _as_numbers(column: pd.Series[Any], decimal: str) -> pd.Series[Any]:
    """A column as numbers, NaN where a cell holds none."""
    import pandas as pd

    if decimal == ",":
        column = column.map(lambda cell: cell.translate(_MARKS) if isinstance(cell, str) else cell)
    return pd.to_numeric(column, errors="coerce")


def _without_text_rows(frame: pd.DataFrame, layout: Layout) -> tuple[pd.DataFrame, list[Finding]]:
    """A table of numbers without rows of words, such as headings between parts and remarks.

    Parameters
    ----------
    frame : DataFrame
        A column that holds words only, such as dates, leaves all rows.
    layout : Layout
    """
    width, decimal = layout.width, layout.decimal
    texts = [i for i, kind in enumerate(frame.dtypes) if i < width and kind.kind not in "iuf"]
    if not texts:
        return frame, []
    numbers = frame[list(range(width))].apply(_as_numbers, decimal=decimal)
    if any(2 * numbers[i].notna().sum() < frame[i].notna().sum() for i in texts):
        return frame, []
    words = (frame[texts].notna().any(axis=1) & numbers.isna().all(axis=1)).to_numpy()
    count = int(words.sum())
    if not count:
        return frame, []
    first = int(np.argmax(words))
    line = " ".join(cell for cell in frame.iloc[first] if isinstance(cell, str))[:_SHOWN]
    text = (
        f"{count} {'row holds' if count == 1 else 'rows hold'} words and no number, the first "
        f"'{line}' in row {first}, and {'was' if count == 1 else 'were'} left out."
    )
    findings = [Finding("text row", "note", count, f"row {first}", text)]
    for row in np.flatnonzero(words):
        cells = [str(cell).strip() for cell in frame.iloc[row, :width]]
        if _is_another_heading(cells, layout.headings):
            text = (
                f"Row {row} is another heading, '{' '.join(cells)[:_SHOWN]}': the rows from there "
                "on were read by the first one. Split the file there."
            )
            findings.append(Finding("heading mismatch", "error", 1, f"row {row}", text))
            break
    return frame[~words].reset_index(drop=True), findings


def _is_another_heading(cells: Sequence[str], headings: Headings) -> bool:
    """Whether a row of words has other names or units of quantities than the headings."""
    known = [[_plain(cell) for cell in row] for row in (headings.names, headings.units or [])]
    quantities = sum(map(names_a_quantity, cells))
    return 2 * quantities > len(cells) and [_plain(cell) for cell in cells] not in known


def _plain(cell: str) -> str:
    """A heading without what depends on the encoding of the file."""
    return "".join(c for c in cell if c.isascii() and not c.isspace())


def _numbers_of(
    column: pd.Series[Any], decimal: str, name: str
) -> tuple[np.ndarray[Any, Any], list[Finding]]:
    """Numbers of a column, with NaN for single texts; a column of texts is returned unchanged."""
    if column.dtype.kind in "iuf":
        return column.to_numpy(dtype=np.float64), []
    numbers = _as_numbers(column, decimal).to_numpy(dtype=np.float64)
    texts = np.flatnonzero(np.isnan(numbers) & column.notna().to_numpy())
    if 2 * texts.size > numbers.size:
        return column.to_numpy(dtype=object), []
    if not texts.size:
        return numbers, []
    first = int(texts[0])
    text = (
        f"{texts.size} of {numbers.size} cells of '{name}' hold text, the first '"
        f"{column.iloc[first]}' in row {first}; they were read as missing."
    )
    return numbers, [
        Finding("text in numbers", "warning", texts.size, f"{name}, row {first}", text)
    ]
