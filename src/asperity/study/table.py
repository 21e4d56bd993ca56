"""Tables of operating points: each row of the input is a point; the output adds its response.

Input columns are SI numbers, or have their unit in the heading, as ``V (um/s)``. They are named
``law, A, B, D0, mu0, V0, K, M, W0, alpha, lambda, V, epsilon, frequency``, and as the further
parameters of registered laws, and ``eps_ratio``, the share of epsilon that the contacts carry where
it is the applied amplitude. The output has the input columns, decimal commas written as points,
followed by `asperity.parameters.RESULT_COLUMNS`. For a row that cannot be solved ``result`` gives
the reason; the other rows are solved. Rows are read, solved and written in chunks, so that memory
does not grow with the table.
"""

from __future__ import annotations

import difflib
import hashlib
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from asperity.errors import Argument, InputError, require
from asperity.inference.unknowns import EPS_RATIO
from asperity.laws import Law, get_law, registered
from asperity.operating_point import known_parameters, require_influence
from asperity.orbit.outcome import Outcome
from asperity.outputs import UnfinishedText, output_file
from asperity.outputs.targets import require_rereadable
from asperity.parameters import RESULT_COLUMNS, Parameter, point_parameters, required
from asperity.parameters.arguments import counted, shown
from asperity.parameters.columns import cell_number, headings, sheet
from asperity.study.points import Answers, Points
from asperity.study.responses import answers_of_law, broken_rules

Row = list[str]

#: Rows of a chunk, the most that an interruption loses.
_CHUNK = 20_000
#: The result columns that hold numbers, and ``stable``.
_OUTPUTS = RESULT_COLUMNS[: RESULT_COLUMNS.index("converged")]
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
    given: Iterable[str] = (),
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
    given : iterable of str
        Numbers of `filled` that must not be without influence: the user has given them.
    resume : bool
        Whether to continue an interrupted table, if there is one.
    progress : callable, optional
        Called with the number of rows done so far and of all rows.
    block : int
        Number of rows of a chunk.

    Raises
    ------
    InputError
        If the table as a whole cannot be used, no row uses a number of `given`, or `out` cannot be
        written. A bad row raises no error; its column ``result`` has the reason.
    Interrupted
        On Ctrl-C.
    """
    filled = dict(filled or {})
    out = output_file(out, inputs={"table": source})
    table = TableSource(source, law, filled, given)
    output = UnfinishedText(out, {"table": table.digest, "law": law, "filled": filled})
    output.start(resume)
    with output.interruptible(lambda: f"{output.rows} of {table.rows} rows"):
        advance, width = counted(progress, table.rows, output.rows), len(table.header)
        advance(0)
        for rows in table.blocks(block, skip=output.rows):
            answers, results = _solved(table, rows, advance)
            header = None if output.rows else [*table.header, *RESULT_COLUMNS]
            cells = zip(rows, _cells(answers, results), strict=True)
            # Rows with as many cells as the header.
            lines = [(*(row + [""] * width)[:width], *answer) for row, answer in cells]
            output.append_rows(lines, table.delimiter, header, failed=answers.failed)
        output.finish()
    return TableSummary(table.rows, int(output.progress["failed"]), out)


def _solved(
    table: TableSource, rows: Sequence[Row], advance: Callable[[int], None]
) -> tuple[Answers, list[str]]:
    """Answers of rows, and the column ``result``."""
    results = [
        _mistake_of_width(row, len(table.header)) or table.mistake_of_share(row) for row in rows
    ]
    sound = [i for i, result in enumerate(results) if not result]
    advance(len(rows) - len(sound))
    points = _points(table, [rows[i] for i in sound])
    answers = Answers.empty(_OUTPUTS, len(rows))
    for name, members in points.by_law():
        try:
            law = get_law(name)
        except InputError as error:
            mistakes = dict.fromkeys(members.tolist(), str(error))
            advance(len(members))
        else:
            values = points.take(members).of_law(name)
            solved = answers_of_law(law, values, _OUTPUTS, advance)
            answers.put(np.array(sound)[members], solved)
            mistakes = {}
            for k in np.flatnonzero(solved.outcome == Outcome.INVALID):
                row = rows[sound[members[k]]]
                cells = {n: row[place].strip() for n, place in table.columns.items()}
                point = {n: float(v[k]) for n, v in values.items()}
                mistakes[int(members[k])] = _mistake(law, point, cells)
        for k, mistake in mistakes.items():
            results[sound[k]] = mistake
    return answers, [
        mistake or str(reason) for mistake, reason in zip(results, answers.result, strict=True)
    ]


def _cells(answers: Answers, results: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Result cells of each row; the numbers of a failed row are empty."""
    converged = answers.converged
    *columns, stable = (answers[name] for name in _OUTPUTS)
    numbers = np.array(columns).astype(object)
    numbers[:, ~converged] = ""
    flags = ((converged & (stable > 0)).tolist(), converged.tolist())
    return zip(*numbers.tolist(), *flags, results, strict=True)


# The file


