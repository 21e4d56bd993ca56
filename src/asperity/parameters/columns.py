"""Tables of a laboratory: a CSV whose headings carry units, as ``K (N/m)`` or ``V [um/s]``."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from asperity.errors import Argument, InputError, require
from asperity.parameters.toml_file import file_content

_DELIMITERS = (",", ";", "\t")
#: A name and its unit.
_HEADING = re.compile(r"\s*(\w+)\s*(?:[(\[]([^)\]]*)[)\]])?\s*")


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
        As in `csv_rows`.
    numbers, texts : collection of str
        Columns that are read; others are left out.
    label : str
        What messages call the argument.
    row : str
        What a row is, such as ``"a hold"``.

    Returns
    -------
    dict
        Numbers of a heading with a unit are texts with that unit.

    Raises
    ------
    InputError
        If the file cannot be read, has no rows, a column twice, or a cell that is no number.
    """
    with readable(path, label):
        _, rows = csv_rows(file_content(path).decode("utf-8-sig").splitlines(keepends=True))
        heading, *cells = [[cell.strip() for cell in cells] for cells in rows] or [[]]
    rule = f"have a heading and {row} a row"
    require(cells, path.name, rule, "no rows", "add them")
    columns: dict[str, list[float | str]] = {}
    for name, (place, unit) in headings(
        heading, path.name, {*numbers, *texts}.__contains__
    ).items():
        column = [row[place] if place < len(row) else "" for row in cells]
        columns[name] = [
            cell if name in texts else _number(cell, name, unit, f"{path.name}, row {n}")
            for n, cell in enumerate(column, 1)
        ]
    return columns


def csv_rows(lines: Iterable[str]) -> tuple[str, Iterator[list[str]]]:
    """Delimiter and rows of a CSV, the heading first.

    Blank lines and lines that begin with ``#`` are skipped. The delimiter is the one of ``,``,
    ``;`` and tab that gives the heading the most cells. A missing quotation mark, which would merge
    the rows after it into one cell, is a `csv.Error`.
    """
    lines = iter(lines)
    heading = next((x for x in lines if x.strip() and not x.lstrip().startswith("#")), "")
    delimiter = max(_DELIMITERS, key=lambda d: len(next(csv.reader([heading], delimiter=d), [])))
    rows = csv.reader(itertools.chain([heading], lines), delimiter=delimiter, strict=True)
    return delimiter, (
        row for row in rows if row and row != [""] and not row[0].lstrip().startswith("#")
    )


def headings(
    cells: Iterable[str], label: str, known: Callable[[str], object]
) -> dict[str, tuple[int, str]]:
    """Place and unit of each column by its name; the unit is empty where the heading has none.

    Parameters
    ----------
    cells : iterable of str
        Cells of the heading.
    label : str
        What messages call the table.
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
        name, unit = (match[1], match[2] or "") if match else (cell.strip(), "")
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
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = (getattr(error, "strerror", None) or "").lower() or "not UTF-8 text"
        if isinstance(error, csv.Error):
            why = f"{error}, check the quotation marks"
        rule, got = f"be a {what} that can be read", f"'{path}': {why}"
        raise InputError(Argument(label), rule, got, "correct the path or the file") from None


def _number(cell: str, name: str, unit: str, where: str) -> float | str:
    try:
        number = float(cell)
    except ValueError:
        advice = "correct the cell, and write the unit into the heading"
        raise InputError(where, f"have a number in column {name}", f"'{cell}'", advice) from None
    return f"{number!r} {unit}" if unit else number
