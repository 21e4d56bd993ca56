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
from asperity.instrument.finding import Finding
from asperity.instrument.readers.recorded import Column, Recorded, truncated
from asperity.instrument.readers.text_end import ending_of
from asperity.instrument.readers.text_layout import Layout, layout_of
from asperity.instrument.readers.text_lines import MISSING, lines_of

if TYPE_CHECKING:
    import pandas as pd

_HEAD = 1 << 16
_BUFFER = 1 << 20
_SKIPPED = re.compile(r"line (\d+)")


def load(path: Path, delimiter: str | None = None, decimal: str | None = None) -> Recorded:
    """Columns of a text.

    Parameters
    ----------
    path : Path
        The file; UTF-8, UTF-16 with its mark, or a Western code page.
    delimiter, decimal : str or None
        Where the user knows better than the file shows.
    """
    with path.open("rb") as file:
        mark = file.read(3)
        if mark.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            file.seek(0)
            text = file.read().decode("utf-16", errors="replace").encode("utf-8")
            return _load(io.BytesIO(text), 0, path, delimiter, decimal)
        return _load(file, 3 if mark == codecs.BOM_UTF8 else 0, path, delimiter, decimal)


def _load(
    file: BinaryIO, start: int, path: Path, delimiter: str | None, decimal: str | None
) -> Recorded:
    size = file.seek(0, io.SEEK_END)
    file.seek(start)
    head = file.read(_HEAD).rstrip(b"\0\x1a")
    lines = lines_of(head, start)
    if start + _HEAD < size and len(lines) > 1:
        lines = lines[:-1]
    layout = layout_of(lines, path, delimiter, decimal)
    ending = ending_of(file, size, layout)
    frame, findings = _parse(file, layout, ending.stop)
    if not len(frame):
        raise InputError(
            f"recording.path must hold rows of numbers, got '{path.name}' with a heading only; "
            "give a recording"
        )
    columns = []
    for i in range(layout.width):
        values, found = _numbers(frame[i], layout.headings.names[i] or f"column {i}")
        unit = layout.headings.units[i] if layout.headings.units else None
        columns.append(Column(layout.headings.names[i], values, unit))
        findings += found
    if ending.sentence:
        where = f"row {len(frame)}, the last"
        findings.insert(0, truncated(path, ending.rows, where, ending.sentence, ending.sure))
    provenance = {
        "format": "text",
        "delimiter": layout.delimiter or "blank",
        "decimal": layout.decimal,
    }
    return Recorded(columns, findings, provenance)


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


def _parse(file: BinaryIO, layout: Layout, stop: int) -> tuple[pd.DataFrame, list[Finding]]:
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
    }

    def parsed(**more: Any) -> pd.DataFrame:
        part = io.BufferedReader(_Part(file, layout.start, stop), _BUFFER)
        return pd.read_csv(part, **options, **more)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            frame = parsed(dtype=np.float64)
        except ValueError:
            caught.clear()
            frame = parsed(low_memory=False)
    rows = [int(n) for w in caught for n in _SKIPPED.findall(str(w.message))]
    return frame, [_malformed(rows)] if rows else []


def _malformed(lines: list[int]) -> Finding:
    return Finding(
        "malformed row",
        "error",
        len(lines),
        f"line {lines[0]} of the table",
        f"{len(lines)} {'row has' if len(lines) == 1 else 'rows have'} more cells than the table "
        "has columns, and could not be read.",
    )


def _numbers(column: pd.Series[Any], name: str) -> tuple[np.ndarray[Any, Any], list[Finding]]:
    """Numbers of a column, NaN where a text stands among them; a column of texts as it is."""
    if column.dtype.kind in "iuf":
        return column.to_numpy(dtype=np.float64), []
    import pandas as pd

    numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64)
    texts = np.flatnonzero(np.isnan(numbers) & column.notna().to_numpy())
    if 2 * texts.size > numbers.size:
        return column.to_numpy(dtype=object), []
    if not texts.size:
        return numbers, []
    first = int(texts[0])
    return numbers, [
        Finding(
            "text in numbers",
            "warning",
            texts.size,
            f"{name}, row {first}",
            f"{texts.size} of {numbers.size} cells of '{name}' hold text, the first '"
            f"{column.iloc[first]}' in row {first}; they were read as missing.",
        )
    ]
