"""How a text lays out its table: delimiter, decimal mark, headings, and where the numbers begin."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path

from asperity.errors import InputError
from asperity.recording.readers.text.headings import Headings, headings, names_of_another_width
from asperity.recording.readers.text.lines import (
    MISSING,
    TextLine,
    cells_of,
    has_words,
    is_grouped,
    is_number,
    is_value,
)

#: Ways to divide a line and to mark the decimals, the first of equally good ones being taken.
_WAYS: tuple[tuple[str | None, str], ...] = (
    ("\t", "."),
    (";", "."),
    (";", ","),
    ("\t", ","),
    (",", "."),
    ("|", "."),
    (None, "."),
    (None, ","),
    # Decimal commas between commas need quotes.
    (",", ","),
)
#: Delimiters by their names, for command lines.
_NAMED = {"tab": "\t", "comma": ",", "semicolon": ";", "\\t": "\t"}
_SAMPLE = 40


@dataclass(frozen=True)
class Layout:
    """Layout of a table of text.

    Attributes
    ----------
    delimiter : str or None
        None where blanks divide the cells.
    decimal : str
        ``"."`` or ``","``.
    width : int
        Columns; an empty one behind a delimiter at the line's end does not count.
    closed : bool
        Whether every row ends with a delimiter.
    headings : Headings
        Names and units.
    start : int
        Offset in bytes of the first row.
    comment : str
        Sign of comments, empty where none was seen.
    sample : list of list of str
        Cells of some rows that have their line end; of the last if none has.
    grouped : bool
        Whether thousands are set apart.
    longer : int
        Rows of numbers with surplus cells right above the first row.
    """

    delimiter: str | None
    decimal: str
    width: int
    closed: bool
    headings: Headings
    start: int
    comment: str
    sample: list[list[str]]
    grouped: bool
    longer: int = 0


def layout_of(
    lines: Sequence[TextLine], path: Path, delimiter: str | None, decimal: str | None
) -> Layout:
    """Layout of a text from the lines of its head.

    Parameters
    ----------
    lines : sequence of TextLine
        Whole lines; the last may lack its end if it is the last of the file.
    path : Path
        For messages.
    delimiter, decimal : str or None
        What the user knows.

    Raises
    ------
    InputError
        If no table of numbers is found.
    """
    written = [line for line in lines if not line.blank and not line.comment]
    # Headings of a short file would outnumber its rows, and its last line may be cut.
    numeric = (line for line in reversed(written) if not has_words(line.text))
    last = list(islice(numeric, _SAMPLE)) or written[-_SAMPLE:]
    sample = [line.text for line in last if line.ended] or [line.text for line in last]
    ways = _ways(delimiter, decimal)
    scored = [(_score(sample, *way), way) for way in ways]
    (score, width), way = max(scored, key=lambda s: s[0])
    if not sample or score < 0.5:
        raise InputError(
            f"recording.path must hold a table of numbers, got '{path.name}' without one that is "
            "understood; say delimiter= and decimal=, or give a recording"
        )
    rows = [cells_of(text, way[0]) for text in sample]
    rows = [row for row in rows if len(row) == width]
    closed = width > 1 and way[0] is not None and not any(row[-1] for row in rows)
    first = next(i for i, line in enumerate(lines) if _is_row(line, *way, width, rows))
    above = lines[:first]
    counted = _count_rows([row[0] for row in rows])
    found = headings(above, way[0], width - closed, counted)
    if closed and not any(found.names):
        # A named column may be empty; one that the delimiter at the end makes has no name.
        wide = headings(above, way[0], width, counted)
        closed, found = (False, wide) if any(wide.names) and wide.names[-1] else (closed, found)
    if not any(found.names):
        found = names_of_another_width(above, way[0], width - closed)
    sign = next((line.comment for line in lines if line.comment), "")
    grouped = any(is_grouped(cell, way[1]) for row in rows for cell in row)
    longer = 0
    for line in reversed(above):
        cells = cells_of(line.text, way[0])
        if len(cells) <= width or not all(is_number(cell, way[1]) for cell in cells):
            break
        longer += 1
    return Layout(
        *way, width - closed, closed, found, lines[first].start, sign, rows, grouped, longer
    )


def _count_rows(cells: Sequence[str]) -> bool:
    """Whether the sampled cells of a column, last row first, count the rows."""
    if not all(cell.isdecimal() and len(cell) < 16 for cell in cells):
        return False
    numbers = [int(cell) for cell in cells]
    return len(numbers) > 1 and all(abs(a - b) == 1 for a, b in pairwise(numbers))


def _ways(delimiter: str | None, decimal: str | None) -> list[tuple[str | None, str]]:
    if decimal not in (None, ".", ","):
        raise InputError(f"read.decimal must be '.' or ',', got '{decimal}'; give one of them")
    wanted = (
        None if delimiter in (" ", "blank", "whitespace") else _NAMED.get(str(delimiter), delimiter)
    )
    ways = [
        (d, m)
        for d, m in _WAYS
        if (delimiter is None or d == wanted) and (decimal is None or m == decimal)
    ]
    if not ways and wanted is not None and len(wanted) == 1 and wanted.isprintable():
        ways = [(wanted, decimal or ".")]
    if not ways:
        raise InputError(
            f"read.delimiter must be one character or 'blank', got {delimiter!r}; leave it out to "
            "have it found"
        )
    return ways


def _score(sample: Sequence[str], delimiter: str | None, decimal: str) -> tuple[float, int]:
    """Share of cells that are values in rows of the usual width, and that width."""
    rows = [cells_of(text, delimiter) for text in sample]
    if not rows:
        return 0.0, 0
    width = Counter(map(len, rows)).most_common(1)[0][0]
    good = 0.0
    for row in rows:
        if len(row) == width and any(is_number(cell, decimal) for cell in row):
            good += sum(is_value(cell, decimal) for cell in row) / width
    return good / len(rows), width


def _is_row(
    line: TextLine, delimiter: str | None, decimal: str, width: int, rows: Sequence[Sequence[str]]
) -> bool:
    """Whether a line is a row of the table: numbers wherever the sampled rows have them."""
    if line.blank or line.comment:
        return False
    cells = cells_of(line.text, delimiter)
    numbers = any(is_number(cell, decimal) for cell in cells)
    if len(cells) != width or not (numbers or all(c and c in MISSING for c in cells)):
        return False
    columns = zip(*rows, strict=True)
    usual = [sum(is_number(c, decimal) for c in column) * 2 > len(rows) for column in columns]
    return all(
        is_value(cell, decimal) for cell, is_usual in zip(cells, usual, strict=True) if is_usual
    )
