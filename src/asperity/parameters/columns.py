"""Tables of a laboratory: a CSV whose headings carry units, as ``K (N/m)`` or ``V [um/s]``."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from asperity.errors import Argument, InputError, require
from asperity.parameters.toml_file import file_content

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
        Separated by commas or semicolons; lines that begin with ``#`` are skipped.
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
        text = file_content(path).decode("utf-8-sig")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    separator = ";" if lines and ";" in lines[0] and "," not in lines[0] else ","
    rows = [[cell.strip() for cell in cells] for cells in csv.reader(lines, delimiter=separator)]
    rule = f"have a heading and {row} a row"
    require(len(rows) >= 2, path.name, rule, f"{len(rows)} lines", "add them")
    columns: dict[str, list[float | str]] = {}
    for place, heading in enumerate(rows[0]):
        match = _HEADING.fullmatch(heading)
        if match is None or match[1] not in {*numbers, *texts}:
            continue
        name, unit = match[1], match[2] or ""
        rule = f"have one column for {name}"
        require(name not in columns, path.name, rule, "two", "remove one of them")
        cells = [cells[place] if place < len(cells) else "" for cells in rows[1:]]
        columns[name] = [
            cell if name in texts else _number(cell, name, unit, f"{path.name}, row {n}")
            for n, cell in enumerate(cells, 1)
        ]
    return columns


@contextmanager
def readable(path: Path, label: str) -> Iterator[None]:
    """Raise an `InputError` about the argument `label` where a CSV cannot be read."""
    try:
        yield
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = (getattr(error, "strerror", None) or "").lower() or "not UTF-8 text"
        if isinstance(error, csv.Error):
            why = f"{error}, check the quotation marks"
        rule, got = "be a CSV that can be read", f"'{path}': {why}"
        raise InputError(Argument(label), rule, got, "correct the path or the file") from None


def _number(cell: str, name: str, unit: str, where: str) -> float | str:
    try:
        number = float(cell)
    except ValueError:
        advice = "correct the cell, and write the unit into the heading"
        raise InputError(where, f"have a number in column {name}", f"'{cell}'", advice) from None
    return f"{number!r} {unit}" if unit else number
