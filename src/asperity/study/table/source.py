"""Reading a table: checks of the whole file first, then block by block."""

from __future__ import annotations

import csv
import difflib
import hashlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TextIO

from asperity.errors import InputError
from asperity.laws import get_law
from asperity.operating_point import known_parameters
from asperity.outputs.targets import require_rereadable
from asperity.parameters import RESULT_COLUMNS, required
from asperity.study.table.cells import Row

_DELIMITERS = (",", ";", "\t")
#: Similarity above which a name is a misspelling and not a column of the user's own.
_SIMILAR = 0.75


@dataclass(frozen=True)
class TableSource:
    """A table that can be solved.

    Attributes
    ----------
    path : Path
    delimiter : str
    header : list of str
        As read.
    columns : mapping of str to int
        Position of every known column.
    rows : int
        Rows of data; blank lines are none.
    digest : str
        SHA-256 of the file.
    """

    path: Path
    delimiter: str
    header: Row
    columns: Mapping[str, int]
    rows: int
    digest: str

    def blocks(self, size: int, skip: int = 0) -> Iterator[list[Row]]:
        """Rows of data in lists of at most `size`, without the first `skip`."""
        with _opened(self.path) as stream:
            rows = islice(_rows(stream, self.delimiter), 1 + skip, None)
            while block := list(islice(rows, size)):
                yield block


@dataclass
class _ColumnContents:
    """Contents of the columns, from a first reading of all rows."""

    rows: int = 0
    laws: set[str] = field(default_factory=set)
    numeric: set[str] = field(default_factory=set)
    first_text: dict[str, tuple[str, int]] = field(default_factory=dict)


def open_table(path: Path, law: str | None, filled: Mapping[str, object]) -> TableSource:
    """Read a table once and check the file as a whole.

    Parameters
    ----------
    path : Path
    law : str or None
        Law of the rows that name none.
    filled : mapping
        Names of the numbers that need no column.

    Raises
    ------
    InputError
        If the table cannot be read, has no rows, or has a column that is missing or
        unusable in every row.
    """
    with _opened(path) as stream:
        delimiter = _delimiter(stream.readline())
        stream.seek(0)
        rows = _rows(stream, delimiter)
        header = next(rows, [])
        if not any(name.strip() for name in header):
            raise InputError(
                f"{path} must have a line of column names and rows, got an empty file; "
                "give one operating point a row"
            )
        columns = _checked_header(header, str(path))
        contents = _column_contents(rows, columns, law)
    if not contents.rows:
        raise InputError(
            f"{path} must have rows of data, got only column names; give one operating point a row"
        )
    _check_columns(path, columns, contents, filled)
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return TableSource(path, delimiter, header, columns, contents.rows, digest)


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    """The table as text; any failure to read it becomes an `InputError`."""
    require_rereadable(path, "table")
    try:
        # utf-8-sig: spreadsheets put a byte-order mark in front.
        with path.open(encoding="utf-8-sig", newline="") as stream:
            yield stream
    except FileNotFoundError:
        raise InputError(
            f"table must be a file, got '{path}'; there is none, correct the path"
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path} must be UTF-8 text, got the byte 0x{error.object[error.start]:02x}; "
            "save the table as CSV in UTF-8"
        ) from None
    except csv.Error as error:
        raise InputError(
            f"{path} must be valid CSV, got a fault ({error}); check the quotation marks"
        ) from None
    except OSError as error:
        raise InputError(
            f"table must be a readable file, got '{path}' ({error.strerror or error}); "
            "give a CSV file"
        ) from None


def _rows(stream: TextIO, delimiter: str) -> Iterator[Row]:
    # Strict: without it a missing quotation mark would merge the rows after it into one cell.
    return (row for row in csv.reader(stream, delimiter=delimiter, strict=True) if row)


def _delimiter(line: str) -> str:
    """The delimiter that gives the most known columns in the first line; a comma by default."""
    known = {"law", *known_parameters()}

    def count(delimiter: str) -> int:
        names = next(csv.reader([line], delimiter=delimiter), [])
        return sum(name.strip() in known for name in names)

    return max(_DELIMITERS, key=count)


