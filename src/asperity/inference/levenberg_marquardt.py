"""Levenberg-Marquardt along narrow curved valleys of chi-squared.

A datum that is known far better than the others confines the parameters to a surface. A straight
step soon leaves it, so that steps must be a small share of the way. Here the damped step d is the
predictor, and steps

    c = -J^+ (r(u + d) - r(u) - J d)

lead back to the surface, r the residuals and J^+ the damped inverse of their Jacobian at the end of
the last step: the first one is the geodesic acceleration of Transtrum and Sethna.

Source: M. K. Transtrum, J. P. Sethna, arXiv:1201.5885 (2012).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asperity.arrays import Float

#: Damping at the beginning, factors after a step that was taken and one that was not, and the
#: damping from which no step is left.
_FIRST, _LESS, _MORE, _LAST = 1e-2, 0.1, 10.0, 1e8
#: Corrections of a step, at most; the longest over the step; and the share of the decrease of the
#: linear model that needs none (Transtrum and Sethna, section 3).
_CORRECTIONS, _LONGEST, _SHARE = 3, 0.75, 0.25
#: Decrease of the sum of squares that is none: a hundredth of a standard error, squared.
_DECREASE = 1e-4


def minimised(
    residuals: Callable[[Float], tuple[Float, Float]],
    u: Float,
    low: Float,
    high: Float,
    evaluations: int,
) -> Float:
    """Where a sum of squares in which unit residuals are standard errors has its minimum.

    Parameters
    ----------
    residuals : callable
        Residuals (m,) and their Jacobian (m, n) at coordinates; not finite where there are none.
    u : array, shape (n,)
        Where it begins, with finite residuals.
    low, high : array, shape (n,)
        Bounds, which u stays within.
    evaluations : int
        Number of calls of `residuals` after which no further step is begun.
    """
    r, J = residuals(u)
    scale = np.linalg.norm(J, axis=0)
    damping, used = _FIRST, 1

    def damped(side: Float, slopes: Float) -> Float:
        """Change of the coordinates that makes up for residuals."""
        matrix = np.vstack([slopes, np.sqrt(damping) * np.diag(scale)])
        right = np.concatenate([-side, np.zeros(u.size)])
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])

    while used < evaluations and damping < _LAST:
        scale = np.maximum(scale, np.linalg.norm(J, axis=0))
        # Without damping, and without the coordinates that a bound holds.
        free = np.where(J.T @ r > 0, u > low, u < high)
        if np.sum((np.linalg.qr(J[:, free])[0].T @ r) ** 2) < _DECREASE:
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
