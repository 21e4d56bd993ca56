"""A paper's procedure from measurements to parameters: input tables and results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from asperity._version import __version__
from asperity.errors import InputError
from asperity.parameters.arguments import typed
from asperity.parameters.columns import read_headed_columns
from asperity.units import to_si


@typed
def read_columns(
    path: Path,
    columns: Mapping[str, str],
    row: str,
    *,
    texts: Sequence[str] = (),
    label: str = "",
) -> dict[str, Any]:
    """Columns of a CSV, in SI or with units in their headings; lines with ``#`` are skipped.

    Parameters
    ----------
    path : Path
    columns : mapping of str to str
        Kind of quantity of each column, a key of `asperity.units.KINDS`.
    row : str
        Meaning of a row, such as ``"a bifurcation"``.
    texts : sequence of str
        Columns of texts, which are lists.
    label : str
        What messages call the argument; by default the name of the file.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, or a cell is no number.
    """
    cells = read_headed_columns(path, columns, texts=texts, label=label or path.name, row=row)
    wanted = [*columns, *texts]
    if missing := ", ".join(column for column in wanted if column not in cells):
        rule = f"have the columns {', '.join(wanted)}"
        raise InputError(path.name, rule, f"none for {missing}", "add them")
    return {name: cells[name] for name in texts} | {
        name: np.asarray(to_si(cells[name], kind, f"{path.name}, {name}"))
        for name, kind in columns.items()
    }


@dataclass(frozen=True)
class RecipeNumber:
    """A number from a paper's procedure, and the number in the paper, in SI.

    Attributes
    ----------
    name, unit : str
    value, se : float
        Estimate and standard error, with the errors of all earlier steps.
    se_own : float
        Standard error from the readings of this step only.
    step : int
    how : str
        The data of the number.
    published, published_uncertainty : float or None
    published_place : str
        Section of the paper.
    upper_limit_95 : float or None
        At 95 % confidence, of a number that is only bounded.
    """

    name: str
    unit: str
    value: float
    se: float
    se_own: float
    step: int
    how: str
    published: float | None
    published_uncertainty: float | None
    published_place: str
    upper_limit_95: float | None = None

    @property
    def deviation(self) -> float | None:
        """Difference from the paper over the combined standard error; None if one is unknown."""
        if self.published is None or self.upper_limit_95 is not None:
            return None
        spread = math.hypot(self.se, self.published_uncertainty or 0.0)
        return (self.value - self.published) / spread if spread > 0 else None


@dataclass(frozen=True, eq=False)
class RecipeResult:
    """All numbers of a paper's procedure.

    Attributes
    ----------
    paper : str
        Name of the paper.
    numbers : mapping of str to RecipeNumber
    warnings : tuple of str
    data : tuple of str
        Names of the tables.
    """

    paper: str
    numbers: Mapping[str, RecipeNumber]
    warnings: tuple[str, ...]
    data: tuple[str, ...]

    def record(self) -> dict[str, Any]:
        """Everything as plain numbers and texts, for JSON."""
        return {
            "recipe": self.paper,
            "numbers": {
                n: {**asdict(r), "deviation": r.deviation} for n, r in self.numbers.items()
            },
            "warnings": list(self.warnings),
            "data": list(self.data),
            "asperity_version": __version__,
        }