class TableSource:
    """A table, read once to count its rows and checked as a whole.

    Parameters
    ----------
    path : Path
    law : str or None
        Law of the rows without a law.
    filled : mapping of str to float
        SI numbers for missing columns and empty cells, by name.
    given : iterable of str
        As for `run_table`.

    Attributes
    ----------
    delimiter : str
    header : list of str
        As read.
    columns : mapping of str to int
        Position of every known column.
    units : mapping of str to float
        SI values of the units in headings, by column.
    rows : int
        Number of rows of data, without blank lines.
    digest : str
        SHA-256 of the file.

    Raises
    ------
    InputError
        If the table cannot be read, has no rows, or lacks a column that all its laws need.
    """

    def __init__(
        self,
        path: Path,
        law: str | None,
        filled: Mapping[str, float],
        given: Iterable[str] = (),
    ) -> None:
        self.path, self.law, self.filled = path, law or "", filled
        require_rereadable(path, "table")
        parameters = _numbers_of_tables()
        self._sheet = sheet(path, parameters.__contains__, label="table")
        self.delimiter, self.header = self._sheet.delimiter, self._sheet.heading
        rule, advice = "have a line of column names and rows", "give one operating point a row"
        named = any(name.strip() for name in self.header)
        require(named, str(path), rule, "an empty file", advice)
        self.columns, self.units = _checked_header(self.header, str(path))
        laws: Counter[str] = Counter()
        #: Columns of given numbers without an empty cell so far.
        full = {name for name in given if name in self.columns}
        #: For each column without a number so far, its first text and the row of this text.
        texts = {name: ("", 0) for name in self.columns if name != "law"}
        for count, row in enumerate(self._sheet.rows(), 1):
            laws[self.law_of(row)] += 1
            full = {name for name in full if self._cell(row, name)}
            for name in tuple(texts):
                cell = self._cell(row, name)
                if math.isfinite(_number(cell, parameters[name])):
                    del texts[name]
                elif cell and not texts[name][0]:
                    texts[name] = cell, count
        self.rows = laws.total()
        rule = "have rows of data"
        require(self.rows, str(path), rule, "only column names", "give one operating point a row")
        self._require_columns(list(laws), texts)
        self._require_use(given, list(laws), full)
        with path.open("rb") as file:
            self.digest = hashlib.file_digest(file, "sha256").hexdigest()

    def blocks(self, size: int, skip: int = 0) -> Iterator[list[Row]]:
        """Rows of data in lists of at most `size`, without the first `skip`."""
        rows = islice(self._sheet.rows(), skip, None)
        while block := list(islice(rows, size)):
            yield block

    def _cell(self, row: Row, name: str) -> str:
        return "".join(row[self.columns[name] :][:1]).strip()

    def _require_use(self, given: Iterable[str], laws: Sequence[str], full: set[str]) -> None:
        """Refuse a given number that no row uses; `full` are columns without an empty cell."""
        known = [law for name, law in registered().items() if name in laws]
        of_laws = {name for law in known for name in point_parameters(law)}
        for name in given:
            field, advice = Argument("numbers", name), "leave it out"
            rule = f"be a number of a law of {self.path}"
            require(name in of_laws, field, rule, ", ".join(laws), advice)
            rule, got = f"fill a cell of {self.path}", "a number in every row"
            require(name not in full, field, rule, got, "leave it out, or the column")
        require_influence(given, {**self.filled, **dict.fromkeys(self.columns, 1.0)})

    def mistake_of_share(self, row: Row) -> str:
        """Why the share of epsilon of a row is invalid; empty for other rows."""
        cell = self._cell(row, EPS_RATIO.name) if EPS_RATIO.name in self.columns else ""
        share = _number(cell, EPS_RATIO) * self.units.get(EPS_RATIO.name, 1.0)
        valid = not cell or 0 < share < math.inf
        return "" if valid else _mistake_of_number(EPS_RATIO, EPS_RATIO.name, share, cell)

    def law_of(self, row: Row) -> str:
        """Name of the law of a row, or "" if it has none."""
        place = self.columns.get("law", len(row))
        return (row[place].strip() if place < len(row) else "") or self.law

    def _require_columns(self, laws: Sequence[str], texts: Mapping[str, tuple[str, int]]) -> None:
        """Refuse a table in which no row can be solved; `texts` of the columns without a number."""
        rule = "name the law of its rows"
        require(any(laws), str(self.path), rule, "no column 'law'", "add it or give --law")
        known = [law for name, law in registered().items() if name in laws]
        if not known:
            get_law(max(laws))
        everywhere = set.intersection(*(set(required(law)) for law in known))
        for name, (text, row) in texts.items():
            holds, advice = name not in everywhere or not text, "write SI numbers without units"
            got = f"{shown(text)} in row {row} and none in any other"
            require(holds, str(self.path), f"have finite numbers in column '{name}'", got, advice)
        missing = everywhere - (set(self.columns) - set(texts)) - set(self.filled)
        if missing:
            rule = "have the columns that its laws need"
            got = f"none for {', '.join(n for n in known_parameters() if n in missing)}"
            raise InputError(str(self.path), rule, got, "add them or name a material that has them")


