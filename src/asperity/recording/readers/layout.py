"""Layout of a table of text: delimiter, decimal mark, headings, and the first row of numbers."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path

from asperity.errors import Argument, InputError, require
from asperity.recording.readers.raw import unusable
from asperity.recording.readers.units import is_empty, usual
from asperity.recording.roles import ROLES, candidates

#: Pairs of delimiter and decimal mark, in order of preference.
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
#: Signs that begin a comment.
COMMENTS = ("#", "%", "!", "//")
#: Cells without a value, as recording programs write them.
MISSING = (
    "",
    "-",
    "--",
    "NaN",
    "nan",
    "NAN",
    "NA",
    "N/A",
    "n/a",
    "null",
    "None",
    "#N/A",
    "1.#QNAN",
)
_NUMBER = {
    mark: re.compile(
        rf"[+-]?(?:\d+(?:{re.escape(mark)}\d*)?|{re.escape(mark)}\d+)(?:[eE][+-]?\d+)?"
    )
    for mark in (".", ",")
}
#: A thousands separator is recognised only in numbers with decimals; else the mark is ambiguous.
_GROUPED = {
    mark: re.compile(rf"[+-]?\d{{1,3}}(?:{re.escape(other)}\d{{3}})+{re.escape(mark)}\d*")
    for mark, other in ((".", ","), (",", "."))
}
_ENDLESS = re.compile(r"[+-]?inf(?:inity)?", re.I)
_STAMP = re.compile(r"\d{1,4}[-/:.]\d{1,2}[-/:.]\d{1,4}(?:[T ]\d{1,2}:\d{2}.*|[.,]\d+)?")
_WORD = re.compile(
    r"(?<![^\W\d_])(?!nan\b|inf\b|na\b|none\b|null\b|[eEtTzZ]\b)[^\W\d_]+(?!\d)", re.I
)
_LINE = re.compile(rb"([^\r\n]*)(\r\n|\n|\r|\Z)")
_DELIMITERS = ("\t", ";", ",", "|", None)
_WIDE = re.compile(r"\s{2,}|\t")
#: Cells that are no names: numbers, and the counts of records that xlook writes.
_COUNT = re.compile(r"[-+\d.,eE]*\d[-+\d.,eE]*(\s*recs?)?")
_LONGEST_UNIT = 14
#: Number of lines above the table searched for names whose number differs from the columns'.
_LAST = 2
_WITH_UNIT = re.compile(r".*[\[({<]([^\[\](){}<>]*)[\])}>]\s*", re.S)
_TYPES = frozenset({"float", "float32", "float64", "double", "single", "real", "number", "int"})


@dataclass(frozen=True)
class TextLine:
    """A line of the head of a file.

    Attributes
    ----------
    text : str
        Without its end, one character a byte.
    start : int
        Offset of its first byte in the file.
    ended : bool
        Whether a line end follows.
    """

    text: str
    start: int
    ended: bool

    @property
    def blank(self) -> bool:
        """Whether the line is empty."""
        return not self.text.strip()

    @property
    def comment(self) -> str:
        """The sign that begins a comment; empty for another line."""
        bare = self.text.lstrip(' "')
        return next((sign for sign in COMMENTS if bare.startswith(sign)), "")


def lines_of(head: bytes, start: int) -> list[TextLine]:
    """Lines of `head`, which begins at byte `start` of its file."""
    lines = []
    for match in _LINE.finditer(head):
        if match[0]:
            ended = bool(match[2])
            lines.append(TextLine(match[1].decode("latin-1"), start + match.start(), ended))
    return lines


def _decoded(text: str) -> str:
    """Decode text of one character a byte: UTF-8, else the Windows code page 1252."""
    raw = text.encode("latin-1")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def cells_of(text: str, delimiter: str | None) -> list[str]:
    """Cells of a line, without quotes and blanks around them; `delimiter` None is blanks."""
    if delimiter is None:
        return [cell.strip('"') for cell in text.split()]
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)]
    row = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])
    return [cell.strip() for cell in row]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell holds a number written with this decimal mark."""
    number = _NUMBER[decimal].fullmatch(cell) or _ENDLESS.fullmatch(cell)
    return bool(number) or _is_grouped(cell, decimal)


