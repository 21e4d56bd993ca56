"""Cells to numbers: what a row says, what is filled in for it, and what is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.laws import Law
from asperity.study.operating_point import Quantity, quantities, required, without_mass

Row = list[str]


def fit_width(row: Row, width: int) -> tuple[Row, str]:
    """The row with as many cells as the header, and what was wrong with it, if anything."""
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


def read_numbers(
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
        SI; meaningless where there is a reason.
    reasons : list of str
        Why a row cannot be solved; empty where it can.
    """
    reasons = [""] * len(rows)
    values = {}
    for name, quantity in quantities(law).items():
        place = columns.get(name)
        cells = [""] * len(rows) if place is None else [row[place] for row in rows]
        default = math.nan if quantity.default is None else quantity.default
        numbers = _parsed(cells, name, quantity, filled.get(name, default), reasons)
        absent = np.isnan(numbers)
        if name in required(law):
            for i in np.flatnonzero(absent):
                reasons[i] = reasons[i] or (
                    f"{law.name} must have {name}, got an empty cell; fill it in or name a "
                    "material that has it"
                )
        _check(numbers, ~absent, quantity, reasons)
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
    cells: Sequence[str], name: str, quantity: Quantity, fill: float, reasons: list[str]
) -> NDArray[np.float64]:
    """Numbers of a column, `fill` for empty cells; NaN where there is none."""
    try:
        numbers = np.fromiter(map(float, cells), float, len(cells))
        if np.isfinite(numbers).all():
            return numbers
    except ValueError:
        pass
    return np.array(
        [_number(cell, name, quantity, fill, reasons, i) for i, cell in enumerate(cells)]
    )


def _number(
    cell: str, name: str, quantity: Quantity, fill: float, reasons: list[str], i: int
) -> float:
    text = cell.strip()
    if not text:
        return fill
    try:
        number = quantity.words[text.lower()] if text.lower() in quantity.words else float(text)
    except ValueError:
        number = math.nan
    if math.isfinite(number):
        return number
    unit = f" in {quantity.unit}" if quantity.unit else ""
    reasons[i] = reasons[i] or (
        f"{name} must be a finite number{unit}, got '{text}'; write it without unit, with a "
        "decimal point"
    )
    return math.nan


def _check(
    numbers: NDArray[np.float64], present: NDArray[np.bool_], quantity: Quantity, reasons: list[str]
) -> None:
    """Hold the numbers against the quantity's rule; a row that breaks it gets the reason."""
    try:
        quantity.check(numbers[present])
        return
    except InputError:
        pass
    for i in np.flatnonzero(present):
        try:
            quantity.check(float(numbers[i]))
        except InputError as error:
            reasons[i] = reasons[i] or str(error)
