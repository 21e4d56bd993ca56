"""A figure of the virtual experiment: points, the model's lines, and what the points say."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import pandas as pd

from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers
from asperity.papers.bureau2000.numbers.machine import Float
from asperity.papers.bureau2000.virtual.recordings import (
    NORMAL,
    POINT_COLUMNS,
    QUANTITIES,
    Series,
)

#: Value, standard uncertainty, and the model's value.
Read: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class RecoveredQuantity:
    """A number read off the simulated recordings, beside the one in the simulated machine.

    Attributes
    ----------
    what : str
    value, uncertainty : float
        Standard uncertainty.
    true_value : float
        Of the model, or given to the machine: what the readings know nothing of.
    stated : str
        What the text of the paper says about its own experiment.
    """

    what: str
    value: float
    uncertainty: float
    true_value: float
    stated: str

    @property
    def agrees(self) -> bool:
        """Whether the 95 % interval holds the value in the simulated machine."""
        return bool(abs(self.value - self.true_value) <= NORMAL * self.uncertainty)


@dataclass(frozen=True)
class VirtualNumbers(FigureNumbers):
    """`FigureNumbers` whose `data` are the model's lines.

    Attributes
    ----------
    points : DataFrame
        With the columns of `asperity.papers.bureau2000.virtual.POINT_COLUMNS`.
    series : tuple of Series
    recovered : tuple of RecoveredQuantity
    """

    points: pd.DataFrame = field(default_factory=pd.DataFrame)
    series: tuple[Series, ...] = ()
    recovered: tuple[RecoveredQuantity, ...] = ()

    def of(self, series: str) -> pd.DataFrame:
        """The points of one series."""
        return self.points[self.points["series"] == series]

    def last_point(self, series: str, name: str) -> Read:
        """Value, uncertainty and model of a quantity at a series' largest amplitude."""
        row = self.of(series).iloc[-1]
        return float(row[name]), float(row[f"{name}_uncertainty"]), float(row[f"{name}_model"])


def with_model(points: pd.DataFrame, lines: pd.DataFrame) -> pd.DataFrame:
    """Points with the model's values, from the lines' own operating points.

    Raises
    ------
    KeyError
        If a line has no operating point where a point is.
    """
    at = [_row(lines, V, f, e) for V, f, e in zip(*_where(points), strict=True)]
    found = points.copy()
    steady = lines["mean_friction"] - lines["delta_mu"]
    for name in QUANTITIES:
        column = steady if name == "static_friction" else lines[name]
        found[f"{name}_model"] = column.loc[at].to_numpy()
    return found[list(POINT_COLUMNS)]


def _where(points: pd.DataFrame) -> tuple[Float, ...]:
    return tuple(points[name].to_numpy() for name in ("V", "frequency", "epsilon_eff"))


def _row(lines: pd.DataFrame, V: float, f: float, epsilon: float) -> int:
    same = (
        np.isclose(lines["V"], V, rtol=1e-9, atol=0)
        & (lines["frequency"] == f)
        & np.isclose(lines["epsilon_eff"], epsilon, rtol=1e-9, atol=1e-12)
    )
    if not same.any():
        raise KeyError(f"no operating point at {V:g} m/s, {f:g} Hz, {epsilon:g}")
    return int(lines.index[same][0])


def covered(points: pd.DataFrame, names: tuple[str, ...]) -> tuple[int, int]:
    """Number of 95 % intervals that contain the model, and of all intervals."""
    within = [
        abs(points[name] - points[f"{name}_model"]) <= NORMAL * points[f"{name}_uncertainty"]
        for name in names
    ]
    return int(sum(own.sum() for own in within)), sum(len(own) for own in within)


def ratio(a: Read, b: Read) -> Read:
    """Value, uncertainty and model of a quotient of two independent ones."""
    value = a[0] / b[0]
    return value, abs(value) * float(np.hypot(a[1] / a[0], b[1] / b[0])), a[2] / b[2]


def scalars(recovered: tuple[RecoveredQuantity, ...]) -> dict[str, float]:
    """Findings as named numbers, for the head of a table."""
    return {
        f"{quantity.what}, {name}": getattr(quantity, name)
        for quantity in recovered
        for name in ("value", "uncertainty", "true_value")
    }