def _is_grouped(cell: str, decimal: str) -> bool:
    """Whether a number has a thousands separator, the other mark."""
    return bool(_GROUPED[decimal].fullmatch(cell))


def _is_value(cell: str, decimal: str) -> bool:
    """Whether a cell fits a table of numbers: a number, an empty cell, or a date."""
    return is_number(cell, decimal) or cell in MISSING or bool(_STAMP.fullmatch(cell))


def digits(cell: str, decimal: str) -> tuple[int, int]:
    """Digits behind the decimal mark and in the exponent; (0, 0) if the cell is no number."""
    if not is_number(cell, decimal):
        return 0, 0
    mantissa, _, exponent = cell.lower().partition("e")
    return len(mantissa.partition(decimal)[2]), len(exponent.strip("+-"))


@dataclass(frozen=True)
class Headings:
    """Names and units of the columns of a text.

    Attributes
    ----------
    names : list of str
        One a column, as written, unit included; empty where the file has none.
    units : list of str or None
        The row of units, where there is one.
    step : float or None
        Interval (s) of LabVIEW's text, which may leave its column of times empty.
    names_in_file : int or None
        Names in the file, where they are more or fewer than its columns; the first columns have
        the first names then.
    """

    names: list[str]
    units: list[str] | None
    step: float | None = None
    names_in_file: int | None = None


def _headings(
    above: Sequence[TextLine], delimiter: str | None, width: int, counted: bool
) -> Headings:
    """Headings among the lines above the first row of numbers.

    The last lines with as many cells as the table are taken, lines of comment only where no other
    line fits. Next to a row of names and a row of units there may be a row of descriptions.

    Parameters
    ----------
    above : sequence of TextLine
    delimiter : str or None
    width : int
        Columns of the table.
    counted : bool
        Whether the first column counts the rows, and needs no name.
    """
    plain = [line.text for line in above if not line.comment and not line.blank]
    rows = _fitting(plain, (delimiter,), width, counted)
    if not rows:
        bare = [line.text.strip().strip('"').lstrip("#%!/ ") for line in above if line.comment]
        rows = _fitting(bare, (delimiter, *_DELIMITERS), width, counted)
    step = next((_interval(row) for row in rows if row[0] == "Delta_X"), None)
    rows = [row for row in rows if not _names_nothing(row)]
    if not rows:
        return Headings([""] * width, None)
    # LabVIEW's text has the units above the names, and time in seconds.
    labview = next((row[1:] for row in rows[:-1] if row[0] == "Y_Unit_Label"), None)
    if labview:
        return Headings(_bare(rows[-1]), ["s", *labview], step)
    for k in reversed(range(1, len(rows))):
        if _are_units(rows[k], rows[k - 1]):
            # Names stand right above their units, unless another row names more quantities.
            names = max([rows[k - 1], *rows[k - 2 : k - 1], *rows[k + 1 :]], key=_quantities)
            return Headings(_bare(names), rows[k])
    return Headings(_bare(rows[-1]), None, step)


def _names_of_another_width(
    above: Sequence[TextLine], delimiter: str | None, width: int
) -> Headings:
    """Names whose number differs from the number of columns, if a line is certainly names.

    This line is the last line of words, or the line above the row of units, and at least two of
    its names belong to a role or have a unit.
    """
    plain = [line.text for line in above if not line.comment and not line.blank]
    rows = []
    for text in plain[-_LAST:]:
        line = _decoded(text)
        cells = cells_of(line, delimiter) if delimiter else _WIDE.split(line.strip())
        while cells and not cells[-1].strip():
            cells.pop()
        rows.append([cell.strip('" ') for cell in cells])
    units: list[str] | None = None
    if len(rows) > 1 and len(rows[-1]) == len(rows[-2]) and _are_units(rows[-1], rows[-2]):
        units = rows.pop()
    names = _bare(rows[-1]) if rows else []
    if len(names) in (0, 1, width) or _names_nothing(names) or _quantities(names) < 2:
        return Headings([""] * width, None)
    missing = [""] * max(0, width - len(names))
    return Headings(
        [*names, *missing][:width],
        None if units is None else [*units, *missing][:width],
        None,
        len(names),
    )


