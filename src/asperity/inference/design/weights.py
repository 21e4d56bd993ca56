"""Optimal shares of the budget, and whole readings from them.

Shares: the budget is a unit of readings or of time, each candidate's share is what is spent on it.
The candidate of the largest derivative joins the support, the shares on the support are optimised,
and so on, until the general equivalence theorem (Kiefer and Wolfowitz, 1960) says that no design
is better by more than the tolerance: a concave criterion exceeds its value at a design by at most
the largest derivative less the mean derivative of the design.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from asperity.inference.design.criteria import Criterion

Float = NDArray[np.float64]
Whole = NDArray[np.int64]

#: Largest part of the information of the best design that may be missing.
_TOLERANCE = 1e-3
_ROUNDS = 200
#: Shares below this are none.
_NEGLIGIBLE = 1e-5
#: Candidates that join the support at once.
_JOINING = 3
_MULTIPLICATIVE_STEPS = 200
#: Sweeps of exchanges of whole readings.
_SWEEPS = 30


@dataclass(frozen=True, eq=False)
class Shares:
    """Shares of the budget and how good they are.

    Attributes
    ----------
    shares : array, shape (candidates,)
        Sum 1.
    efficiency : float
        Share of the information of the best design that is reached at least.
    """

    shares: Float
    efficiency: float


def optimal_shares(criterion: Criterion, readings: Float, start: Float | None = None) -> Shares:
    """Shares of the budget that maximise a criterion.

    Parameters
    ----------
    criterion : Criterion
    readings : array, shape (candidates,)
        Readings of each candidate if it gets the whole budget.
    start : array, shape (candidates,), optional
        Shares to start from.
    """
    shares = np.full(criterion.size, 1 / criterion.size) if start is None else start
    best, efficiency = shares, 0.0
    reduced = False
    for _ in range(_ROUNDS):
        slope = criterion.gradient(shares * readings) * readings
        gap = float(slope.max() - shares @ slope)
        value = criterion.value(shares * readings)
        reached = criterion.least_efficiency(gap, value)
        if reached > efficiency:
            best, efficiency = shares, reached
        if efficiency >= 1 - _TOLERANCE:
            break
        if not reduced:
            # The best candidates of the even start; the rest comes back if it is needed.
            few = min(criterion.size, 60)
            support = np.union1d(
                np.argsort(-slope)[:few], np.flatnonzero(shares > 2 / criterion.size)
            )
            reduced = True
        else:
            support = np.flatnonzero(shares > _NEGLIGIBLE)
            support = np.union1d(support, np.argsort(-slope)[:_JOINING])
        on_support = np.where(shares[support] > 0, shares[support], 0.0)
        on_support = 0.9 * on_support / max(on_support.sum(), 1e-300) + 0.1 / support.size
        found = _on_support(criterion.restricted(support), readings[support], on_support)
        shares = np.zeros(criterion.size)
        shares[support] = np.where(found > _NEGLIGIBLE, found, 0.0)
        shares /= shares.sum()
    return Shares(best, efficiency)


def _on_support(criterion: Criterion, readings: Float, start: Float) -> Float:
    """Optimal shares of a few candidates."""
    # Multiplicative steps always improve a little; the quadratic method finishes.
    shares = start
    for _ in range(_MULTIPLICATIVE_STEPS // 10):
        shares = _multiplied(criterion, readings, shares)
    found = minimize(
        lambda s: -criterion.value(s * readings),
        shares,
        jac=lambda s: -criterion.gradient(s * readings) * readings,
        bounds=[(0.0, 1.0)] * shares.size,
        constraints=[
            {"type": "eq", "fun": lambda s: s.sum() - 1, "jac": lambda s: np.ones_like(s)}
        ],
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-12},
    )
    improved = np.clip(found.x, 0.0, None)
    if np.isfinite(improved).all() and improved.sum() > 0:
        improved /= improved.sum()
        if criterion.value(improved * readings) >= criterion.value(shares * readings):
            return np.asarray(improved)
    for _ in range(_MULTIPLICATIVE_STEPS):
        shares = _multiplied(criterion, readings, shares)
    return shares


def _multiplied(criterion: Criterion, readings: Float, shares: Float) -> Float:
    """A multiplicative step (Silvey, Titterington and Torsney, 1978)."""
    slope = np.maximum(criterion.gradient(shares * readings) * readings, 0.0)
    grown = shares * np.sqrt(slope)
    return grown / grown.sum() if grown.sum() > 0 else shares


def whole_readings(criterion: Criterion, cost: Float, total: float, shares: Float) -> Whole:
    """Whole numbers of readings within the budget, from optimal shares by exchanges.

    Parameters
    ----------
    criterion : Criterion
    cost : array, shape (candidates,)
        Of a reading.
    total : float
        What may be spent.
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


def _filled(criterion: Criterion, cost: Float, total: float, n: Float) -> Float:
    """Readings added one by one, each where it gains most for its cost, until none fits."""
    n = n.copy()
    while True:
        left = total - float(n @ cost)
        fits = cost <= left
        if not fits.any():
            return n
        gain = np.where(fits, (criterion.exchanged(n) - criterion.value(n)) / cost, -math.inf)
        n[int(np.argmax(gain))] += 1
