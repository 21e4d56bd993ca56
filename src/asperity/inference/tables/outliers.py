"""Rows of a table that a fit does not describe, although it describes the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from asperity.inference.objective import Residuals

Float = NDArray[np.float64]

#: Probability, over all rows, that a row so far off is chance.
_CHANCE = 1e-4
#: Largest share of rows that may be outliers.
_MOST = 0.1
#: chi-squared of the rest must have at least this probability.
_DESCRIBED = 0.01
#: Largest change of a coordinate over which predictions count as linear.
_FARTHEST = 0.3


def outlying_rows(residuals: Residuals) -> list[int]:
    """Rows whose removal makes the fit good, worst first; none if there are no such few.

    Parameters
    ----------
    residuals : Residuals
        At the minimum, with the Jacobian to the coordinates of the fit.

    Notes
    -----
    Removing a row with residuals r and leverage H lowers chi-squared by r^T (1 - H)^-1 r, exactly
    if predictions are linear in the coordinates.
    """
    kept = np.ones(residuals.values.size, bool)
    # Residuals that the linear fit would have, which follow from those at the minimum. Coordinates
    # of other data are none of these.
    J, r = residuals.jacobian[:, residuals.jacobian.any(0)], residuals.values
    rows = np.unique(residuals.row)
    found: list[int] = []
    shift: Float = np.zeros(J.shape[1])
    for _ in range(max(1, int(_MOST * rows.size)) + 1):
        now = r[kept] + J[kept] @ shift
        dof = int(kept.sum()) - J.shape[1]
        if dof <= 0:
            return []
        if np.abs(shift).max(initial=0.0) > _FARTHEST:
            return []
        if chi2.sf(float(now @ now), dof) >= _DESCRIBED:
            return found
        drops = {
            row: _drop(now, J[kept], residuals.row[kept] == row) for row in rows if row not in found
        }
        worst = max(drops, key=lambda row: drops[row][0])
        drop, count = drops[worst]
        if chi2.sf(drop, count) * rows.size > _CHANCE:
            return []
        found.append(int(worst))
        kept &= residuals.row != worst
        shift = np.asarray(-np.linalg.lstsq(J[kept], r[kept], rcond=1e-12)[0])
    return []


def _drop(r: Float, J: Float, of_row: NDArray[np.bool_]) -> tuple[float, int]:
    """Decrease of chi-squared without a row, and the number of its data."""
    inverse = np.linalg.pinv(J.T @ J, hermitian=True)
    own = J[of_row]
    left = np.eye(own.shape[0]) - own @ inverse @ own.T
    part = r[of_row]
    return float(part @ np.linalg.pinv(left, hermitian=True) @ part), int(of_row.sum())


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