def _quantities(row: Sequence[str]) -> int:
    """How many cells name a quantity."""
    return sum(map(names_a_quantity, row))


def names_a_quantity(cell: str) -> bool:
    """Whether a heading is the name of a role or holds a usual unit in brackets."""
    match = _WITH_UNIT.fullmatch(cell)
    if match and usual(match[1]):
        return True
    return any(candidates(role, {cell: None}) for role in ROLES)


def _names_nothing(row: Sequence[str]) -> bool:
    """Whether a row is of numbers, or of the types of the columns."""
    numbers = sum(bool(_COUNT.fullmatch(cell)) for cell in row)
    return 2 * numbers > len(row) or all(cell.lower() in _TYPES for cell in row)


def _bare(row: Sequence[str]) -> list[str]:
    return [cell[1:-1] if re.fullmatch("'.*'", cell) else cell for cell in row]


def _interval(row: Sequence[str]) -> float | None:
    try:
        step = float(row[1].replace(",", "."))
    except ValueError:
        return None
    return step if step > 0 else None


def _fitting(
    texts: Sequence[str], delimiters: Sequence[str | None], width: int, counted: bool
) -> list[list[str]]:
    """Rows of `width` cells, the first delimiter that gives them being used for each line."""
    rows = []
    for text in texts:
        for delimiter in delimiters:
            row = _row(_decoded(text), delimiter, width, counted)
            if row is not None:
                rows.append(row)
                break
    return rows


def _row(text: str, delimiter: str | None, width: int, counted: bool) -> list[str] | None:
    ways = [cells_of(text, delimiter)]
    if delimiter is None:
        # Names that contain blanks, above a table with blanks as delimiter.
        ways += [
            [cell.strip('" ') for cell in _WIDE.split(text.strip())],
            _quoted(text),
            _with_units(text.split()),
        ]
    for cells in ways:
        if len(cells) == width:
            return cells
        # LabVIEW has a column of comments, and omits its delimiter if there is no comment.
        if len(cells) == width + 1 and cells[-1].lower() in ("", "comment", "comments"):
            return cells[:-1]
    for cells in ways if counted else ():
        if len(cells) == width - 1 and width > 2 and all(cells):
            return ["row", *cells]
    return None


def _quoted(text: str) -> list[str]:
    return [a or b for a, b in re.findall(r'"([^"]*)"|(\S+)', text)]


def _with_units(tokens: list[str]) -> list[str]:
    """Words; a unit in brackets is joined to the name before it."""
    joined: list[str] = []
    for token in tokens:
        if joined and token[0] in "([{" and token[-1] in ")]}":
            joined[-1] += " " + token
        else:
            joined.append(token)
    return joined


def _are_units(row: Sequence[str], above: Sequence[str]) -> bool:
    """Whether a row holds units: at least a third of its cells do, and the names above do not."""
    known = sum(_is_unit(cell) for cell in row)
    short = all(len(cell) <= _LONGEST_UNIT for cell in row)
    return short and 3 * known >= len(row) and sum(map(_is_unit, above)) < known


