"""Levenberg-Marquardt along narrow curved valleys of chi-squared.

A datum with a much smaller uncertainty than the others confines the parameters to a curved surface.
A straight step leaves this surface, so that only short steps reduce chi-squared. Here the damped
step d is a predictor, and corrections

    c = -J^+ (r(u + d) - r(u) - J d)

lead back to the surface, with the residuals r and the damped inverse J^+ of their Jacobian at the
end of the last step. The first correction is the geodesic acceleration of Transtrum and Sethna.

Source: M. K. Transtrum, J. P. Sethna, arXiv:1201.5885 (2012).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asperity.arrays import Float

#: First damping, its factors after an accepted and after a rejected step, and the damping at which
#: the minimisation ends.
_FIRST, _LESS, _MORE, _LAST = 1e-2, 0.1, 10.0, 1e8
#: Largest number of corrections of a step; largest length of a correction over that of the step;
#: and the share of the predicted decrease at which no correction is needed (Transtrum and Sethna,
#: section 3).
_CORRECTIONS, _LONGEST, _SHARE = 3, 0.75, 0.25
#: Smaller decreases of the sum of squares are negligible: the square of a hundredth of a standard
#: error.
_DECREASE = 1e-4
#: Columns of a Jacobian are dependent if a combination of them, each over its largest element, is
#: shorter than this share of the longest: orbits are no more accurate. It would be a direction of
#: noise, along which residuals do not fall.
_DEPENDENT = 1e-8
#: A coordinate closer to its bound than this is at the bound.
AT_BOUND = 1e-6


def predicted_decrease(r: Float, J: Float, u: Float, low: Float, high: Float) -> float:
    """Decrease of the sum of squares by an undamped step, for residuals that are linear.

    The step may be of any length, but for coordinates that a bound stops.

    Parameters
    ----------
    r : array, shape (m,)
        Residuals.
    J : array, shape (m, n)
        Their Jacobian.
    u : array, shape (n,)
        Coordinates.
    low, high : array, shape (n,)
        Bounds of u.
    """
    free = np.where(J.T @ r > 0, u - low, high - u) > AT_BOUND
    J = J[:, free & J.any(axis=0)]
    J = J / np.abs(J).max(axis=0)
    return float(np.sum((J @ np.linalg.lstsq(J, r, rcond=_DEPENDENT)[0]) ** 2))


def minimised(
    residuals: Callable[[Float], tuple[Float, Float]],
    u: Float,
    low: Float,
    high: Float,
    evaluations: int,
) -> Float:
    """The minimum of a sum of squares of residuals that are in units of standard errors.

    Parameters
    ----------
    residuals : callable
        Residuals (m,) and their Jacobian (m, n) at coordinates; NaN without a solution.
    u : array, shape (n,)
        Start, with finite residuals.
    low, high : array, shape (n,)
        Bounds of u.
    evaluations : int
        Number of calls of `residuals` after which no further step is begun.
    """
    r, J = residuals(u)
    scale = np.linalg.norm(J, axis=0)
    damping, used = _FIRST, 1

    def damped(side: Float, slopes: Float) -> Float:
        """Damped change of the coordinates that compensates residuals."""
        matrix = np.vstack([slopes, np.sqrt(damping) * np.diag(scale)])
        right = np.concatenate([-side, np.zeros(u.size)])
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])

    while used < evaluations and damping < _LAST:
        scale = np.maximum(scale, np.linalg.norm(J, axis=0))
        if predicted_decrease(r, J, u, low, high) < _DECREASE:
            break
        step = np.clip(u + damped(r, J), low, high) - u
        target = r + J @ step
        expected = float(r @ r - target @ target)
        length = _LONGEST * np.linalg.norm(scale * step)
        point, lower = u + step, False
        for left in reversed(range(_CORRECTIONS + 1)):
            at, slopes = residuals(point)
            used += 1
            if not np.isfinite(at).all():
                break
            decrease = float(r @ r - at @ at)
            lower = decrease > 0
            if decrease > _SHARE * expected or not left:
                break
            back = np.clip(point + damped(at - target, slopes), low, high) - point
            if np.linalg.norm(scale * back) > length:
                break
            point = point + back
        if lower:
            u, r, J = point, at, slopes
        damping *= _LESS if lower else _MORE
    return u
