"""Outcome of the solve of an operating point, as a code and as a sentence."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Float


class Outcome(IntEnum):
    """Outcome of a periodic solve.

    FOLDED, RUNAWAY, RESTS, REVERSES and SENSITIVE are results, not failures of a method: the branch
    of orbits that begins with steady sliding does not reach the requested amplitude, or reaches it
    only through orbits that no computation and no experiment could stay on. Orbits that are not
    connected to steady sliding may exist. OUT_OF_RANGE is given without a search. CONVERGED
    with a negative `detail`, the reversal margin, means that slip would reverse on the orbit.
    """

    CONVERGED = 0
    NO_ORBIT = 1
    NOT_RESOLVED = 2
    MULTIPLIERS_NOT_RESOLVED = 3
    FOLDED = 4
    RUNAWAY = 5
    SENSITIVE = 6
    INVALID = 7
    OUT_OF_RANGE = 8
    RESTS = 9
    REVERSES = 10


#: Smallest and largest rate of a disturbance of steady sliding, per radian of the modulation, at
#: which orbits are searched for. Below, multipliers are 1 to round-off, which then decides on
#: stability; above, round-off of the slip rate is as large as the rate of change of the force.
SMALLEST_RATE, LARGEST_RATE = 1e-9, 1e15
#: Exponent of the growth of a disturbance by which the error of a mesh, 1e-6 or less, becomes as
#: large as the orbit.
LARGEST_GROWTH = 15.0
#: Largest share of W0 by which the load may decrease: epsilon, for a harmonic load.
LARGEST_UNLOADING = 0.999

#: Outcomes of a branch from steady sliding without an orbit; another branch may have one.
WITHOUT_ORBIT = (
    Outcome.NO_ORBIT,
    Outcome.FOLDED,
    Outcome.RUNAWAY,
    Outcome.SENSITIVE,
    Outcome.RESTS,
    Outcome.REVERSES,
)

_SENTENCES = {
    Outcome.CONVERGED: "converged",
    Outcome.NO_ORBIT: (
        "no periodic orbit found: followed from steady sliding the branch stops at "
        "{detail:.4g} of the requested amplitude; see with asperity.transient whether the motion "
        "becomes periodic, lower epsilon, or stiffen the spring"
    ),
    Outcome.NOT_RESOLVED: (
        "an orbit was found but not resolved: refining the mesh still changes it by {detail:.1e} "
        "relative, above 1e-8"
    ),
    Outcome.MULTIPLIERS_NOT_RESOLVED: (
        "the orbit is resolved but its Floquet multipliers are not: refining the mesh "
        "still changes them by {detail:.1e} relative, above 1e-8"
    ),
    Outcome.FOLDED: (
        "the branch from steady sliding folds back at epsilon = {detail:.3g}, below the requested "
        "amplitude; lower epsilon or stiffen the spring"
    ),
    Outcome.RUNAWAY: (
        "on the branch from steady sliding the slip velocity grows without bound: before epsilon = "
        "{detail:.3g} its pulses exceed e^13 V, which inertia or radiation damping would limit; "
        "lower epsilon or include one of them"
    ),
    Outcome.SENSITIVE: (
        "the branch from steady sliding is lost at epsilon = {detail:.3g}: sliding is so unstable "
        "for part of the period that a disturbance grows by more than e^15, so that no computation "
        "and no experiment can follow it; lower epsilon or stiffen the spring"
    ),
    Outcome.RESTS: (
        "on the branch from steady sliding the slider comes to rest once a period from epsilon = "
        "{detail:.3g} on, where its velocity has no logarithm: inertia without elastic asperities "
        "takes it as a state; lower epsilon, leave inertia out, or take a law that is smooth at "
        "rest, such as 'regularised', whose motion asperity.transient follows through rest"
    ),
    Outcome.REVERSES: (
        "on the branch from steady sliding the interface force vanishes once a period from epsilon "
        "= {detail:.3g} on, and slip would reverse, for which this law is not defined; lower "
        "epsilon, leave inertia out, or take a law that is smooth at rest, such as 'regularised', "
        "whose motion asperity.transient follows through rest"
    ),
    Outcome.INVALID: ("a parameter breaks its rule; keep every parameter in its range"),
}

_REVERSED = (
    "converged, but slip would reverse for part of the period, under a negative interface force, "
    "and this law slips forwards only: the numbers are those of its equations as they stand"
)

_GROUP = (
    "the rate of steady sliding per radian, about the larger of V/(omega D0) and V K/(omega W0 A),"
)
#: Sentences of points out of range.
_UNLOADED = (
    "not searched: epsilon (the largest share of W0 taken off the contacts) must be at most "
    f"{LARGEST_UNLOADING:g}, got {{detail:.9g}}; lower epsilon"
)
_TOO_FAST = (
    f"not searched: {_GROUP} must be at least {SMALLEST_RATE:g}, got {{detail:.3g}}; lower the "
    "frequency, or take the limit of fast modulation, averaged_response"
)
_TOO_SLOW = (
    f"not searched: {_GROUP} must be at most {LARGEST_RATE:g}, got {{detail:.3g}}; raise the "
    "frequency or lower the velocity"
)
_NO_RATE = (
    f"not searched: {_GROUP} must be a finite number, got {{detail}}; bring the velocity "
    "nearer to V0"
)

#: Outcomes without an attempt to follow a branch.
_NOT_FOUND = (
    "no method found a periodic orbit; allow all methods, lower epsilon or stiffen the spring"
)
_LOST = (
    "an orbit was found on a coarse mesh but lost on every finer one, so it may not exist; "
    "lower epsilon or stiffen the spring"
)


def sentence(outcome: int, detail: float) -> str:
    """The sentence of an outcome with its number."""
    if outcome == Outcome.NOT_RESOLVED and not math.isfinite(detail):
        return _LOST
    if outcome == Outcome.NO_ORBIT and detail == 0:
        return _NOT_FOUND
    if outcome == Outcome.CONVERGED and detail < 0:
        return _REVERSED
    if outcome == Outcome.OUT_OF_RANGE:
        return _out_of_range(detail).format(detail=detail)
    return _SENTENCES[Outcome(outcome)].format(detail=detail)


def _out_of_range(detail: float) -> str:
    """Which limit the number breaks: rates out of range are far from shares of the load."""
    if not math.isfinite(detail):
        return _NO_RATE
    if detail < SMALLEST_RATE:
        return _TOO_FAST
    return _TOO_SLOW if detail > LARGEST_RATE else _UNLOADED


def sentences(outcomes: NDArray[np.int_], details: Float) -> NDArray[np.object_]:
    """`sentence` for arrays."""
    texts = np.full(outcomes.shape, _SENTENCES[Outcome.CONVERGED], dtype=object)
    for i in map(tuple, np.argwhere((outcomes != Outcome.CONVERGED) | (details < 0))):
        texts[i] = sentence(outcomes[i], details[i])
    return texts
