"""Minima of recordings under the noise of their residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.inference.fitting.minima import distinct
from asperity.inference.objective import Minimum, Objective
from asperity.inference.runs.term import NoiseState, RunTerm

Float = NDArray[np.float64]
#: Minima, best first, and whether noise and parameters agree at the best.
Found = tuple[list[Minimum], bool]

#: Rounds of estimating noise and parameters, and the change in standard deviations that ends them.
_ROUNDS, _STILL = 8, 0.03
#: Minima under white noise that are nearer than so many standard deviations are followed as one.
_ONE_END = 1.0
#: Standard deviations of the parameters within which two starts lead to the same minimum.
_ALLOWED = 5.0
#: Relative change of the coordinates that ends the way to a minimum of a drift, which only tells
#: starts apart: along its valleys chi-squared falls by less than `_ALLOWED` leaves open.
_COARSE = 1e-4


def under_drift(objective: Objective) -> Objective:
    """The objective with recordings whose noise is taken for a slow drift."""
    terms = tuple(copy(term) for term in objective.terms)
    drifting = replace(objective, terms=terms, tolerance=_COARSE)
    for term in drifting.terms_of(RunTerm):
        term.expect_slow_noise()
    return drifting


def with_noise(
    objective: Objective,
    minima: list[Minimum],
    drifting: Objective | None = None,
    besides: Sequence[Minimum] = (),
) -> Found:
    """Minima once the noise is that of the residual, and whether the two agree at the best.

    `besides` are minima of `drifting`; one is followed where no end of the others is a minimum of
    `drifting` too. Each minimum has the noise that its own residual shows. They are compared by the
    likelihood, noise included: under the noise of one, which holds its misfit, another is no
    minimum.

    Returns
    -------
    list of (array, float)
        Best first, with the chi-squared of the best under its noise; that of the others is as much
        higher as twice the logarithm of their likelihood is lower.
    bool
    """
    noisy = objective.terms_of(RunTerm)
    first = [term.noise_state() for term in noisy]
    ends: list[_End] = []
    for u in _apart(objective, minima):
        for term, state in zip(noisy, first, strict=True):
            term.restore_noise(state)
        ends += _with_own_noise(objective, noisy, u, ends)
    for u, value in distinct(list(besides)):
        assert drifting is not None  # whose minima they are
        # Chi-squared of a drift says how large it is: noise has one a sample.
        allowed = value * (1 + _ALLOWED**2 / drifting.residuals(u)[0].size)
        if all(drifting.chi2(end.u) > allowed for end in ends):
            for term, state in zip(noisy, first, strict=True):
                term.restore_noise(state)
            ends += _with_own_noise(objective, noisy, u, ends)
    best = min(ends, key=lambda end: end.deviance)
    for term, state in zip(noisy, best.states, strict=True):
        term.restore_noise(state)
    objective.forget()
    chi2 = objective.chi2(best.u)
    result = [Minimum(best.u, chi2)]
    for end in sorted(ends, key=lambda end: end.deviance):
        if end is not best and math.isfinite(end.deviance):
            result.append(Minimum(end.u, chi2 + end.deviance - best.deviance))
    return result, best.agreed


def _apart(objective: Objective, minima: list[Minimum]) -> list[Float]:
    """Minima without those that the data hardly tell from an earlier one: both lead to one end."""
    kept: list[Float] = []
    for u, _ in minima:
        _, jacobian = objective.residuals(u)
        if all(float(np.linalg.norm(jacobian @ (u - other))) > _ONE_END for other in kept):
            kept.append(u)
    return kept


class _End(NamedTuple):
    """A minimum under its own noise."""

    u: Float
    #: Twice the negative logarithm of likelihood and priors, and twice the parameters of the noise.
    deviance: float
    states: list[NoiseState]
    agreed: bool


def _with_own_noise(
    objective: Objective, noisy: list[RunTerm], u: Float, known: Sequence[_End]
) -> list[_End]:
    """Noise and parameters in turn, until the parameters stay where they are.

    Empty where they come to an end that is known.
    """
    agreed = False
    for turn in range(_ROUNDS):
        begin = u
        for term in noisy:
            term.update_noise(objective.named(begin))
        objective.forget()
        u, value = objective.minimise(begin)
        if not math.isfinite(value):
            break
        begin, u = objective.ordered(begin), objective.ordered(u)
        _, jacobian = objective.residuals(u)
        # The first noise holds the misfit of the start.
        if turn and any(np.linalg.norm(jacobian @ (u - end.u)) < _ONE_END for end in known):
            return []
        away = jacobian @ (u - begin)
        # chi-squared of the change, under the noise as it is now.
        if agreed := float(away @ away) < _STILL**2:
            break
    priors = objective.prior_residuals(u)[0]
    deviance = -2 * objective.log_likelihood(u) + float(priors @ priors)
    deviance += 2 * sum(term.profiled for term in noisy)
    states = [term.noise_state() for term in noisy]
    return [_End(u, deviance, states, agreed)]
