"""Crossings of the stability boundary, ln|m| = 0, with lines through a plane of operating points.

Many lines are searched together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import elementwise

from asperity.arrays import Bool, Float, Index
from asperity.study.points import Answers

#: Accuracy of the position of a crossing, in fractions of an axis.
TOLERANCE = 1e-6
#: ln|m| jumps over zero, and does not cross it, where |ln|m|| at the end of the search exceeds this
#: fraction of the difference of ln|m| between the ends of the line. A crossing leaves about
#: `TOLERANCE` over the length of the line, less than this on every line longer than 1e-4.
_JUMP = 1e-2

#: Outputs that a search for crossings needs.
STABILITY = ("log_multiplier", "multiplier_argument")


@dataclass
class Crossings:
    """Points of a stability boundary.

    Attributes
    ----------
    where : array, shape (points, 2)
        Fractions of the axes; the last position of the search where no crossing is located.
    points : Answers
        Responses at `where`.
    located : bool array, shape (points,)
    reason : object array, shape (points,)
        "converged", or why there is no crossing.
    """

    where: Float
    points: Answers
    located: Bool
    reason: NDArray[np.object_]


def find_crossings(
    solve: Callable[[Float], Answers], start: Float, end: Float, g0: Float, g1: Float
) -> Crossings:
    """Locate the change of stability on each line from `start` to `end`.

    Chandrupatla's method (1997): inverse quadratic interpolation, and bisection where that is not
    safe. ln|m| is continuous, with a kink where another multiplier becomes the leading one.

    Parameters
    ----------
    solve : callable
        Responses at positions on the plane, shape (points, 2), with the outputs `STABILITY`.
    start, end : array, shape (lines, 2)
        Fractions of the axes.
    g0, g1 : array, shape (lines,)
        ln|m| at the ends, of opposite signs.
    """
    lines = np.arange(len(start))
    if not len(lines):
        return Crossings(start, solve(start), np.zeros(0, bool), np.empty(0, object))
    length = np.hypot(*(end - start).T)
    failure = np.full(len(start), "no change of sign", dtype=object)

    def at(s: Float, line: Index) -> Float:
        return np.asarray(start[line] + (s / length[line])[:, None] * (end - start)[line])

    def log_multiplier(s: Float, index: Float) -> Float:
        line = index.astype(int)
        g = np.where(s == 0, g0[line], g1[line])
        inside = (s != 0) & (s != length[line])
        answers = solve(at(s[inside], line[inside]))
        g[inside] = answers["log_multiplier"]
        failed = ~answers.converged
        failure[line[inside][failed]] = answers.take(failed).result
        return g

    root = elementwise.find_root(
        log_multiplier,
        (np.zeros(len(start)), length),
        args=(lines.astype(float),),
        tolerances={"xatol": TOLERANCE, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0},
    )
    where = at(np.asarray(root.x), lines)
    points = solve(where)
    reason = points.result
    with np.errstate(invalid="ignore"):
        jumps = points.converged & (np.abs(points["log_multiplier"]) > _JUMP * np.abs(g1 - g0))
    reason[jumps] = "the response jumps here: its branch folds away, or two branches meet"
    for line in np.flatnonzero(~root.success):
        reason[line] = f"a point on the way to the crossing has no response: {failure[line]}"
    return Crossings(where, points, points.converged & root.success & ~jumps, reason)
