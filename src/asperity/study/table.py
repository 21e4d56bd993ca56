"""Tables of operating points: each row of the input is a point; the output adds its response.

Input columns are SI numbers without units, named ``law, A, B, D0, mu0, V0, K, M, W0, alpha,
lambda, V, epsilon, frequency``, and the further parameters of registered laws. The output has the
input columns unchanged, followed by `asperity.parameters.RESULT_COLUMNS`. For a row that cannot be
solved ``result`` gives the reason; the other rows are solved. Rows are read, solved and written in
chunks, so that memory does not grow with the table.
"""

from __future__ import annotations

import csv
import difflib
import hashlib
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.laws import Law, get_law
from asperity.operating_point import known_parameters, without_mass
from asperity.outputs import UnfinishedText, output_file
from asperity.outputs.targets import require_rereadable
from asperity.parameters import RESULT_COLUMNS, Parameter, point_parameters, required
from asperity.study.engine import solve_here
from asperity.study.outcome import Answers
from asperity.study.responses import answers_of_law

Row = list[str]

#: Rows of a chunk, the most that an interruption loses.
_CHUNK = 20_000
#: The result columns that hold numbers, and ``stable``.
_OUTPUTS = RESULT_COLUMNS[: RESULT_COLUMNS.index("converged")]
_DELIMITERS = (",", ";", "\t")
#: An unknown column whose name is more similar to a known one than this counts as misspelt.
_SIMILAR = 0.75


@dataclass(frozen=True)
class TableSummary:
    """Counts of a finished table.

    Attributes
    ----------
    rows, failed : int
        All rows, and those without a converged response.
    out : Path
    """

    rows: int
    failed: int
    out: Path


def run_table(
    source: Path,
    out: Path,
    *,
    law: str | None = None,
    filled: Mapping[str, float] | None = None,
    resume: bool = False,
    progress: Callable[[int, int], None] | None = None,
    block: int = _CHUNK,
) -> TableSummary:
    """Periodic response for every row of a CSV table.

    Parameters
    ----------
    source, out : Path
        `out` is written when all rows are done; until then finished chunks are in ``OUT.partial``.
    law : str, optional
        Law of the rows without a law.
    filled : mapping of str to float, optional
        SI numbers for missing columns and empty cells, by column name.
    resume : bool
        Whether to continue an interrupted table, if there is one.
    progress : callable, optional
        Called with the number of rows done so far and of all rows.
    block : int
        Number of rows of a chunk.

    Raises
    ------
    InputError
        If the table as a whole cannot be used or `out` cannot be written. A bad row raises no
        error; its column ``result`` has the reason.
    Interrupted
        On Ctrl-C.
    """
    filled = dict(filled or {})
    out = output_file(out, inputs={"table": source})
    table = _open_table(source, law, filled)
    output = UnfinishedText(out, {"table": table.digest, "law": law, "filled": filled})
    output.start(resume)
    chunks = table.blocks(block, skip=output.rows)

    def solve(start: int, stop: int, advance: Callable[[int], None]) -> None:
        rows, reasons = zip(
            *(_fit_width(row, len(table.header)) for row in next(chunks)), strict=True
        )
        answers, results = _solved(table, rows, list(reasons), law, filled, advance)
        header = None if start else [*table.header, *RESULT_COLUMNS]
        lines = [(*row, *cells) for row, cells in zip(rows, _cells(answers, results), strict=True)]
        output.append_rows(lines, table.delimiter, header, failed=answers.failed)

    with output.interruptible("rows", table.rows):
        solve_here(table.rows, block, solve, progress or (lambda done, total: None), output.rows)
        output.finish()
    return TableSummary(table.rows, int(output.progress["failed"]), out)


def _solved(
    table: TableSource,
    rows: Sequence[Row],
    reasons: list[str],
    law: str | None,
    filled: Mapping[str, float],
    advance: Callable[[int], None],
) -> tuple[Answers, list[str]]:
    """Answers of rows, and the column ``result``; rows that have a reason are not solved."""
    answers = Answers.empty(_OUTPUTS, len(rows))
    advance(sum(bool(reason) for reason in reasons))
    for name, members in _by_law(rows, table.columns.get("law"), law, reasons).items():
        try:
            kind = get_law(name)
            values, refused = _read_numbers([rows[i] for i in members], kind, table.columns, filled)
        except InputError as error:
            refused = [str(error)] * len(members)
        for i, reason in zip(members, refused, strict=True):
            reasons[i] = reason
        advance(sum(bool(reason) for reason in refused))
        sound = np.array([k for k, reason in enumerate(refused) if not reason], dtype=np.intp)
        if len(sound):
            valid = {n: v[sound] for n, v in values.items()}
            answers.put(members[sound], answers_of_law(kind, valid, _OUTPUTS, advance))
    results = [reason or str(text) for reason, text in zip(reasons, answers.result, strict=True)]
    return answers, results


def _by_law(
    rows: Sequence[Row], place: int | None, law: str | None, reasons: Sequence[str]
) -> dict[str, np.ndarray]:
    """Indices of the rows without a reason, by law."""
    members: dict[str, list[int]] = {}
    for i, row in enumerate(rows):
        if not reasons[i]:
            written = "" if place is None else row[place].strip()
            members.setdefault(written or law or "", []).append(i)
    return {name: np.array(index, dtype=np.intp) for name, index in members.items()}


