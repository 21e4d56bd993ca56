"""Periodic responses of a table, in chunks of rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.errors import InputError
from asperity.laws import get_law
from asperity.outputs import UnfinishedText, output_file
from asperity.parameters import RESULT_COLUMNS
from asperity.study.engine import solve_here
from asperity.study.outcome import Answers
from asperity.study.responses import answers_of_law
from asperity.study.table.cells import Row, fit_width, read_numbers
from asperity.study.table.source import TableSource, open_table

#: Rows of a chunk: at most so many are lost by an interruption.
_CHUNK = 20_000
#: The result columns that hold numbers, and ``stable``.
_OUTPUTS = RESULT_COLUMNS[: RESULT_COLUMNS.index("converged")]


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
        Law of the rows that name none.
    filled : mapping of str to float, optional
        SI numbers for missing columns and empty cells, by column name.
    resume : bool
        Continue an interrupted table; without one, start from the first row.
    progress : callable, optional
        Called with the number of rows done so far and of all rows.
    block : int
        Rows of a chunk: solved and written at a time.

    Raises
    ------
    InputError
        If the table as a whole cannot be used or `out` cannot be written. A bad row is no error:
        its reason stands in ``result``.
    Interrupted
        On Ctrl-C.
    """
    filled = dict(filled or {})
    out = output_file(out, inputs={"table": source})
    table = open_table(source, law, filled)
    output = UnfinishedText(out, {"table": table.digest, "law": law, "filled": filled})
    output.start(resume)
    chunks = table.blocks(block, skip=output.rows)

    def solve(start: int, stop: int, advance: Callable[[int], None]) -> None:
        rows, reasons = zip(
            *(fit_width(row, len(table.header)) for row in next(chunks)), strict=True
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
    """Answers of some rows, and the column ``result``; rows with a reason are not solved."""
    answers = Answers.empty(_OUTPUTS, len(rows))
    advance(sum(bool(reason) for reason in reasons))
    for name, members in _by_law(rows, table.columns.get("law"), law, reasons).items():
        try:
            kind = get_law(name)
            values, refused = read_numbers([rows[i] for i in members], kind, table.columns, filled)
        except InputError as error:
            refused = [str(error)] * len(members)
        for i, reason in zip(members, refused, strict=True):
            reasons[i] = reason
        advance(sum(bool(reason) for reason in refused))
        sound = np.array([k for k, reason in enumerate(refused) if not reason], dtype=np.intp)
        if len(sound):
            some = {n: v[sound] for n, v in values.items()}
            answers.put(members[sound], answers_of_law(kind, some, _OUTPUTS, advance))
    results = [reason or str(text) for reason, text in zip(reasons, answers.result, strict=True)]
    return answers, results


def _by_law(
    rows: Sequence[Row], place: int | None, law: str | None, reasons: Sequence[str]
) -> dict[str, np.ndarray]:
    """Rows without a reason yet, by their law."""
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
