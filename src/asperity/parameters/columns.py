"""Tables of a laboratory: a CSV whose headings carry units, as ``K (N/m)`` or ``V [um/s]``.

As spreadsheets of any language save it: commas, semicolons or tabs between cells, decimal points or
commas, UTF-8, UTF-16 or the Windows code page 1252, and units in the headings or in a row below.
"""

from __future__ import annotations

import codecs
import csv
import io
import itertools
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from asperity.errors import Argument, InputError, known_as, require
from asperity.parameters.toml_file import file_content
from asperity.units.kinds import shown

_DELIMITERS = (",", ";", "\t")
#: Bytes that are decoded at a time.
_BLOCK = 1 << 20
#: A name and its unit.
_HEADING = re.compile(r"\s*(\w+)\s*(?:[(\[](.*)[)\]])?\s*", re.S)
_WITH_COMMA = re.compile(r"\s*[+-]?(?:\d+,\d*|,\d+)(?:[eE][+-]?\d+)?\s*")
_WITH_POINT = re.compile(r"\s*[+-]?(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?\s*")
#: Units of pure numbers.
_NO_UNIT = ("", "-", "\u2013")


def read_headed_columns(
    path: Path,
    numbers: Collection[str],
    *,
    texts: Collection[str] = (),
    label: str = "data",
    row: str = "a row",
) -> dict[str, list[float | str]]:
    """Columns of a CSV by name.

    Parameters
    ----------
    path : Path
        As of `sheet`.
    numbers, texts : collection of str
        Columns that are read; others are left out.
    label : str
        Name of the argument in messages.
    row : str
        Meaning of a row, such as ``"a hold"``.

    Returns
    -------
    dict
        Numbers; under a heading with a unit, texts of the number with the unit.

    Raises
    ------
    InputError
        If the file cannot be read, has no rows, a column twice, a row with more cells than the
        heading, or a cell that is no number.
    """
    with readable(path, label):
        content = file_content(path)
    table = sheet(path, set(numbers).__contains__, label=label, content=content)
    cells = [[cell.strip() for cell in row] for row in table.rows()]
    for n, cells_of_row in enumerate(cells, 1):
        # Spreadsheets leave separators behind the last column.
        surplus = any(cells_of_row[len(table.heading) :])
        rule, got = "have as many cells as the heading", f"{len(cells_of_row)} in row {n}"
        advice = "write numbers without a thousands separator, and quote a cell that holds a comma"
        require(not surplus, path.name, rule, got, advice)
    rule = f"have a heading and {row} a row"
    require(cells, path.name, rule, "no rows", "add them")
    columns: dict[str, list[float | str]] = {}
    for name, (place, unit) in headings(
        table.heading, path.name, {*numbers, *texts}.__contains__
    ).items():
        column = [row[place] if place < len(row) else "" for row in cells]
        columns[name] = [
            cell if name in texts else _number(cell, name, unit, f"{path.name}, row {n}")
            for n, cell in enumerate(column, 1)
        ]
    return columns


@dataclass(frozen=True)
class Sheet:
    """A CSV file and its dialect.

    Attributes
    ----------
    path : Path
    source : Path or bytes
        The file, or its content.
    label : str
        Name of the argument in messages.
    encoding : str
    delimiter : str
    decimal_comma : bool
        Whether numbers have decimal commas; `rows` replaces them by points.
    heading : list of str
        Cells of the heading, with the unit of the row of units in each.
    units_below : bool
        Whether there is a row of units below the heading; `rows` leaves it out.
    """

    path: Path
    source: Path | bytes
    label: str
    encoding: str
    delimiter: str
    decimal_comma: bool
    heading: list[str]
    units_below: bool

    def rows(self) -> Iterator[list[str]]:
        """Rows below the heading, without blank lines and lines that begin with ``#``.

        Raises
        ------
        InputError
            If the file cannot be read, or a quotation mark is missing: all rows after it would be
            one cell.
        """
        with readable(self.path, self.label):
            rows = _rows(self.source, self.encoding, self.delimiter)
            for row in itertools.islice(rows, 1 + self.units_below, None):
                yield [_with_point(cell) for cell in row] if self.decimal_comma else row