def _cells(answers: Answers, results: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Result cells of each row; the numbers of a failed row are empty."""
    converged = answers.converged
    *columns, stable = (answers[name] for name in _OUTPUTS)
    numbers = np.array(columns).astype(object)
    numbers[:, ~converged] = ""
    flags = ((converged & (stable > 0)).tolist(), converged.tolist())
    return zip(*numbers.tolist(), *flags, results, strict=True)


# The file


@dataclass(frozen=True)
class TableSource:
    """A checked table.

    Attributes
    ----------
    path : Path
    delimiter : str
    header : list of str
        As read.
    columns : mapping of str to int
        Position of every known column.
    rows : int
        Number of rows of data, without blank lines.
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
    """Contents of the columns, from a first pass over all rows."""

    rows: int = 0
    laws: set[str] = field(default_factory=set)
    numeric: set[str] = field(default_factory=set)
    first_text: dict[str, tuple[str, int]] = field(default_factory=dict)


def _open_table(path: Path, law: str | None, filled: Mapping[str, object]) -> TableSource:
    """Read a table once and check the file as a whole.

    Parameters
    ----------
    path : Path
    law : str or None
        Law of the rows without a law.
    filled : mapping
        Numbers that need no column, by name.

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
    """The table as text; errors of reading are raised as `InputError`."""
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
                f"did you mean '{meant}'? If not, rename the column"
            )
    return {name: place for place, name in enumerate(names) if name in known}


def _nearest(name: str, known: set[str]) -> str | None:
    """The known column whose name is similar to an unknown name; None without one."""
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
        # Columns that have shown a number are not examined further, for speed.
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
            f"{path} must name the law of its rows, got no column 'law'; add it or give --law"
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


# Rows to numbers


def _fit_width(row: Row, width: int) -> tuple[Row, str]:
    """The row with as many cells as the header, and the reason if it cannot be used."""
    if len(row) == width:
        return row, ""
    kept = (row + [""] * width)[:width]
    # Spreadsheets leave separators behind the last column.
    if len(row) > width and not any(cell.strip() for cell in row[width:]):
        return kept, ""
    return kept, (
        f"row must have as many cells as the header, got {len(row)} instead of {width}; "
        "correct the separators, and quote a cell that holds one"
    )


def _read_numbers(
    rows: Sequence[Row], law: type[Law], columns: Mapping[str, int], filled: Mapping[str, float]
) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    """Numbers of the rows for one law.

    Parameters
    ----------
    rows : sequence of rows
    law : type of Law
    columns : mapping of str to int
        Position of every known column.
    filled : mapping of str to float
        SI numbers for missing columns and empty cells.

    Returns
    -------
    values : dict of str to array, shape (rows,)
        SI; undefined for a row with a reason.
    reasons : list of str
        Why a row cannot be solved; empty for the other rows.
    """
    reasons = [""] * len(rows)
    values = {}
    for name, parameter in point_parameters(law).items():
        place = columns.get(name)
        default = math.nan if parameter.default is None else parameter.default
        fill = filled.get(name, default)
        if place is None:
            numbers = np.full(len(rows), fill)
        else:
            numbers = _parsed([row[place] for row in rows], name, parameter, fill, reasons)
        absent = np.isnan(numbers)
        if name in required(law):
            for i in np.flatnonzero(absent):
                reasons[i] = reasons[i] or (
                    f"{law.name} must have {name}, got an empty cell; fill it in or name a "
                    "material that has it"
                )
        _check(numbers, ~absent, parameter, reasons)
        values[name] = numbers
    for i in np.flatnonzero(without_mass(values)):
        reasons[i] = reasons[i] or (
            "M must be positive where inertia is 1, got 0; fill it in or name a material with it"
        )
    if not law.rate_dependent:
        for i in np.flatnonzero((values["inertia"] > 0) | (values["eta"] > 0)):
            reasons[i] = reasons[i] or (
                f"law must depend on the velocity where inertia or eta counts, got {law.name}; "
                "leave both cells empty or choose another law"
            )
    return values, reasons


def _parsed(
    cells: Sequence[str], name: str, parameter: Parameter, fill: float, reasons: list[str]
) -> NDArray[np.float64]:
    """Numbers of a column, `fill` for empty cells; NaN where a cell has no number."""
    try:
        numbers = np.fromiter(map(float, cells), float, len(cells))
        if np.isfinite(numbers).all():
            return numbers
    except ValueError:
        pass
    return np.array(
        [_number(cell, name, parameter, fill, reasons, i) for i, cell in enumerate(cells)]
    )


def _number(
    cell: str, name: str, parameter: Parameter, fill: float, reasons: list[str], i: int
) -> float:
    text = cell.strip()
    if not text:
        return fill
    try:
        number = parameter.words[text.lower()] if text.lower() in parameter.words else float(text)
    except ValueError:
        number = math.nan
    if math.isfinite(number):
        return number
    unit = f" in {parameter.unit}" if parameter.unit else ""
    reasons[i] = reasons[i] or (
        f"{name} must be a finite number{unit}, got '{text}'; write it without unit, with a "
        "decimal point"
    )
    return math.nan


def _check(
    numbers: NDArray[np.float64],
    present: NDArray[np.bool_],
    parameter: Parameter,
    reasons: list[str],
) -> None:
    """Check the rule of a parameter; a row that breaks the rule gets the reason."""
    try:
        parameter.check(numbers[present])
        return
    except InputError:
        pass
    for i in np.flatnonzero(present):
        try:
            parameter.check(float(numbers[i]), parameter.name)
        except InputError as error:
            reasons[i] = reasons[i] or str(error)
