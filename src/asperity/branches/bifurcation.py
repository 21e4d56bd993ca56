"""Bifurcations of periodic orbits: their kinds, and their location on a branch.

At a fold a branch turns back in the parameter and a multiplier passes +1; at a period doubling one
passes -1; at a Neimark-Sacker bifurcation a complex pair passes the unit circle, and a slow
oscillation grows on top of the modulation. Each has a test function along the arclength whose
zero is located by Brent's method: the direction of the parameter for folds, ln|m| for the others.

Source: Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, chapters 4, 5 and 10;
R. Seydel, Practical Bifurcation and Stability Analysis, chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple

import numpy as np

from asperity.branches.steps import BranchFollower, BranchOrbit

Kind = Literal["fold", "period doubling", "Neimark-Sacker", "branch point"]

#: Arguments of multipliers below this, or this close to pi, count as real.
_REAL = 1e-6
#: Secant steps that carry a bifurcation over to a finer mesh, and their tolerance on t.
_SECANT_STEPS = 12
_TOLERANCE = 1e-12
#: Largest last secant step that is attributed to round-off.
_STALLED = 1e-9


class LocatedBifurcation(NamedTuple):
    """A bifurcation on a branch.

    Attributes
    ----------
    kind : str
    branch_orbit : BranchOrbit
    critical : int
        Which multiplier, by falling modulus, is critical.
    before, after : int
        Unstable multipliers on the two sides, along the branch.
    """

    kind: Kind
    branch_orbit: BranchOrbit
    critical: int
    before: int
    after: int


def bifurcations_between(
    follower: BranchFollower, start: BranchOrbit, length: float, end: BranchOrbit
) -> Iterator[LocatedBifurcation]:
    """All bifurcations between two neighbouring orbits."""
    before, after = start.unstable, end.unstable
    turned = start.direction * end.direction < 0
    if turned:
        index = min(before, after) if before != after else 0
        crossing = follower.crossing(start, length, _direction)
        if crossing is not None:
            yield LocatedBifurcation("fold", crossing[0], index, before, after)
    index, last = min(before, after), max(before, after)
    while index < last:
        crossing = follower.crossing(start, length, _log_modulus(index))
        if crossing is None:
            return
        critical_orbit, _ = crossing
        kind = kind_of(critical_orbit.logs[index])
        if kind == "branch point" and turned:
            index += 1  # the multiplier of the fold itself
            continue
        width = 2 if kind == "Neimark-Sacker" else 1
        near, far = (index, index + width) if before < after else (index + width, index)
        yield LocatedBifurcation(kind, critical_orbit, index, near, far)
        index += width


def kind_of(log: complex) -> Kind:
    """Bifurcation of a multiplier on the unit circle."""
    angle = abs(np.angle(np.exp(1j * log.imag)))
    if angle < _REAL:
        return "branch point"
    return "period doubling" if np.pi - angle < _REAL else "Neimark-Sacker"


def criterion(kind: Kind, index: int) -> Callable[[BranchOrbit], float]:
    """The test function of a bifurcation, which vanishes there."""
    return _direction if kind == "fold" else _log_modulus(index)


def _direction(branch_orbit: BranchOrbit) -> float:
    return branch_orbit.direction


def _log_modulus(index: int) -> Callable[[BranchOrbit], float]:
    return lambda branch_orbit: float(branch_orbit.logs[index].real)


def polished(
    follower: BranchFollower, located: LocatedBifurcation, intervals: int
) -> BranchOrbit | None:
    """The bifurcation located again on a mesh of `intervals`, by the secant method."""
    return root_near(
        follower,
        follower.finer(located.branch_orbit.point, intervals),
        criterion(located.kind, located.critical),
    )


def root_near(
    follower: BranchFollower, start: BranchOrbit | None, function: Callable[[BranchOrbit], float]
) -> BranchOrbit | None:
    """The orbit near `start` on its branch at which `function` vanishes; None on failure."""
    if start is None:
        return None
    before, value_before = 0.0, function(start)
    distance, branch_orbit = 1e-4, start
    for _ in range(_SECANT_STEPS):
        now, _ = follower.step(start.point, distance)
        if now is None:
            return None
        branch_orbit, value = now, function(now)
        if value == value_before:
            return branch_orbit
        change = -value * (distance - before) / (value - value_before)
        before, value_before = distance, value
        distance += change
        if abs(change) < _TOLERANCE:
            return branch_orbit
        if abs(change) > 1.0:
            return None
    return branch_orbit if abs(change) < _STALLED else None
