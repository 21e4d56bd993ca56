"""Minima of fits to recordings, whose noise is estimated from the residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from asperity.arrays import Float
from asperity.inference.fitting.minima import RIVAL
from asperity.inference.objective import Minimum, Objective
from asperity.inference.runs.term import RunTerm

#: Largest number of rounds of estimating noise and parameters; the change (standard deviations)
#: that ends them.
_ROUNDS, _CONVERGED = 8, 0.03
#: Starts closer than this many standard deviations are the same.
_SAME_START = 1.0
#: Two starts lead to the same minimum if they differ by fewer standard deviations.
_MOST_APART = 5.0
#: Tolerance of all minima but the last (relative change of the coordinates).
_COARSE = 1e-4
#: Evaluations under white noise, whose minimum is only a start.
_EVALUATIONS = 30

#: Sort key of minima with noise.
_DEVIANCE = attrgetter("deviance")


def under_drift(objective: Objective) -> Objective:
    """The objective with a slow drift as the noise of all recordings, for the search."""
    terms = (t.under_drift() if isinstance(t, RunTerm) else t for t in objective.terms)
    return replace(objective, terms=tuple(terms), tolerance=_COARSE)


def with_noise(
    objective: Objective, minima: list[Minimum], searched: Objective
) -> tuple[list[Minimum], bool]:
    """Minima with noise that is estimated from the residuals.

    `searched` is the objective under a drift, with the given `minima`. A minimisation under white
    noise begins at each of them; if its result is not allowed under the drift, the minimum itself
    is used too. From each of these starts, noise and parameters are then estimated in turn, and at
    last from the best result with the delays of all velocity changes at their start values. The
    resulting minima are compared by the likelihood including the noise, because the noise of one
    minimum includes its misfit, and other minima are none under this noise. The objective takes the
    noise of the best minimum.

    Returns
    -------
    list of Minimum
        Best first. The chi-squared of the best is that under its noise; the others exceed
        it by twice the difference of the log likelihoods.
    bool
        Whether noise and parameters agree at the best minimum.
    """
    starts: list[Float] = []
    for k, (u, value) in enumerate(minima):
        # Most of the random starts lead to the same minimum.
        near = [v for v, other in minima[:k] if value - other < _SAME_START]
        if len(_distinct_starts(searched, [*near, u])) == len(_distinct_starts(searched, near)):
            continue
        white = objective.minimise(u, tolerance=_COARSE, evaluations=_EVALUATIONS).u
        # Chi-squared per sample estimates the size of the drift: noise has 1.
        allowed = value * (1 + _MOST_APART**2 / searched.residuals(u)[0].size)
        starts += [white] if searched.chi2(white) <= allowed else [u, white]
    ends: list[_MinimumWithNoise] = []
    for u in _distinct_starts(objective, starts):
        ends += _estimated_in_turn(objective, u, ends, _COARSE)
    # On a stiff machine friction jumps between two samples: the delay of a velocity change then has
    # a minimum in each sampling interval.
    delays = [
        i for i, name in enumerate(objective.unknowns) if name.nuisance and not name.logarithmic
    ]
    if delays:
        u = min(ends, key=_DEVIANCE).u.copy()
        u[delays] = [objective.unknowns[i].middle for i in delays]
        ends += _estimated_in_turn(objective, u, ends, _COARSE)
    ends.sort(key=_DEVIANCE)
    (best,) = _estimated_in_turn(ends[0].objective, ends[0].u, (), objective.tolerance)
    objective.terms = best.objective.terms
    objective.forget()
    chi2 = objective.chi2(best.u)
    others = [
        Minimum(end.u, chi2 + end.deviance - best.deviance)
        for end in ends[1:]
        if math.isfinite(end.deviance)
    ]
    return [Minimum(best.u, chi2), *others], best.agreed


def _distinct_starts(objective: Objective, starts: list[Float]) -> list[Float]:
    """Starts without those that are too close to an earlier start: both have the same minimum."""
    kept: list[Float] = []
    for u in starts:
        _, jacobian = objective.residuals(u)
        if all(float(np.linalg.norm(jacobian @ (u - other))) > _SAME_START for other in kept):
            kept.append(u)
    return kept


class _MinimumWithNoise(NamedTuple):
    """A minimum, and the objective with the noise of its residuals."""

    u: Float
    deviance: float
    objective: Objective
    agreed: bool


def _estimated_in_turn(
    objective: Objective, u: Float, known: Sequence[_MinimumWithNoise], tolerance: float
) -> list[_MinimumWithNoise]:
    """Estimate noise and parameters in turn, until the parameters stay constant.

    Empty if the rounds approach a known minimum, or a minimum that cannot be among the best: each
    round gains a fraction of the gain of the last round.
    """
    lowest = min((end.deviance for end in known), default=math.inf)
    deviance = math.inf
    objective = replace(objective, terms=tuple(copy(term) for term in objective.terms))
    noisy = objective.terms_of(RunTerm)
    agreed = False
    for turn in range(_ROUNDS):
        begin = u
        for term in noisy:
            term.update_noise(objective.named(begin))
        objective.forget()
        u, value = objective.minimise(begin, tolerance=tolerance)
        if not math.isfinite(value):
            break
        begin, u = objective.ordered(begin), objective.ordered(u)
        _, jacobian = objective.residuals(u)
        # The first noise includes the misfit of the start.
        if turn and any(np.linalg.norm(jacobian @ (u - end.u)) < _SAME_START for end in known):
            return []
        before, deviance = deviance, _deviance(objective, u)
        if deviance - _ROUNDS * (before - deviance) > lowest + RIVAL:
            return []
        away = jacobian @ (u - begin)
        # Chi-squared of the change under the present noise.
        if agreed := float(away @ away) < _CONVERGED**2:
            break
    return [_MinimumWithNoise(u, _deviance(objective, u), objective, agreed)]


def _deviance(objective: Objective, u: Float) -> float:
    """-2 ln of likelihood times priors, plus twice the number of parameters of the noise."""
    priors = objective.prior_residuals(u)[0]
    profiled = sum(term.profiled for term in objective.terms)
    return -2 * objective.log_likelihood(u) + float(priors @ priors) + 2 * profiled
