"""Where ln|m| of the leading multiplier passes zero on straight lines, all of them at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import elementwise

from asperity.study.outcome import Answers
from asperity.study.points import Float

#: Accuracy of the position of a crossing, in fractions of an axis.
TOLERANCE = 1e-6
_MOST_STEPS = 60
#: Where |ln|m|| at the crossing exceeds this fraction of its difference between the ends of the
#: line, ln|m| does not pass through zero but jumps over it.
_JUMP = 1e-2


#: Outputs that a search for crossings needs.
STABILITY = ("log_multiplier", "multiplier_argument")


class ResponseSource(Protocol):
    """Anything that solves responses at positions, shape (points, 2), such as a `MapPlane`."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """What each answer holds, `STABILITY` among it."""
        ...

    def solve(self, where: Float) -> Answers:
        """The responses."""
        ...


@dataclass
class Crossings:
    """Points of a stability boundary.

    Attributes
    ----------
    where : array, shape (points, 2)
        Fractions of the axes; of a crossing that was not located, where the search ended.
    points : Answers
        The responses there.
    located : bool array, shape (points,)
    reason : object array, shape (points,)
        "converged", or why there is no crossing.
    """

    where: Float
    points: Answers
    located: NDArray[np.bool_]
    reason: NDArray[np.object_]


def find_crossings(
    plane: ResponseSource, start: Float, end: Float, g0: Float, g1: Float
) -> Crossings:
    """Locate the change of stability on each line from `start` to `end`.

    Chandrupatla's method (1997): inverse quadratic interpolation, and bisection where that is not
    safe. ln|m| is continuous also where another multiplier takes the lead, and has kinks there.

    Parameters
    ----------
    plane : ResponseSource
    start, end : array, shape (lines, 2)
        Fractions of the axes.
    g0, g1 : array, shape (lines,)
        ln|m| at the ends, of opposite signs.
    """
    lines = _SearchLines(plane, start, end, g0, g1)
    if not len(start):
        return Crossings(start, lines.points, np.zeros(0, bool), np.empty(0, object))
    root = elementwise.find_root(
        lines.log_multiplier,
        (np.zeros(len(start)), lines.length),
        args=(np.arange(len(start), dtype=float),),
        tolerances={"xatol": TOLERANCE, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0},
        maxiter=_MOST_STEPS,
    )
    lines.solve_at(root.x)
    points = lines.points
    with np.errstate(invalid="ignore"):
        jumps = points.converged & (np.abs(points["log_multiplier"]) > _JUMP * np.abs(g1 - g0))
    lost = np.flatnonzero(~root.success)
    reason = points.result
    reason[jumps] = "the response jumps here: its branch folds away, or two branches meet"
    reason[lost] = [f"the search for the crossing met a point without response: {lines.failure[i]}"
                    for i in lost]  # fmt: skip
    return Crossings(lines.where, points, points.converged & root.success & ~jumps, reason)


class _SearchLines:
    """Straight lines, and on each the solved point with the smallest |ln|m||."""

    def __init__(
        self, plane: ResponseSource, start: Float, end: Float, g0: Float, g1: Float
    ) -> None:
        self.plane, self.start, self.way = plane, start, end - start
        self.length = np.hypot(self.way[:, 0], self.way[:, 1])
        self.g0, self.g1 = g0, g1
        self.points = Answers.empty(plane.outputs, len(start))
        self.nearest = np.where(np.abs(g0) < np.abs(g1), 0.0, self.length)
        self.failure = np.full(len(start), "no change of sign", dtype=object)

    @property
    def where(self) -> Float:
        """Fractions of the axes of the nearest points."""
        return self.start + (self.nearest / self.length)[:, None] * self.way

    def log_multiplier(self, s: Float, index: Float) -> Float:
        """ln|m| at the distances `s` along the lines `index`."""
        i = index.astype(int)
        g = np.where(s == 0, self.g0[i], self.g1[i])
        inside = (s != 0) & (s != self.length[i])
        i, s = i[inside], s[inside]
        answers = self.plane.solve(self.start[i] + (s / self.length[i])[:, None] * self.way[i])
        g[inside] = answers["log_multiplier"]
        failed = ~answers.converged
        self.failure[i[failed]] = answers.take(failed).result
        known = np.where(self.points.converged[i], np.abs(self.points["log_multiplier"][i]), np.inf)
        nearer = np.flatnonzero(answers.converged & (np.abs(answers["log_multiplier"]) < known))
        self.points.put(i[nearer], answers.take(nearer))
        self.nearest[i[nearer]] = s[nearer]
        return g

    def solve_at(self, s: Float) -> None:
        """Solve at the distances `s`, where that is not done yet."""
        index = np.flatnonzero(~self.points.converged | (self.nearest != s))
        self.nearest = np.asarray(s, dtype=float)
        self.points.put(index, self.plane.solve(self.where[index]))
