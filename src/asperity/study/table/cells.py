"""Cells to numbers, with the reason why a row cannot be solved."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.laws import Law
from asperity.operating_point import without_mass
from asperity.parameters import Parameter, point_parameters, required

Row = list[str]


def fit_width(row: Row, width: int) -> tuple[Row, str]:
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
    """Check the rule of the numbers; a row that breaks it gets the reason."""
    try:
        parameter.check(numbers[present])
        return
    except InputError:
        pass
    for i in np.flatnonzero(present):
        try:
            parameter.check(float(numbers[i]))
        except InputError as error:
            reasons[i] = reasons[i] or str(error)
