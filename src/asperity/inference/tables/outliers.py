"""Rows of a table that a fit does not describe, although it describes the others."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from functools import partial

import numpy as np
from scipy.special import chdtrc

from asperity.arrays import Float
from asperity.inference.objective import Residuals

#: Probability, over all rows, that a row so far off is chance.
_CHANCE = 1e-4
#: Most rows that may be outliers, as a share of the rows; two in any case where each leaves so many
#: others.
_SHARE, _OTHERS_EACH = 0.1, 3
#: chi-squared of the other rows must have at least this probability.
_DESCRIBED = 0.01
#: Largest change of a coordinate over which predictions count as linear.
_FARTHEST = 0.3
#: Reweighted fits towards the sum of distances, and fits to the rows that are nearest, at most.
_REWEIGHTED, _CONCENTRATED = 6, 8

#: Share that chi-squared of the nearest rows must fall to in a reweighted fit while its probability
#: is below the second number.
_FALLING, _FAR_OFF = 0.8, 1e-12

#: Residuals of a table at the minimum of chi-squared of its rows with weights; residuals of priors
#: follow as row -1. None without a solution. Weights multiply the residuals, shape (rows,).
Refit = Callable[[Float], Residuals | None]


def outlying_rows(residuals: Residuals, refit: Refit | None = None) -> list[int]:
    """Rows whose removal makes the fit good, worst first; none if there are no such few.

    Parameters
    ----------
    residuals : Residuals
        At the minimum, with the Jacobian to the coordinates of the fit.
    refit : callable, optional
        By default with predictions that are linear in the coordinates.

    Notes
    -----
    Outliers hide each other from a search that removes one row at a time: each pulls the fit to
    itself. Here the fit is first one to the sum of the distances of the rows, in which an outlier
    pulls no more than any other row, and then, until they stay the same, to the rows that are
    nearest to it, as many as there may be without outliers (least trimmed squares; Rousseeuw and
    Van Driessen, Data Min. Knowl. Discov. 12, 29, 2006). Of the others those are outliers that the
    fit without them predicts far off, r^T (1 + H)^-1 r with its uncertainty H.
    """
    rows = np.unique(residuals.row[residuals.row >= 0])
    most = max(1, int(_SHARE * rows.size), min(2, rows.size // (1 + _OTHERS_EACH)))
    if not _p_value(residuals, ()) < _DESCRIBED:
        return []
    refit = refit or partial(_linear_refit, residuals)

    def fitted(weights: Float) -> Residuals:
        result = refit(weights)
        if result is None:
            raise _NoFitError
        return result

    def farthest_of(some: Residuals) -> set[int]:
        return set(rows[np.argsort(-row_distances(some)[rows])[:most]].tolist())

    try:
        now, apart = residuals, _chi2(residuals, farthest_of(residuals))
        for _ in range(_REWEIGHTED):
            now = fitted(np.maximum(row_distances(now), 1.0) ** -0.5)
            before, apart = apart, _chi2(now, farthest_of(now))
            if apart > _FALLING * before and _p_value(now, farthest_of(now)) < _FAR_OFF:
                # The law is wrong for most rows, and comes no nearer to them.
                return []
        out: set[int] = set()
        for _ in range(_CONCENTRATED):
            farthest = farthest_of(now)
            if farthest == out:
                break
            out = farthest
            now = fitted(_without(residuals, out))
        while near := {row for row in out if _chance(now, row, out) * rows.size > _CHANCE}:
            out -= near
            now = fitted(_without(residuals, out))
    except _NoFitError:
        return []
    if not _p_value(now, out) >= _DESCRIBED:
        return []
    return sorted(out, key=lambda row: -row_distances(now)[row])


class _NoFitError(Exception):
    """The law has no solution with the rows that are left."""


def _linear_refit(residuals: Residuals, weights: Float) -> Residuals | None:
    """Residuals where predictions are linear in the coordinates; None too far for that."""
    # Coordinates of other data are none of the table's.
    J = residuals.jacobian[:, residuals.jacobian.any(0)]
    w = weights[residuals.row]
    shift = -np.linalg.lstsq(w[:, None] * J, w * residuals.values, rcond=1e-12)[0]
    if np.abs(shift).max(initial=0.0) > _FARTHEST:
        return None
    return residuals._replace(values=residuals.values + J @ shift, jacobian=J)


def row_distances(residuals: Residuals) -> Float:
    """Root mean square of the residuals of each row; 0 of one without any."""
    of_rows = residuals.row >= 0
    row = residuals.row[of_rows]
    squares = np.bincount(row, residuals.values[of_rows] ** 2)
    return np.asarray(np.sqrt(squares / np.maximum(np.bincount(row), 1)))


def _without(residuals: Residuals, out: Collection[int]) -> Float:
    """Weights that leave rows out."""
    weights = np.ones(residuals.row.max() + 1)
    weights[list(out)] = 0.0
    return weights


def _p_value(residuals: Residuals, out: Collection[int]) -> float:
    """Probability of chi-squared of the rows that are kept; NaN without degrees of freedom."""
    kept = ~np.isin(residuals.row, list(out))
    dof = int(kept.sum()) - int(residuals.jacobian.any(0).sum())
    return float(chdtrc(dof, _chi2(residuals, out))) if dof > 0 else math.nan


def _chi2(residuals: Residuals, out: Collection[int]) -> float:
    """chi-squared of the rows that are kept."""
    return float(np.sum(residuals.values[~np.isin(residuals.row, list(out))] ** 2))


def _chance(residuals: Residuals, row: int, out: Collection[int]) -> float:
    """Probability that a row is as far from what those that are kept predict."""
    kept, here = ~np.isin(residuals.row, list(out)), residuals.row == row
    J = residuals.jacobian
    size = np.sqrt(np.sum(J**2, axis=0))
    J = J / np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(J[kept].T @ J[kept], hermitian=True)
    spread = np.eye(int(here.sum())) + J[here] @ inverse @ J[here].T
    away = residuals.values[here]
    return float(chdtrc(away.size, away @ np.linalg.solve(spread, away)))


def standardised(residuals: Residuals, information: Float) -> Float:
    """Residuals over their own standard deviations at the minimum, shape (n,).

    A reading that the fit follows has a small residual; over sqrt(1 - leverage) it shows.

    Parameters
    ----------
    residuals : Residuals
    information : array, shape (coordinates, coordinates)
        Of all data and priors of the fit: what other data know, the fit does not follow here.
    """
    J = residuals.jacobian
    size = np.sqrt(np.diag(information))
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(information / np.outer(size, size), hermitian=True)
    leverage = np.einsum("ij,jk,ik->i", J / size, inverse, J / size)
    return np.asarray(residuals.values / np.sqrt(np.maximum(1 - leverage, 1e-6)))
