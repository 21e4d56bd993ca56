"""Periodic responses of a table, in blocks."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from asperity.outputs import Interrupted, UnfinishedText, output_file
from asperity.parameters import RESULT_COLUMNS
from asperity.sweep.table.rows import solve_block
from asperity.sweep.table.source import TableSource, open_table

#: Rows solved and written at a time: at most so many are lost by an interruption.
_BLOCK = 20_000


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
    block: int = _BLOCK,
) -> TableSummary:
    """Periodic response for every row of a CSV table.

    Parameters
    ----------
    source, out : Path
        `out` is written when all rows are done; until then finished blocks are in ``OUT.partial``.
    law : str, optional
        Law of the rows that name none.
    filled : mapping of str to float, optional
        SI numbers for missing columns and empty cells, by column name.
    resume : bool
        Continue an interrupted table; without one, start from the first row.
    progress : callable, optional
        Called with the number of rows done so far and of all rows.
    block : int
        Rows solved and written at a time.

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
    try:
        _fill_output(table, output, law, filled, progress or (lambda done, total: None), block)
        output.finish()
    except KeyboardInterrupt:
        done = output.rows
        raise Interrupted(f"{done} of {table.rows} rows" if done else "") from None
    finally:
        output.discard_if_empty()
    return TableSummary(table.rows, int(output.progress["failed"]), out)


def _fill_output(
    table: TableSource,
    output: UnfinishedText,
    law: str | None,
    filled: Mapping[str, float],
    progress: Callable[[int, int], None],
    block: int,
) -> None:
    width = len(table.header)
    header = [] if output.rows else [[*table.header, *RESULT_COLUMNS]]
    solved = output.rows
    progress(solved, table.rows)

    def advance(count: int) -> None:
        nonlocal solved
        solved += count
        progress(solved, table.rows)

    for part in table.blocks(block, skip=output.rows):
        rows, results = solve_block(part, table.columns, width, law, filled, advance)
        lines = ([*row, *cells] for row, cells in zip(rows, results.cells(), strict=True))
        text = _text([*header, *lines], table.delimiter)
        output.append(text, len(rows), failed=results.failed)
        header = []


def _text(rows: Iterable[Sequence[object]], delimiter: str) -> str:
    text = io.StringIO(newline="")
    csv.writer(text, delimiter=delimiter, lineterminator="\n").writerows(rows)
    return text.getvalue()
