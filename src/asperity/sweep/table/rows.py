"""Solution of a block of rows: one vectorised solve per law, a reason for every unsolved row."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.laws import get_law
from asperity.operating_point import motions, respond
from asperity.orbit import PeriodicResponse
from asperity.parameters import RESULT_COLUMNS
from asperity.parameters.arguments import increments
from asperity.sweep.table.cells import Row, fit_width, read_numbers

#: The result columns that hold numbers.
_NUMBERS = RESULT_COLUMNS[: RESULT_COLUMNS.index("stable")]


class BlockResults:
    """The result columns of a block, filled for one law after the other.

    Attributes
    ----------
    numbers : array, shape (len(_NUMBERS), rows)
    stable, converged : bool arrays, shape (rows,)
    reasons : list of str
        The column ``result``.
    """

    def __init__(self, reasons: list[str]) -> None:
        rows = len(reasons)
        self.numbers = np.full((len(_NUMBERS), rows), np.nan)
        self.stable = np.zeros(rows, dtype=bool)
        self.converged = np.zeros(rows, dtype=bool)
        self.reasons = reasons

    def put(self, index: NDArray[np.intp], response: PeriodicResponse) -> None:
        """Fill the rows `index` from a response."""
        for k, name in enumerate(_NUMBERS):
            self.numbers[k, index] = getattr(response, name)
        self.stable[index] = response.stable
        self.converged[index] = response.converged
        for i, reason in zip(index, response.result, strict=True):
            self.reasons[i] = str(reason)

    @property
    def failed(self) -> int:
        """Rows without a converged response."""
        return int((~self.converged).sum())

    def cells(self) -> Iterator[tuple[object, ...]]:
        """Result cells of each row; the numbers of a failed row are empty."""
        numbers = self.numbers.astype(object)
        numbers[:, ~self.converged] = ""
        flags = (self.stable.tolist(), self.converged.tolist())
        return zip(*numbers.tolist(), *flags, self.reasons, strict=True)


def solve_block(
    block: Sequence[Row],
    columns: Mapping[str, int],
    width: int,
    law: str | None,
    filled: Mapping[str, float],
    progress: Callable[[int], None],
) -> tuple[list[Row], BlockResults]:
    """Solve the rows of a block.

    Parameters
    ----------
    block : sequence of rows
    columns : mapping of str to int
        Position of every known column.
    width : int
        Cells that a row must have.
    law : str or None
        Law of the rows that name none.
    filled : mapping of str to float
        SI numbers for missing columns and empty cells.
    progress : callable
        Called with the number of rows finished since the last call.

    Returns
    -------
    rows, results
        The rows as read, each with `width` cells.
    """
    fitted = [fit_width(row, width) for row in block]
    rows = [row for row, _ in fitted]
    results = BlockResults([reason for _, reason in fitted])
    for name, members in _by_law(rows, columns.get("law"), law, results.reasons).items():
        solved = _solve_law(name, [rows[i] for i in members], columns, filled, progress)
        responses, reasons = solved
        for i, reason in zip(members, reasons, strict=True):
            results.reasons[i] = reason
        progress(sum(bool(reason) for reason in reasons))
        for index, response in responses:
            results.put(np.array(members)[index], response)
    return rows, results


def _by_law(
    rows: Sequence[Row], place: int | None, law: str | None, reasons: list[str]
) -> dict[str, list[int]]:
    """Rows without a reason yet, by their law."""
    members: dict[str, list[int]] = {}
    for i, row in enumerate(rows):
        own = "" if place is None else row[place].strip()
        if not reasons[i]:
            members.setdefault(own or law or "", []).append(i)
    return members


def _solve_law(
    name: str,
    rows: Sequence[Row],
    columns: Mapping[str, int],
    filled: Mapping[str, float],
    progress: Callable[[int], None],
) -> tuple[list[tuple[NDArray[np.intp], PeriodicResponse]], list[str]]:
    """Groups of rows with their responses, and the reason of each row without one."""
    try:
        kind = get_law(name)
    except InputError as error:
        return [], [str(error)] * len(rows)
    values, reasons = read_numbers(rows, kind, columns, filled)
    index = np.array([i for i, reason in enumerate(reasons) if not reason], dtype=np.intp)
    values = {n: v[index] for n, v in values.items()}
    responses = [
        (
            index[group],
            respond(kind, {n: v[group] for n, v in values.items()}, increments(progress)),
        )
        for group in motions(values)
    ]
    return responses, reasons