def _checked_header(header: Sequence[str], shown: str) -> dict[str, int]:
    """Position of every known column.

    Parameters
    ----------
    header : sequence of str
        As read; blanks around a name are ignored.
    shown : str
        Name of the table in messages.

    Raises
    ------
    InputError
        If a column occurs twice, is named like a result, or looks like a misspelt known one.
    """
    names = [name.strip() for name in header]
    known = {"law", *known_parameters()}
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"{shown} must have each column once, got '{name}' {names.count(name)} times; "
                "remove or rename all but one"
            )
        if name in RESULT_COLUMNS:
            raise InputError(
                f"{shown} must not have a column named like a result, got '{name}'; "
                "rename or remove it"
            )
        meant = None if name in known else _nearest(name, known)
        if meant:
            raise InputError(
                f"{shown} must have columns of known names, got '{name}'; "
                f"did you mean '{meant}'? Rename a column of your own that is not meant so"
            )
    return {name: place for place, name in enumerate(names) if name in known}


def _nearest(name: str, known: set[str]) -> str | None:
    """The known column that resembles an unknown one, None if there is none."""
    # 'V (m/s)' and 'D0 [m]' carry the name before the unit.
    bare = re.split(r"[\s(\[]", name.lower(), maxsplit=1)[0].rstrip("_")
    if not bare:
        return None
    for parameter in known_parameters().values():
        if bare in parameter.meant or bare in map(str.lower, parameter.aliases):
            return parameter.name
    lowered = {k.lower(): k for k in sorted(known)}
    if bare in lowered:
        return lowered[bare]
    begun = [k for k in lowered if k.startswith(bare) and (len(bare) > 2 or len(k) < 4)]
    near = begun or difflib.get_close_matches(bare, lowered, n=1, cutoff=_SIMILAR)
    return lowered[near[0]] if near else None


def _column_contents(
    rows: Iterator[Row], columns: Mapping[str, int], law: str | None
) -> _ColumnContents:
    contents = _ColumnContents()
    without_number = {name: place for name, place in columns.items() if name != "law"}
    law_place = columns.get("law", -1)
    for row in rows:
        contents.rows += 1
        written = row[law_place].strip() if 0 <= law_place < len(row) else ""
        contents.laws.add(written or law or "")
        # Only columns without a number so far are examined: a long table is read at full speed.
        for name in [n for n, place in without_number.items() if place < len(row)]:
            text = row[without_number[name]].strip()
            if _is_number(text):
                contents.numeric.add(name)
                del without_number[name]
            elif text:
                contents.first_text.setdefault(name, (text, contents.rows))
    return contents


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _check_columns(
    path: Path, columns: Mapping[str, int], contents: _ColumnContents, filled: Mapping[str, object]
) -> None:
    """Refuse a table in which no row can be solved because a required column is missing."""
    if contents.laws == {""}:
        raise InputError(
            f"{path} must say the law of its rows, got no column 'law'; add it or give --law"
        )
    needs = [set(required(get_law(name))) for name in contents.laws if _known_law(name)]
    if not needs:
        get_law(min(contents.laws - {""}))
    everywhere = set.intersection(*needs)
    for name in columns:
        if name in everywhere and name not in contents.numeric and name in contents.first_text:
            text, row = contents.first_text[name]
            raise InputError(
                f"{path} must have finite numbers in column '{name}', got '{text}' in row {row} "
                "and none in any other; write SI numbers without units"
            )
    missing = [
        n for n in known_parameters() if n in everywhere - contents.numeric and n not in filled
    ]
    if missing:
        raise InputError(
            f"{path} must have the columns that its laws need, got none for {', '.join(missing)}; "
            "add them or name a material that has them"
        )


def _known_law(name: str) -> bool:
    try:
        get_law(name)
    except InputError:
        return False
    return True
