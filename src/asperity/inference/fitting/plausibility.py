"""Plausibility of fits: contradicted stiffnesses and unusual estimates.

Lock-in readings determine the stiffness to a few per cent or better: with a wrong stiffness all
laws fail, or a wrong law fits best.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from asperity.errors import named, require
from asperity.inference.fitting.description import described_fit
from asperity.inference.fitting.minima import minima_of
from asperity.inference.fitting.result import Fit
from asperity.inference.runs.assembly import stiffness_in
from asperity.inference.runs.run import RecordedRun
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import unknowns_of
from asperity.parameters.arguments import typed

#: A fixed or shared stiffness is contradicted if AICc falls by more with a free K for each run.
_CONTRADICTED_AICC = 6.0
#: Usual ranges of mu0, of A, of D0 (m), and of the stiffness over the load (1/m).
_FAR: Mapping[str, tuple[float, float]] = {
    "mu0": (3e-3, 3.0),
    "A": (5e-4, 0.2),
    "D0": (1e-8, 2e-3),
}
_FAR_STIFFNESS = (1e2, 1e6)


def contradicted_stiffness(
    fit: Fit, freed: Fit, runs: Sequence[RecordedRun], given: Any = None
) -> list[str]:
    """Sentences on a stiffness that recordings contradict: a fixed one, or one that they share.

    Parameters
    ----------
    fit, freed : Fit
        Fits with the fixed or shared stiffness, and with a free one for each recording.
    runs : sequence of RecordedRun
    given : str or float, optional
        The fixed stiffness; None if the recordings share a free one.
    """
    gain = fit.aicc - freed.aicc
    if not freed.converged or gain < _CONTRADICTED_AICC:
        return []
    moved = ", ".join(
        f"{named(n)} {freed.values[n]:.4g} instead of {fit.values[n]:.4g}"
        for n in ("A", "B", "D0")
        if n in fit.values and n in freed.values
    )
    moved = f", which gives {moved}" if moved else ""
    stiffnesses, sentences = [], []
    for run in runs:
        K = freed.parameters["K" if len(runs) == 1 else f"K[{run.name}]"]
        low, high = K.interval_95
        measured = f"{run.name} has {K.value:.4g} ({low:.4g} to {high:.4g}, 95 %)"
        if given is None:
            stiffnesses.append(f"{measured}, {K.value / fit.values['K']:.3g} times it")
        elif not low <= (fixed := stiffness_in(run, given)) <= high:
            sentences.append(
                f"the fixed {named('K')} of {fixed:.4g} {K.unit} is contradicted: {measured}; "
                f"AICc falls by {gain:.3g} with {named('K')} free{moved}; "
                f"leave {named('K')} free, or give it a prior"
            )
    if given is None:
        shared = fit.parameters["K"]
        sentences.append(
            f"the {named('K')} of {shared.value:.4g} {shared.unit} that the recordings share is "
            f"contradicted: {', '.join(stiffnesses)}; AICc falls by {gain:.3g} with a "
            f"{named('K')} for each{moved}; leave {named('K')} out of the free parameters, so "
            "that each has its own"
        )
    return sentences


def unusual_numbers(fit: Fit, runs: Sequence[RecordedRun] = ()) -> list[str]:
    """Sentences on estimates outside the usual ranges: the units or the law may be wrong.

    Parameters
    ----------
    fit : Fit
    runs : sequence of RecordedRun
        Its recordings, if it has any.
    """
    if not fit.converged:
        return []
    advice = (
        "check the units and signs of displacement, force and load, and look at a picture of the "
        "recording with the motion"
        if runs
        else "check the units of all columns and of the fixed numbers"
    )
    determined = fit.values.keys() - {*fit.undetermined}
    numbers = [(n, fit.values[n], fit.parameters[n].unit) for n in _FAR if n in determined]
    ranges = dict(_FAR)
    for run in runs:
        name = next((n for n in (f"K[{run.name}]", "K") if n in determined), None)
        if name is not None:
            numbers.append((f"{name}/W0", fit.values[name] / run.W0, "1/m"))
            ranges[f"{name}/W0"] = _FAR_STIFFNESS
    sentences = []
    for name, value, unit in numbers:
        low, high = ranges[name]
        if not low <= value <= high:
            sentences.append(
                f"{named(name)} of {value:.3g} {unit}".rstrip()
                + f" is outside {low:.3g} to {high:.3g}, where those of contacts lie: {advice}"
            )
    return sentences


#: A law does not describe a table if the probability of chi-squared is below the first number; with
#: a free stiffness it describes the table from the second number on.
_FAILS, _DESCRIBES = 1e-3, 0.01


def stiffness_that_describes(fit: Fit, progress: Callable[[int, int], None] | None = None) -> str:
    """A sentence on the stiffness with which the law would describe a table, or an empty text.

    Parameters
    ----------
    fit : Fit
        A converged fit to one table. The text is empty if it describes the table or has K free.
    progress : callable, optional
        Called with the number of minimisations done and of all minimisations.
    """
    objective = fit.objective
    given = np.unique(objective.fixed.get("K", ()))
    tables = objective.terms_of(LockInTerm)
    if not (tables and len(objective.terms) == 1 and given.size == 1 and fit.converged):
        return ""
    if fit.dof <= 0 or fit.p_value >= _FAILS:
        return ""
    (term,), (K,) = tables, given.tolist()
    fixed = {n: v for n, v in objective.fixed.items() if n != "K"}
    (stiffness,) = unknowns_of(objective.law, ["K"], start={"K": K}, priors={})
    part = term.with_fixed(fixed)
    part.use_search(False)
    free = replace(
        objective,
        terms=(part,),
        unknowns=(*objective.unknowns, stiffness),
        fixed=fixed,
    )
    # Starts: special cases, random starts, and the estimate with the given stiffness.
    minima = minima_of(free, 0, progress, simpler=[{**fit.values, "K": K}])
    freed = described_fit(free, minima, profile=False) if minima else None
    if freed is None or not freed.converged or freed.dof <= 0 or freed.p_value < _DESCRIBES:
        return ""
    estimate = freed.parameters["K"]
    low, high = estimate.interval_95
    if low <= K <= high:
        return ""
    law = [n for n in ("A", "B", "D0") if n in freed.values]
    numbers = ", ".join(f"{named(n)} {freed.values[n]:.4g}" for n in law)
    return (
        f"with {named('K')} free, {fit.law} describes these data (p = {freed.p_value:.2g}) at a "
        f"{named('K')} of {estimate.value:.4g} N/m ({low:.4g} to {high:.4g}, 95 %), "
        f"{estimate.value / K:.3g} times the given {K:.4g} N/m"
        + (f", with {numbers}" if numbers else "")
        + ": either the given stiffness is wrong or the law; measure the stiffness, or give it a "
        "prior"
    )


@typed
def shift_of_estimates(
    fit: Fit, high: Mapping[str, float], low: Mapping[str, float]
) -> dict[str, float]:
    """Half the first-order change of the estimates if fixed numbers change from low to high.

    Parameters
    ----------
    fit : Fit
        A fit to one table of lock-in readings.
    high, low : mapping of str to float
        Fixed numbers (SI) that differ from those of the fit, such as a stiffness one standard
        uncertainty above and below.

    Returns
    -------
    dict of str to float
        Changes in SI, by the names of the free parameters; infinite if the model has no periodic
        response with the changed numbers.

    Raises
    ------
    InputError
        If the data of the fit are not one table of lock-in readings.
    """
    tables = fit.objective.terms_of(LockInTerm)
    rule, got = "be of one table of lock-in readings", f"{len(fit.objective.terms)} parts"
    advice = "fit the table alone"
    require(len(tables) == 1 and len(fit.objective.terms) == 1, "fit", rule, got, advice)
    (term,) = tables
    sides = []
    for change in (high, low):
        changed = term.with_fixed({**fit.objective.fixed, **change})
        changed.use_search(True)
        residuals = changed.residuals(fit.values)
        if residuals is None:
            return dict.fromkeys(fit.values, math.inf)
        sides.append(residuals)
    # Priors do not change with the fixed numbers, and hold the estimates.
    objective = fit.objective
    priors = objective.prior_residuals(objective.coordinates(fit.values))[1]
    slopes = np.array([k.slope(fit.values[k.name]) for k in objective.unknowns])
    jacobian = np.vstack([(sides[0].jacobian + sides[1].jacobian) / 2, priors / slopes])
    change_of_residuals = np.append((sides[0].values - sides[1].values) / 2, np.zeros(len(priors)))
    scale = np.sqrt((jacobian**2).sum(0))
    moved = np.linalg.lstsq(jacobian / scale, -change_of_residuals, rcond=None)[0] / scale
    return dict(zip(fit.values, map(float, moved), strict=True))