def _is_unit(cell: str) -> bool:
    bracketed = re.fullmatch(r"[\[({<].*[\])}>]", cell.strip())
    return not is_empty(cell) and bool(usual(cell) or bracketed)


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
        Number of columns, without an empty one behind a delimiter at the end of the lines.
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
        Settings of the user.

    Raises
    ------
    InputError
        If the text has no table of numbers.
    """
    written = [line for line in lines if not line.blank and not line.comment]
    # The sample excludes headings and the last line, which may be cut.
    numeric = (line for line in reversed(written) if not _WORD.search(line.text))
    last = list(islice(numeric, _SAMPLE)) or written[-_SAMPLE:]
    sample = [line.text for line in last if line.ended] or [line.text for line in last]
    ways = _ways(delimiter, decimal)
    scored = [(_score(sample, *separators), separators) for separators in ways]
    # Blanks stand inside the dates of a table with tabs, too: of equal scores, a sign goes first.
    (score, width), separators = max(
        scored, key=lambda s: (s[0][0], s[1][0] is not None and s[0][1] > 1, s[0][1])
    )
    if not sample or score < 0.5:
        named = [Argument(name, value="...") for name in ("delimiter", "decimal")]
        advice = f"give {named[0]} and {named[1]}, or another file"
        raise unusable(path, "which has none that is understood", "hold a table of numbers", advice)
    rows = [cells_of(text, separators[0]) for text in sample]
    rows = [row for row in rows if len(row) == width]
    closed = width > 1 and separators[0] is not None and not any(row[-1] for row in rows)
    first = next(i for i, line in enumerate(lines) if _is_row(line, *separators, width, rows))
    # Words among the numbers of the first rows are missing values, as in later rows.
    while first and _has_words_among_numbers(lines[first - 1], *separators, width, rows):
        first -= 1
    above = lines[:first]
    counted = _count_rows([row[0] for row in rows])
    heads = _headings(above, separators[0], width - closed, counted)
    if closed and not any(heads.names):
        # A named column may be empty; one that the delimiter at the end makes has no name.
        wide = _headings(above, separators[0], width, counted)
        closed, heads = (False, wide) if any(wide.names) and wide.names[-1] else (closed, heads)
    if not any(heads.names):
        heads = _names_of_another_width(above, separators[0], width - closed)
    sign = next((line.comment for line in lines if line.comment), "")
    grouped = any(_is_grouped(cell, separators[1]) for row in rows for cell in row)
    longer = 0
    for line in reversed(above):
        cells = cells_of(line.text, separators[0])
        if len(cells) <= width or not all(is_number(cell, separators[1]) for cell in cells):
            break
        longer += 1
    return Layout(
        *separators, width - closed, closed, heads, lines[first].start, sign, rows, grouped, longer
    )


def _count_rows(cells: Sequence[str]) -> bool:
    """Whether the sampled cells of a column, last row first, count the rows."""
    if not all(cell.isdecimal() and len(cell) < 16 for cell in cells):
        return False
    numbers = [int(cell) for cell in cells]
    return len(numbers) > 1 and all(abs(a - b) == 1 for a, b in pairwise(numbers))


def _ways(delimiter: str | None, decimal: str | None) -> list[tuple[str | None, str]]:
    if decimal not in (None, ".", ","):
        raise InputError("read.decimal", "be '.' or ','", f"'{decimal}'", "give one of them")
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
    rule = "be one character or 'blank'"
    require(ways, "read.delimiter", rule, f"{delimiter!r}", "leave it out to have it recognised")
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
            good += sum(_is_value(cell, decimal) for cell in row) / width
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
    return all(_is_value(cell, decimal) for cell in _usually_numbers(cells, decimal, rows))


def _has_words_among_numbers(
    line: TextLine, delimiter: str | None, decimal: str, width: int, rows: Sequence[Sequence[str]]
) -> bool:
    """Whether a line above the first row is one too, with words in some columns of numbers.

    The first of these columns has a number there, as has at least half of them; no word is a unit.
    """
    cells = cells_of(line.text, delimiter)
    if line.blank or line.comment or len(cells) != width:
        return False
    cells = _usually_numbers(cells, decimal, rows)
    others = [cell for cell in cells if not is_number(cell, decimal)]
    begins = bool(cells) and is_number(cells[0], decimal) and 2 * len(others) <= len(cells)
    return begins and not any(map(usual, others))


def _usually_numbers(
    cells: Sequence[str], decimal: str, rows: Sequence[Sequence[str]]
) -> list[str]:
    """Cells of a line in the columns in which most of the sampled rows have numbers."""
    columns = zip(*rows, strict=True)
    usual = [sum(is_number(c, decimal) for c in column) * 2 > len(rows) for column in columns]
    return [cell for cell, is_usual in zip(cells, usual, strict=True) if is_usual]
