"""Predictor-corrector continuation: the driver of all curves of solutions.

From a point of a curve the next one is predicted at a distance along it and corrected. A step
is accepted if the corrector has converged, the curve turns little and the corrected point lies near
the predicted point; otherwise a shorter step is tried. Subclasses of `Curves` say what is solved
and where a curve ends: branches of orbits in a parameter or in the amplitude, boundaries in the
plane of two parameters.

Source: E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods (2003),
chapters 2 and 6.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Float, Index

#: Factors on the length of a step after a failure, and after many corrector iterations.
_SHRINKAGE, _SLOWDOWN = 0.4, 0.7
#: Reasons why a curve is abandoned.
STUCK, STEPS = "stuck", "steps"


class StepControl(NamedTuple):
    """Criteria for accepting steps, and control of their length.

    Attributes
    ----------
    shortest, longest : float
        Length of a failed step below which a curve is abandoned, and the longest step.
    growth : float
        Factor on the length after a step that was easy to correct.
    easy, hard : int
        Iterations of the corrector up to which a step is easy, and above which it is hard.
    sharpest_turn : float
        A step whose tangent turns by a smaller cosine may have left its curve and is rejected.
    farthest : float
        A step further than this from the predicted point (in steps) is rejected, too.
    most_failures : int
        Number of consecutive failures after which a curve is abandoned.
    """

    shortest: float
    longest: float
    growth: float
    easy: int
    hard: int
    sharpest_turn: float
    farthest: float
    most_failures: int


class Attempt(NamedTuple):
    """Trial steps from the present points of curves, one entry for each curve.

    Attributes
    ----------
    next : object
        The new points, for `Curves.accept`.
    converged : bool array, shape (curves,)
    iterations : array, shape (curves,)
        Iterations of the corrector.
    turn : array, shape (curves,)
        Cosine of the angle between the tangents before and after.
    miss : array, shape (curves,)
        Distance of the corrected point from the predicted one, in steps.
    length : array, shape (curves,)
        Distance covered.
    """

    next: Any
    converged: Bool
    iterations: Float
    turn: Float
    miss: Float
    length: Float

    @classmethod
    def of_one(
        cls,
        point: Any,
        length: float,
        *,
        iterations: float = 0,
        turn: float = 1.0,
        miss: float = 0.0,
    ) -> Attempt:
        """The attempt of a single curve; `point` is None if the corrector failed."""
        numbers = (np.array([float(x)]) for x in (iterations, turn, miss, length))
        return cls(point, np.array([point is not None]), *numbers)


class Curves(ABC):
    """Curves that are followed together, each with its step length.

    Attributes
    ----------
    control : StepControl
    """

    control: StepControl

    def aimed(self, length: Float, failures: NDArray[np.int_]) -> Float:
        """Lengths of the next steps, from the proposed ones; negative lengths lead back.

        Parameters
        ----------
        length : array, shape (curves,)
        failures : int array, shape (curves,)
            Number of consecutive failures so far.
        """
        return length

    @abstractmethod
    def attempts(
        self, rows: Index, length: Float, failures: NDArray[np.int_]
    ) -> Iterable[tuple[Index, Attempt]]:
        """Try a step on each of the curves `rows`, in any number of parts.

        `length` and `failures` are of all curves.
        """

    @abstractmethod
    def accept(self, rows: Index, chosen: Index, attempt: Attempt) -> list[str]:
        """Move the curves `rows` to the entries `chosen` of an attempt.

        Returns
        -------
        list of str
            Reason why each curve ends there; empty if it continues.
        """


def follow(curves: Curves, length: Float, *, most: int | None = None) -> list[str]:
    """Follow curves until each has ended.

    Parameters
    ----------
    curves : Curves
        At the beginnings of the curves; `accept` moves them.
    length : array, shape (curves,)
        Length of the first steps.
    most : int, optional
        Largest number of steps of each curve, with failed ones.

    Returns
    -------
    list of str
        Why each curve ends: the reason from `accept`, `STUCK` where no step is short enough, or
        `STEPS` after `most` steps.
    """
    control, length = curves.control, np.array(length, float)
    failures = np.zeros(length.size, int)
    why = [""] * length.size
    going = np.arange(length.size)
    tried = 0
    while len(going) and (most is None or tried < most):
        tried += 1
        length = curves.aimed(np.minimum(length, control.longest), failures)
        for part, attempt in curves.attempts(going, length, failures):
            near = (attempt.turn > control.sharpest_turn) & (attempt.miss < control.farthest)
            good = attempt.converged & near
            chosen = np.flatnonzero(good)
            kept = part[chosen]
            ends = curves.accept(kept, chosen, attempt) if len(kept) else []
            for row, end in zip(kept, ends, strict=True):
                why[row] = end
            failures[part] = np.where(good, 0, failures[part] + 1)
            factor = np.where(
                attempt.iterations <= control.easy,
                control.growth,
                np.where(attempt.iterations <= control.hard, 1.0, _SLOWDOWN),
            )
            length[part] = np.where(good, factor * attempt.length, _SHRINKAGE * length[part])
        short = (failures > 0) & (np.abs(length) < control.shortest)
        for row in going[(short | (failures >= control.most_failures))[going]]:
            why[row] = STUCK
        going = np.array([row for row in going if not why[row]], int)
    for row in going:
        why[row] = STEPS
    return why
