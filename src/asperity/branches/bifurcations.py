"""Bifurcations of periodic orbits on a branch: detection, kind and location.

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

from asperity.branches.follower import BranchFollower, BranchOrbit
from asperity.orbit.floquet import FOLD, kind_of_crossing

Kind = Literal["fold", "period doubling", "Neimark-Sacker", "branch point"]

#: Arguments of multipliers below this, or this close to pi, count as real.
_REAL = 1e-6


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
) -> Iterator[LocatedBifurcation | None]:
    """All bifurcations between two neighbouring orbits.

    None for those that are not located, because Newton's method fails between the orbits.
    """
    before, after = start.unstable, end.unstable
    turned = start.direction * end.direction < 0
    if turned:
        index = min(before, after) if before != after else 0
        critical_orbit = follower.crossing(start, criterion("fold", index), (length, end))
        if critical_orbit is None:
            yield None
        else:
            yield LocatedBifurcation("fold", critical_orbit, index, before, after)
    index, last = min(before, after), max(before, after)
    while index < last:
        critical_orbit = follower.crossing(start, criterion(None, index), (length, end))
        if critical_orbit is None:
            yield None
            return
        kind = kind_of(critical_orbit.logs[index])
        if kind == "branch point" and turned:
            index += 1  # the multiplier of the fold itself
            continue
        width = 2 if kind == "Neimark-Sacker" else 1
        near, far = (index, index + width) if before < after else (index + width, index)
        yield LocatedBifurcation(kind, critical_orbit, index, near, far)
        index += width


def kind_of(log: complex) -> Kind:
    """Bifurcation of a multiplier on the unit circle; "branch point" where it is +1."""
    (kind,) = kind_of_crossing(np.array([log]), real=_REAL)
    return "branch point" if kind == FOLD else kind


def criterion(kind: Kind | None, index: int) -> Callable[[BranchOrbit], float]:
    """The test function of a bifurcation, which vanishes there.

    It is the direction of a fold, and otherwise ln|m| of the multiplier of this index.
    """
    if kind == "fold":
        return lambda orbit: orbit.direction
    return lambda orbit: float(orbit.logs[index].real)
