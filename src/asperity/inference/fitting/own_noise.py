"""Minima of recordings under the noise of their residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from asperity.arrays import Float
from asperity.inference.fitting.description import RIVAL
from asperity.inference.objective import Minimum, Objective
from asperity.inference.runs.term import RunTerm

#: Rounds of estimating noise and parameters, and the change in standard deviations that ends them.
_ROUNDS, _STILL = 8, 0.03
#: Starts that are nearer than so many standard deviations are followed as one.
_ONE_END = 1.0
#: Standard deviations of the parameters within which two starts lead to the same minimum.
_ALLOWED = 5.0
#: Relative change of the coordinates that ends the way to a minimum before the last.
_COARSE = 1e-4
#: Evaluations under white noise, which is but a place to begin at.
_EVALUATIONS = 30


def under_drift(objective: Objective) -> Objective:
    """The objective with recordings whose noise is taken for a slow drift, to search with."""
    terms = (t.under_drift() if isinstance(t, RunTerm) else t for t in objective.terms)
    return replace(objective, terms=tuple(terms), tolerance=_COARSE)


def with_noise(
    objective: Objective, minima: list[Minimum], searched: Objective
) -> tuple[list[Minimum], bool]:
    """Minima once the noise is that of the residual, and whether the two agree at the best.

    From each of the `minima` of `searched`, the objective under a drift, the way goes by that under
    white noise, and straight on too where the drift does not allow that one. Each is followed under
    the noise that its own residual shows. They are compared by the likelihood, noise included:
    under the noise of one, which holds its misfit, another is no minimum. The objective takes the
    noise of the best.

    Returns
    -------
    list of (array, float)
        Best first, with the chi-squared of the best under its noise; that of the others is as much
        higher as twice the logarithm of their likelihood is lower.
    bool
    """
    starts: list[Float] = []
    for k, (u, value) in enumerate(minima):
        # Most of the drawn starts have led to the same minimum.
        near = [v for v, other in minima[:k] if value - other < _ONE_END]
        if len(_apart(searched, [*near, u])) == len(_apart(searched, near)):
            continue
        white = objective.minimise(u, tolerance=_COARSE, evaluations=_EVALUATIONS).u
        # Chi-squared of a drift says how large it is: noise has one a sample.
        allowed = value * (1 + _ALLOWED**2 / searched.residuals(u)[0].size)
        starts += [white] if searched.chi2(white) <= allowed else [u, white]
    ends: list[_End] = []
    for u in _apart(objective, starts):
        ends += _with_own_noise(objective, u, ends, _COARSE)
    ends.sort(key=lambda end: end.deviance)
    (best,) = _with_own_noise(ends[0].objective, ends[0].u, (), objective.tolerance)
    objective.terms = best.objective.terms
    objective.forget()
    chi2 = objective.chi2(best.u)
    others = [
        Minimum(end.u, chi2 + end.deviance - best.deviance)
        for end in ends[1:]
        if math.isfinite(end.deviance)
    ]
    return [Minimum(best.u, chi2), *others], best.agreed


def _apart(objective: Objective, starts: list[Float]) -> list[Float]:
    """Starts without those that the data hardly tell from an earlier one: both lead to one end."""
    kept: list[Float] = []
    for u in starts:
        _, jacobian = objective.residuals(u)
        if all(float(np.linalg.norm(jacobian @ (u - other))) > _ONE_END for other in kept):
            kept.append(u)
    return kept


class _End(NamedTuple):
    """A minimum, and the objective under its own noise."""

    u: Float
    deviance: float
    objective: Objective
    agreed: bool


def _with_own_noise(
    objective: Objective, u: Float, known: Sequence[_End], tolerance: float
) -> list[_End]:
    """Noise and parameters in turn, until the parameters stay where they are.

    Empty where they come to an end that is known, or will not come to one that matters: each round
    gains a part of what the last one gained.
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
        # The first noise holds the misfit of the start.
        if turn and any(np.linalg.norm(jacobian @ (u - end.u)) < _ONE_END for end in known):
            return []
        before, deviance = deviance, _deviance(objective, u)
        if deviance - _ROUNDS * (before - deviance) > lowest + RIVAL:
            return []
        away = jacobian @ (u - begin)
        # chi-squared of the change, under the noise as it is now.
        if agreed := float(away @ away) < _STILL**2:
            break
    return [_End(u, _deviance(objective, u), objective, agreed)]


def _deviance(objective: Objective, u: Float) -> float:
    """Twice the negative logarithm of likelihood and priors, and twice the numbers of the noise."""
    priors = objective.prior_residuals(u)[0]
    profiled = sum(term.profiled for term in objective.terms)
    return -2 * objective.log_likelihood(u) + float(priors @ priors) + 2 * profiled
