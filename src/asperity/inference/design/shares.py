"""Optimal shares of the budget: criteria of a design, and the shares that maximise them.

A design gives each candidate a number of readings n_i, which need not be whole. Readings are
independent: the information matrix is the sum of n_i M_i, plus that of priors. A criterion is a
concave function of this matrix.

`Determinant` measures parameters (D_s-optimality: the determinant of their covariance matrix, the
others being estimated too). `Misfit` excludes a law (T-optimality: the smallest chi-squared that
the rival can reach; Atkinson and Fedorov, Biometrika 62, 57, 1975).

The share of a candidate is the part of the budget, in readings or time, that is spent on it. The
candidates with the largest derivatives join the support, and the shares on the support are
optimised. This is repeated until the general equivalence theorem (Kiefer and Wolfowitz, 1960) shows
that no design is better by more than the tolerance: the largest derivative less the mean derivative
of the design bounds the gain of a concave criterion. Whole readings are derived from the shares.

Designs are compared with an even grid of the same budget.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize

from asperity.arrays import Float, Index

#: Relative addition to the diagonal of an information matrix, which makes it invertible.
_RIDGE = 1e-11
#: Relative round-off of a sum of squares.
_ROUND_OFF = 1e-15


class Determinant:
    """-ln det of the covariance matrix of some parameters, averaged over draws.

    Parameters
    ----------
    information : array, shape (draws, candidates, p, p)
        Fisher information of one reading.
    prior : array, shape (draws, p, p)
        Information of priors.
    interest : sequence of int
        Indices of the parameters to be measured; all indices for D-optimality.
    """

    def __init__(self, information: Float, prior: Float, interest: Sequence[int]) -> None:
        self.information, self.prior = information, prior
        p = information.shape[-1]
        self.interest = list(interest)
        self.others = [i for i in range(p) if i not in self.interest]
        largest = np.einsum("kiaa->ka", information) + np.einsum("kaa->ka", prior)
        ridge = _RIDGE * np.where(largest > 0, largest, 1.0) / max(information.shape[1], 1)
        self._ridge = np.einsum("ka,ab->kab", ridge, np.eye(p))

    @property
    def size(self) -> int:
        """Number of candidates."""
        return int(self.information.shape[1])

    def total(self, n: Float) -> Float:
        """Information matrix of each draw, shape (draws, p, p)."""
        summed = np.einsum("i,kiab->kab", n, self.information)
        return np.asarray(summed + self.prior + self._ridge)

    def value(self, n: Float) -> float:
        """The criterion: mean over the draws."""
        return float(self._log_ratio(self.total(n)).mean())

    def _log_ratio(self, total: Float) -> Float:
        """Ln det M - ln det M22, over the leading axes; minus infinity if M is singular."""
        whole = np.asarray(np.linalg.slogdet(total)[1])
        if not self.others:
            return whole
        others = np.linalg.slogdet(total[..., self.others, :][..., self.others])[1]
        singular = np.isneginf(whole) | np.isneginf(others)
        return np.subtract(whole, others, out=np.full_like(whole, -np.inf), where=~singular)

    def gradient(self, n: Float) -> Float:
        """Tr(M^-1 M_i) less the same for the block of the other parameters, mean over the draws."""
        total = self.total(n)
        weight = np.linalg.inv(total)
        if self.others:
            pick = np.ix_(self.others, self.others)
            for k in range(len(total)):
                weight[k][pick] -= np.linalg.inv(total[k][pick])
        return np.asarray(np.einsum("kab,kiab->i", weight, self.information) / len(total))

    def exchanged(self, n: Float) -> Float:
        """Criterion with one more reading of each candidate."""
        total = self.total(n)[:, None] + self.information
        return self._log_ratio(total).mean(0)

    def least_efficiency(self, gap: float, value: float) -> float:
        """Lower bound of the efficiency, by the s-th root of the determinant: inverse variance."""
        return float(np.exp(-max(gap, 0.0) / len(self.interest)))

    def restricted(self, rows: Index) -> Self:
        """The criterion for some of the candidates."""
        part = copy(self)
        part.information = self.information[:, rows]
        return part


class Misfit(Determinant):
    """Smallest chi-squared of a rival law whose predictions are linear in its parameters.

    The rival has one more column, its residuals. In the sum of the inner products of the columns,
    the block of the residuals given that of the parameters (the Schur complement) is the
    chi-squared of the refitted rival: the exponential of a `Determinant` with the residuals as the
    parameter of interest.

    Parameters
    ----------
    residual : array, shape (candidates, m)
        Rival's prediction less the expected reading, in standard uncertainties, at some values of
        the rival's parameters.
    jacobian : array, shape (candidates, m, p)
        Derivatives of the residual at these values.
    prior_residual : array, shape (q,)
        Residuals of the rival's priors.
    prior_jacobian : array, shape (q, p)
    """

    def __init__(
        self, residual: Float, jacobian: Float, prior_residual: Float, prior_jacobian: Float
    ) -> None:
        self.residual, self.jacobian = residual, jacobian
        self.prior_residual, self.prior_jacobian = prior_residual, prior_jacobian
        columns = np.concatenate([residual[..., None], jacobian], axis=-1)
        prior = np.column_stack([prior_residual, prior_jacobian])
        products = np.einsum("ima,imb->iab", columns, columns)
        super().__init__(products[None], (prior.T @ prior)[None], [0])
        # What is added to the squares of the residuals counts as chi-squared: only their round-off.
        self._ridge[:, 0, 0] *= _ROUND_OFF / _RIDGE

    def value(self, n: Float) -> float:
        """chi-squared of the refitted rival."""
        return math.exp(super().value(n))

    def gradient(self, n: Float) -> Float:
        """chi-squared of the refitted rival at each candidate."""
        return self.value(n) * super().gradient(n)

    def exchanged(self, n: Float) -> Float:
        """chi-squared with one more reading of each candidate."""
        return np.exp(super().exchanged(n))

    def least_efficiency(self, gap: float, value: float) -> float:
        """Lower bound of the efficiency, by chi-squared."""
        return float(value / (value + max(gap, 0.0))) if 0 < value < math.inf else 0.0


Whole = NDArray[np.int64]

#: Largest part of the information of the best design that may be missing.
_TOLERANCE = 1e-3
_ROUNDS = 200
#: Smaller shares are set to zero.
_NEGLIGIBLE = 1e-5
#: Number of candidates of the first support, and of those that join it in one round.
_FIRST, _JOINING = 60, 3
#: Sweeps of exchanges of whole readings.
_SWEEPS = 30


@dataclass(frozen=True, eq=False)
class Shares:
    """Shares of the budget and how good they are.

    Attributes
    ----------
    shares : array, shape (candidates,)
        Shares, with the sum 1.
    efficiency : float
        Lower bound of the information over that of the best design.
    """

    shares: Float
    efficiency: float


def optimal_shares(criterion: Determinant, readings: Float, start: Float | None = None) -> Shares:
    """Shares of the budget that maximise a criterion.

    Parameters
    ----------
    criterion : Determinant
    readings : array, shape (candidates,)
        Readings of each candidate if it gets the whole budget.
    start : array, shape (candidates,), optional
        Shares to start from.
    """
    shares = np.full(criterion.size, 1 / criterion.size) if start is None else start
    best, efficiency = shares, 0.0
    for round_ in range(_ROUNDS):
        slope = criterion.gradient(shares * readings) * readings
        gap = float(slope.max() - shares @ slope)
        value = criterion.value(shares * readings)
        reached = criterion.least_efficiency(gap, value)
        if reached > efficiency:
            best, efficiency = shares, reached
        if efficiency >= 1 - _TOLERANCE:
            break
        # The first support has the best candidates of the even shares; others can join it later.
        least, joining = (2 / criterion.size, _FIRST) if round_ == 0 else (_NEGLIGIBLE, _JOINING)
        support = np.union1d(np.flatnonzero(shares > least), np.argsort(-slope)[:joining])
        on_support = shares[support]
        on_support = 0.9 * on_support / on_support.sum() + 0.1 / support.size
        result = _on_support(criterion.restricted(support), readings[support], on_support)
        shares = np.zeros(criterion.size)
        shares[support] = np.where(result > _NEGLIGIBLE, result, 0.0)
        shares /= shares.sum()
    return Shares(best, efficiency)


def _on_support(criterion: Determinant, readings: Float, start: Float) -> Float:
    """Optimal shares of a few candidates."""
    result = minimize(
        lambda s: -criterion.value(s * readings),
        start,
        jac=lambda s: -criterion.gradient(s * readings) * readings,
        bounds=[(0.0, 1.0)] * start.size,
        constraints=[
            {"type": "eq", "fun": lambda s: s.sum() - 1, "jac": lambda s: np.ones_like(s)}
        ],
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-12},
    )
    improved = np.clip(result.x, 0.0, None)
    improved /= improved.sum()
    return max(start, improved, key=lambda s: criterion.value(s * readings))


def whole_readings(criterion: Determinant, cost: Float, total: float, shares: Float) -> Whole:
    """Whole numbers of readings within the budget, from optimal shares by exchanges.

    Parameters
    ----------
    criterion : Determinant
    cost : array, shape (candidates,)
        Cost of a reading.
    total : float
        Budget.
    shares : array, shape (candidates,)
    """
    n = np.floor(shares * total / cost + 1e-9)
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
