"""Design weights: the parts of the budget, in readings or time, that are spent on the candidates.

The criterion of a design (`asperity.inference.design.criteria`) is a concave function of the
weights. It is maximised by Newton's method: each step maximises the quadratic approximation over
weights that are not negative and have the sum 1, a problem of least squares. This is repeated until
the general equivalence theorem (Kiefer and Wolfowitz, 1960) shows that no design is better by more
than the tolerance: the largest derivative less the mean derivative of the design bounds the gain of
a concave criterion. Whole readings are derived from the weights.

Designs are compared with an even grid of the same budget.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, nnls

from asperity.arrays import Float, Index
from asperity.inference.design.criteria import Determinant

Whole = NDArray[np.int64]

#: Largest part of the information of the best design that may be missing.
_TOLERANCE = 1e-3
#: Newton steps, and how often a step is halved until the criterion rises.
_ROUNDS, _HALVINGS = 100, 20
#: Number of candidates with the largest derivatives that get weight in one step.
_JOINING = 60
#: Weight of the sum of the weights among the squares of a step, which are of order 1.
_OF_SUM = 1e4
#: Sweeps of exchanges of whole readings.
_SWEEPS = 30


def optimal_weights(criterion: Determinant, readings: Float) -> tuple[Float, float]:
    """Design weights that maximise a criterion.

    Parameters
    ----------
    criterion : Determinant
    readings : array, shape (candidates,)
        Readings of each candidate if it gets the whole budget.

    Returns
    -------
    weights : array, shape (candidates,)
        Parts of the budget, with the sum 1.
    efficiency : float
        Lower bound of the information over that of the best design.
    """
    weights, efficiency = np.full(criterion.size, 1 / criterion.size), 0.0
    value = criterion.value(weights * readings)
    for _ in range(_ROUNDS):
        slope = criterion.gradient(weights * readings) * readings
        efficiency = criterion.least_efficiency(weights, slope)
        if efficiency >= 1 - _TOLERANCE:
            break
        at = np.union1d(np.flatnonzero(weights), np.argsort(-slope)[:_JOINING])
        matrix, target = criterion.second_order(weights * readings, at)
        matrix = np.vstack([matrix * readings[at], np.full(at.size, _OF_SUM)])
        proposed = np.zeros(criterion.size)
        proposed[at] = nnls(matrix, np.append(target, _OF_SUM))[0]
        proposed /= proposed.sum()
        for part in 0.5 ** np.arange(_HALVINGS):
            tried = (1 - part) * weights + part * proposed
            reached = criterion.value(tried * readings)
            if reached > value:
                weights, value = tried, reached
                break
        else:
            break
    return weights, efficiency


def whole_readings(criterion: Determinant, cost: Float, total: float, weights: Float) -> Whole:
    """Whole numbers of readings within the budget, from optimal weights by exchanges.

    Parameters
    ----------
    criterion : Determinant
    cost : array, shape (candidates,)
        Cost of a reading.
    total : float
        Budget.
    weights : array, shape (candidates,)
    """
    n = np.floor(weights * total / cost + 1e-9)
    slack = total * (1 + 1e-12)
    n = _filled(criterion, cost, slack, n)
    for _ in range(_SWEEPS):
        value, improved = criterion.value(n), False
        for j in np.flatnonzero(n):
            if n[j] < 1:
                continue
            fewer = n.copy()
            fewer[j] -= 1
            gain = criterion.exchanged(fewer)
            gain[cost > slack - fewer @ cost] = -math.inf
            i = int(np.argmax(gain))
            if i != j and gain[i] > value + 1e-9 * max(abs(value), 1.0):
                fewer[i] += 1
                n = _filled(criterion, cost, slack, fewer)
                value, improved = criterion.value(n), True
        if not improved:
            break
    return n.astype(np.int64)


def _filled(criterion: Determinant, cost: Float, total: float, n: Float) -> Float:
    """Add readings one by one, each with the largest gain per cost, until the budget is spent."""
    n = n.copy()
    while True:
        left = total - float(n @ cost)
        fits = cost <= left
        if not fits.any():
            return n
        gain = np.where(fits, (criterion.exchanged(n) - criterion.value(n)) / cost, -math.inf)
        n[int(np.argmax(gain))] += 1


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
        Number of points of the grid, including points that are no candidates.
    """

    levels: tuple[int, ...]
    rows: Index
    size: int

    def readings(self, cost: Float, total: float) -> Float:
        """Readings of each candidate, equally many at each point of the grid."""
        n = np.zeros(len(cost))
        n[self.rows] = total / cost[self.rows].sum()
        return n


def even_grid(shape: tuple[int, ...], index: Index, cost: Float, total: float) -> EvenGrid:
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
        # Nearest to the budget; among equal grids, the one with the most even numbers of levels.
        rank = (round(abs(np.log(spent / total)), 1), float(np.std(np.log(levels))))
        if best is None or rank < best[0]:
            grid = EvenGrid(tuple(len(p) for p in picks), rows, int(np.prod(levels)))
            best = rank, grid
    assert best is not None  # the whole grid has all candidates
    return best[1]


def times_fewer(criterion: Determinant, readings: Float, target: float) -> float:
    """The factor by which readings must be multiplied to reach a value of the criterion.

    Parameters
    ----------
    criterion : Determinant
    readings : array, shape (candidates,)
    target : float

    Returns
    -------
    float
        Infinite if a million times the readings do not reach it.
    """

    def lacking(log_factor: float) -> float:
        return criterion.value(np.exp(log_factor) * readings) - target

    low, high = -np.log(1e3), np.log(1e6)
    if lacking(high) < 0:
        return float("inf")
    if lacking(low) > 0:
        return float(np.exp(low))
    return float(np.exp(brentq(lacking, low, high, xtol=1e-6)))
