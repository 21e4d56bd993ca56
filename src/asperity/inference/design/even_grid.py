"""An even grid of the same budget: what a design is compared with."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from asperity.inference.design.shares import Criterion

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EvenGrid:
    """A full factorial over the axes of a plan.

    Attributes
    ----------
    levels : tuple of int
        Number of levels along each axis.
    rows : int array
        Candidates on the grid.
    size : int
        Points of the grid, those that are no candidates included.
    """

    levels: tuple[int, ...]
    rows: NDArray[np.intp]
    size: int

    def readings(self, cost: Float, total: float) -> Float:
        """Readings of each candidate, equally many at each point of the grid."""
        n = np.zeros(len(cost))
        n[self.rows] = total / cost[self.rows].sum()
        return n


def even_grid(
    shape: tuple[int, ...], index: NDArray[np.intp], cost: Float, total: float
) -> EvenGrid:
    """The grid whose usable points come nearest to the budget with one reading each.

    Parameters
    ----------
    shape : tuple of int
        Number of levels of each axis in the plan.
    index : int array, shape (candidates,)
        Number of each candidate among all combinations.
    cost : array, shape (candidates,)
    total : float
    """
    usable = np.full(int(np.prod(shape)), -1)
    usable[index] = np.arange(index.size)
    usable = usable.reshape(shape)
    best: tuple[tuple[float, float], EvenGrid] | None = None
    for levels in itertools.product(*(range(min(2, s), s + 1) for s in shape)):
        picks = [
            np.unique(np.rint(np.linspace(0, s - 1, m)).astype(int))
            for s, m in zip(shape, levels, strict=True)
        ]
        rows = usable[np.ix_(*picks)].ravel()
        rows = rows[rows >= 0]
        if not rows.size:
            continue
        spent = float(cost[rows].sum())
        # Nearest in budget; of those, the one with the most equal numbers of levels.
        rank = (round(abs(np.log(spent / total)), 1), float(np.std(np.log(levels))))
        if best is None or rank < best[0]:
            grid = EvenGrid(tuple(len(p) for p in picks), rows, int(np.prod(levels)))
            best = rank, grid
    assert best is not None  # the whole grid has all candidates
    return best[1]


def times_fewer(criterion: Criterion, design: Float, grid: Float) -> float:
    """How many times the readings of a grid must be for the criterion of a design.

    Parameters
    ----------
    criterion : Criterion
    design, grid : array, shape (candidates,)
        Readings of the same budget.

    Returns
    -------
    float
        Infinite if the grid does not get there with a million times the readings.
    """
    return times_fewer_of(criterion, grid, criterion.value(design))


def times_fewer_of(criterion: Criterion, grid: Float, target: float) -> float:
    """How many times the readings of a grid must be for a value of the criterion."""

    def lacking(log_factor: float) -> float:
        return criterion.value(np.exp(log_factor) * grid) - target

    low, high = -np.log(1e3), np.log(1e6)
    if lacking(high) < 0:
        return float("inf")
    if lacking(low) > 0:
        return float(np.exp(low))
    return float(np.exp(brentq(lacking, low, high, xtol=1e-6)))
