"""What became of the solve of an operating point, as data and as a sentence."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Outcome(IntEnum):
    """Outcome of a periodic solve.

    FOLDED, RUNAWAY and SENSITIVE are answers: the branch of orbits that begins with steady sliding
    does not reach the amplitude asked for, or not in a way that anything could hold. Other orbits,
    not connected to it, may exist.
    """

    CONVERGED = 0
    NO_ORBIT = 1
    NOT_RESOLVED = 2
    MULTIPLIERS_NOT_RESOLVED = 3
    FOLDED = 4
    RUNAWAY = 5
    SENSITIVE = 6


_SENTENCES = {
    Outcome.CONVERGED: "converged",
    Outcome.NO_ORBIT: (
        "no periodic orbit found: followed from steady sliding the branch stops at "
        "{detail:.4g} of the amplitude asked for; lower epsilon or stiffen the spring"
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
        "the branch from steady sliding folds back at epsilon = {detail:.3g}, below the amplitude "
        "asked for; lower epsilon or stiffen the spring"
    ),
    Outcome.RUNAWAY: (
        "on the branch from steady sliding slip runs away: before epsilon = {detail:.3g} its "
        "pulses become faster than e^13 V, without inertia nothing bounds them; lower epsilon or "
        "let inertia or radiation damping count"
    ),
    Outcome.SENSITIVE: (
        "the branch from steady sliding is lost at epsilon = {detail:.3g}: sliding is so unstable "
        "for part of the period that a disturbance grows by more than e^15, which neither a mesh "
        "nor an experiment can hold; lower epsilon or stiffen the spring"
    ),
}


_LOST = (
    "an orbit was found on a coarse mesh but lost on every finer one, so it may not exist; "
    "lower epsilon or stiffen the spring"
)


def sentence(outcome: int, detail: float) -> str:
    """The sentence that a user reads."""
    if outcome == Outcome.NOT_RESOLVED and not math.isfinite(detail):
        return _LOST
    return _SENTENCES[Outcome(outcome)].format(detail=detail)


def sentences(outcomes: NDArray[np.int_], details: NDArray[np.float64]) -> NDArray[np.object_]:
    """`sentence` for arrays."""
    texts = np.full(outcomes.shape, _SENTENCES[Outcome.CONVERGED], dtype=object)
    for i in map(tuple, np.argwhere(outcomes)):
        texts[i] = sentence(outcomes[i], details[i])
    return texts