def sheet(
    path: Path,
    is_number: Callable[[str], object],
    *,
    label: str = "data",
    content: bytes | None = None,
) -> Sheet:
    """The dialect of a CSV file, from its whole content.

    The delimiter is the one of ``,``, ``;`` and tab that gives the heading the most cells. Numbers
    have decimal commas if a cell is such a number and no cell has a decimal point: ``1,234`` next
    to ``0.5`` may be a thousand, and is then no number. The row below the heading has units if none
    of its columns of numbers has a number there and one of them has a text.

    Parameters
    ----------
    path : Path
    is_number : callable
        Whether a column of this name has numbers.
    label : str
        Name of the argument in messages.
    content : bytes, optional
        Content of the file, if it has been read already.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    source = path if content is None else content
    with readable(path, label):
        encoding = _encoding(source)
        delimiter = _delimiter(source, encoding)
        rows = _rows(source, encoding, delimiter)
        heading, first = next(rows, []), next(rows, [])
        commas = False
        if delimiter != ",":
            for cell in itertools.chain(first, itertools.chain.from_iterable(rows)):
                if "," in cell and _WITH_COMMA.fullmatch(cell):
                    commas = True
                elif "." in cell and _WITH_POINT.fullmatch(cell):
                    commas = False
                    break
    units = _units_below(heading, first, is_number)
    if units:
        heading = [
            f"{name} ({units[place]})" if units.get(place) else name
            for place, name in enumerate(heading)
        ]
    return Sheet(path, source, label, encoding, delimiter, commas, heading, bool(units))


def _opened(source: Path | bytes) -> BinaryIO:
    return io.BytesIO(source) if isinstance(source, bytes) else source.open("rb")


def marked_encoding(beginning: bytes) -> str:
    """UTF-16 if a text begins with its byte-order mark, else UTF-8 with or without a mark."""
    marks = codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE
    return "utf-16" if beginning.startswith(marks) else "utf-8-sig"


def _encoding(source: Path | bytes) -> str:
    """Encoding of a text: UTF-16 by its mark, else UTF-8 if valid, else Windows code page 1252."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    with _opened(source) as file:
        block = file.read(_BLOCK)
        if (encoding := marked_encoding(block)) == "utf-16":
            return encoding
        if b"\0" in block:
            raise UnicodeError
        try:
            while block:
                decoder.decode(block)
                block = file.read(_BLOCK)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return "cp1252"
    return encoding


def _delimiter(source: Path | bytes, encoding: str) -> str:
    lines = _lines(source, encoding)
    heading = next((x for x in lines if x.strip() and not x.lstrip().startswith("#")), "")
    return max(_DELIMITERS, key=lambda d: len(next(csv.reader([heading], delimiter=d), [])))


def _rows(source: Path | bytes, encoding: str, delimiter: str) -> Iterator[list[str]]:
    """The heading and the rows, without blank lines and comments."""
    for row in csv.reader(_lines(source, encoding), delimiter=delimiter, strict=True):
        if row and row != [""] and not row[0].lstrip().startswith("#"):
            yield row


def _lines(source: Path | bytes, encoding: str) -> Iterator[str]:
    with io.TextIOWrapper(_opened(source), encoding, newline="") as text:
        yield from text


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if "," in cell and _WITH_COMMA.fullmatch(cell) else cell


def _units_below(
    heading: list[str], row: list[str], is_number: Callable[[str], object]
) -> dict[int, str]:
    """Units of the columns of numbers by position; empty if the row is no row of units."""
    units = {}
    for place, (name, cell) in enumerate(zip(heading, row, strict=False)):
        match, unit = _HEADING.fullmatch(name), cell.strip()
        if not match or not is_number(match[1]):
            continue
        if match[2] is not None or _is_number(unit):
            return {}
        units[place] = _unit(unit.strip("()[]"))
    return units if any(units.values()) else {}


def _unit(text: str) -> str:
    return "" if text.strip() in _NO_UNIT else text


def _is_number(cell: str) -> bool:
    try:
        float(_with_point(cell))
    except ValueError:
        return False
    return True


def headings(
    cells: Iterable[str], label: str, known: Callable[[str], object]
) -> dict[str, tuple[int, str]]:
    """Position and unit of each column by its name; the unit is empty if the heading has none.

    Parameters
    ----------
    cells : iterable of str
        Cells of the heading.
    label : str
        Name of the table in messages.
    known : callable
        Whether a column of this name is read; the others are left out.

    Raises
    ------
    InputError
        If one of these columns occurs twice.
    """
    columns: dict[str, tuple[int, str]] = {}
    for place, cell in enumerate(cells):
        match = _HEADING.fullmatch(cell)
        name, unit = (match[1], _unit(match[2] or "")) if match else (cell.strip(), "")
        if name and known(name):
            once, got = name not in columns, f"'{name}' twice"
            require(once, label, "have each column once", got, "remove or rename one of them")
            columns[name] = place, unit
    return columns


@contextmanager
def readable(path: Path, label: str, what: str = "CSV") -> Iterator[None]:
    """Raise an `InputError` about the argument `label` where a CSV, or `what`, cannot be read."""
    try:
        yield
    except (OSError, UnicodeError, csv.Error) as error:
        why = (getattr(error, "strerror", None) or "").lower() or "it is no text"
        if isinstance(error, csv.Error):
            why = f"{error}, check the quotation marks"
        rule, got = f"be a {what} that can be read", f"'{known_as(path)}': {why}"
        raise InputError(Argument(label), rule, got, "correct the path or the file") from None


def cell_number(cell: str) -> float:
    """The number in a cell.

    Raises
    ------
    ValueError
        If the cell has no number. Python would read "1_5", a damaged "1.5", as 15.
    """
    if "_" in cell:
        raise ValueError(cell)
    return float(cell)


def _number(cell: str, name: str, unit: str, where: str) -> float | str:
    try:
        number = cell_number(cell)
    except ValueError:
        advice = "correct the cell, and write the unit into the heading"
        raise InputError(where, f"have a number in column {name}", shown(cell), advice) from None
    return f"{number!r} {unit}" if unit else number