def _numbers_of_tables() -> dict[str, Parameter]:
    """Columns of numbers: the parameters, and the share of epsilon that the contacts carry."""
    return {**known_parameters(), EPS_RATIO.name: EPS_RATIO}


def _checked_header(header: Sequence[str], label: str) -> tuple[dict[str, int], dict[str, float]]:
    """Position of every known column, and the SI value of the unit in its heading.

    Parameters
    ----------
    header : sequence of str
        As read; blanks around a name are ignored.
    label : str
        Name of the table in messages.

    Raises
    ------
    InputError
        If a column occurs twice, is named like a result, or looks like a misspelt known one.
    """
    parameters = _numbers_of_tables()
    known = {"law", *parameters}
    for name in map(str.strip, header):
        meant = None if name in known else _nearest(name, known)
        advice = f"did you mean '{meant}'? If not, rename the column"
        require(not meant, label, "have columns of known names", f"'{name}'", advice)
    columns, units = {}, {}
    for name, (place, unit) in headings(
        header, label, {*known, *RESULT_COLUMNS}.__contains__
    ).items():
        rule = "not have a column named like a result"
        require(name in known, label, rule, f"'{name}'", "rename or remove it")
        columns[name] = place
        if unit and name in parameters:
            units[name] = parameters[name].unit_in_si(unit, f"{label}.{name}")
    return columns, units


def _nearest(name: str, known: set[str]) -> str | None:
    """The known column whose name is similar to an unknown name; None without one."""
    # 'velocity (m/s)' and 'W [N]' carry the name before the unit.
    plain = re.split(r"[\s(\[]", name, maxsplit=1)[0]
    bare = plain.lower().rstrip("_")
    if not bare or plain in known:
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


# Rows to numbers


def _mistake_of_width(row: Row, width: int) -> str:
    """Why a row with too few or too many cells cannot be used; empty for the other rows."""
    # Spreadsheets leave separators behind the last column.
    if len(row) == width or (len(row) > width and not any(cell.strip() for cell in row[width:])):
        return ""
    return (
        f"row must have as many cells as the header, got {len(row)} instead of {width}; "
        "correct the separators, and quote a cell that holds one"
    )


def _points(table: TableSource, rows: Sequence[Row]) -> Points:
    """Operating points of rows.

    A number that no cell and no default has is NaN; a cell without a finite number is infinite.
    """
    laws = np.array([table.law_of(row) for row in rows], dtype=object)
    values = {name: np.full(len(rows), number) for name, number in table.filled.items()}
    for name, place in table.columns.items():
        if name == "law":
            continue
        cells, parameter = [row[place] for row in rows], _numbers_of_tables()[name]
        try:
            numbers = np.fromiter(map(cell_number, cells), float, len(cells))
            usual = bool(np.isfinite(numbers).all())
        except ValueError:
            usual = False
        if not usual:
            numbers = np.array([_number(cell.strip(), parameter) for cell in cells])
        numbers = numbers * table.units.get(name, 1.0)
        values[name] = np.where(np.isnan(numbers), table.filled.get(name, math.nan), numbers)
    if EPS_RATIO.name in values:
        share = values.pop(EPS_RATIO.name)
        values["epsilon"] = values["epsilon"] * np.where(np.isnan(share), 1.0, share)
    return Points(laws, values)


def _number(cell: str, parameter: Parameter) -> float:
    if not cell:
        return math.nan
    try:
        word = cell.lower()
        number = parameter.words[word] if word in parameter.words else cell_number(cell)
    except ValueError:
        return math.inf
    return number if math.isfinite(number) else math.inf


def _mistake(law: type[Law], values: Mapping[str, float], cells: Mapping[str, str]) -> str:
    """Why the numbers of a row are invalid."""
    name = next(name for name, wrong in broken_rules(law, values) if wrong)
    if name == "law":
        return (
            f"law must depend on the velocity where inertia or eta counts, got {law.name}; leave "
            "both cells empty or choose another law"
        )
    if math.isnan(values[name]):
        return (
            f"{law.name} must have {name}, got an empty cell; fill it in or name a material "
            "that has it"
        )
    shared = name == "epsilon" and EPS_RATIO.name in cells
    label = f"{name} times {EPS_RATIO.name}" if shared else name
    return _mistake_of_number(
        point_parameters(law)[name], label, values[name], cells.get(name, "")
    ) or ("M must be positive where inertia is 1, got 0; fill it in or name a material with it")


def _mistake_of_number(parameter: Parameter, label: str, value: float, cell: str) -> str:
    """Why the value of a cell is none of its parameter; empty for other cells."""
    if math.isinf(value):
        unit = f" in {parameter.unit}" if parameter.unit else ""
        return (
            f"{parameter.name} must be a finite number{unit}, got '{cell}'; write it without unit, "
            "with a decimal point"
        )
    try:
        parameter.check(value, label)
    except InputError as error:
        return str(error)
    return ""
