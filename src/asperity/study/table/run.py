"""A table from end to end, in blocks."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from asperity._version import __version__
from asperity.errors import InputError
from asperity.study.table.columns import RESULTS
from asperity.study.table.partial import PartialOutput
from asperity.study.table.rows import solve_block
from asperity.study.table.source import Source, open_source

#: Rows solved and written at a time: what an interruption can cost, and what memory holds.
_BLOCK = 20_000


@dataclass(frozen=True)
class TableSummary:
    """How a table went.

    Attributes
    ----------
    rows, failed : int
        All rows, and those without a converged response.
    out : Path
    """

    rows: int
    failed: int
    out: Path


class TableInterrupted(KeyboardInterrupt):
    """The user stopped a table; the message says how to go on."""


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
        `out` appears when all rows are done; finished blocks wait in ``OUT.partial``.
    law : str, optional
        Law of the rows that name none.
    filled : mapping of str to float, optional
        SI numbers for missing columns and empty cells, by column name.
    resume : bool
        Go on after an interruption; without one, start from the first row.
    progress : callable, optional
        Called with the number of rows done so far and of all rows.
    block : int
        Rows solved and written at a time.

    Raises
    ------
    InputError
        If the table as a whole cannot be used or `out` cannot be written. A bad row is no error:
        its reason stands in ``result``.
    TableInterrupted
        On Ctrl-C.
    """
    filled = dict(filled or {})
    out = _checked_target(source, out)
    table = open_source(source, law, filled)
    output = PartialOutput(out, _fingerprint(table, law, filled))
    output.start(resume)
    try:
        _fill_output(table, output, law, filled, progress or (lambda done, total: None), block)
        output.finish()
    except KeyboardInterrupt:
        done = output.done.rows
        raise TableInterrupted(
            f"interrupted with {done} of {table.rows} rows finished; repeat the command with "
            "--resume to go on from there"
            if done
            else "interrupted before the first rows were finished; nothing was written"
        ) from None
    finally:
        output.drop_if_empty()
    return TableSummary(table.rows, output.done.failed, out)


def _fill_output(
    table: Source,
    output: PartialOutput,
    law: str | None,
    filled: Mapping[str, float],
    progress: Callable[[int, int], None],
    block: int,
) -> None:
    width = len(table.header)
    if not output.done.rows:
        output.append([[*table.header, *RESULTS]], 0, 0, table.delimiter)
    solved = output.done.rows
    progress(solved, table.rows)

    def advance(count: int) -> None:
        nonlocal solved
        solved += count
        progress(solved, table.rows)

    for part in table.blocks(block, skip=output.done.rows):
        rows, results = solve_block(part, table.columns, width, law, filled, advance)
        lines = ([*row, *cells] for row, cells in zip(rows, results.cells(), strict=True))
        output.append(lines, len(rows), results.failed, table.delimiter)


def _checked_target(source: Path, out: Path) -> Path:
    """Where the output goes, links followed, so that replacing it leaves a link in its place."""
    target = out.resolve()
    if target == source.resolve():
        raise InputError(f"out must be another file than the table, got '{out}'; choose a new name")
    if target.exists() and not target.is_file():
        raise InputError(
            f"out must be the name of a file, got '{out}', which is none; "
            "add a file name such as 'out.csv'"
        )
    return target


def _fingerprint(table: Source, law: str | None, filled: Mapping[str, float]) -> str:
    said = [__version__, table.digest, law, sorted(filled.items())]
    return hashlib.sha256(json.dumps(said).encode()).hexdigest()
