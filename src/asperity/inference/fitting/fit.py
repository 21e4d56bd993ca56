"""Fit of a friction law to data: maximum likelihood from several starts.

The likelihood is normal: each residual of a `DataTerm` has unit variance. The minimum of
chi-squared is computed by `scipy.optimize.least_squares` with the exact Jacobian.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import Annotated, Any

from scipy.optimize import brentq

from asperity.arrays import Float
from asperity.errors import InputError
from asperity.inference.fitting.assembly import Data, Given, listed_data, objective_of
from asperity.inference.fitting.description import described_fit, failed_fit
from asperity.inference.fitting.estimated_noise import under_drift, with_noise
from asperity.inference.fitting.inputs import free_by_default, require_some
from asperity.inference.fitting.minima import extends, minima_of
from asperity.inference.fitting.plausibility import (
    contradicted_stiffness,
    stiffness_that_describes,
    unusual_numbers,
)
from asperity.inference.fitting.result import Fit
from asperity.inference.holds import HoldTerm
from asperity.inference.objective import Minimum, Objective
from asperity.inference.runs.assembly import RunOptions
from asperity.inference.runs.blocks import coarser
from asperity.inference.runs.cleaning import with_wrong_samples
from asperity.inference.runs.run import RecordedRun
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import Prior
from asperity.laws import Law, get_law
from asperity.materials import Material
from asperity.parameters.arguments import at_least, typed

#: Largest number of rounds of searching for wrong samples and fitting without them.
_CLEANINGS = 4
#: Relative accuracy of the estimated error of holds.
_AGREED = 1e-6


@typed
def fit(
    data: Data | Iterable[Data],
    law: str | type[Law],
    free: Sequence[str] | None = None,
    *,
    fixed: Mapping[str, Any] | None = None,
    material: Material | None = None,
    prior: Material | Mapping[str, Prior] | None = None,
    start: Mapping[str, Any] | None = None,
    inertia: bool = False,
    radiation_damping: bool = False,
    runs: RunOptions | None = None,
    profile: bool = False,
    bare: bool = False,
    starts: Annotated[int, at_least(0)] = 64,
    seed: Annotated[int, at_least(0)] = 0,
    simpler: Sequence[Fit] = (),
    further: bool = True,
    check_stiffness: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Fit a friction law to lock-in readings, tables of holds, and recordings.

    Parameters
    ----------
    data : LockInTable, HealingTable, AveragedCycle, RecordedRun or Trace, or several
        Data for one likelihood. Tables of holds, and averaged cycles, cannot be combined with other
        kinds of data.
    law : str or type of Law
        Rate-dependent.
    free : sequence of str, optional
        Free parameters: those of the law, K, W0, M, eta, and eps_ratio = eps_eff/eps. By default
        all parameters of the law that the data may determine and that are not fixed, even if a
        material has them, and eps_ratio for lock-in readings. The stiffness of a recording is
        always free: one K for all recordings if it is named, otherwise one for each. The gain of
        the gauge, ``gain``, is free if it has a prior.
    fixed : mapping, optional
        Values of other parameters, in SI or as texts with units. They take precedence over columns
        of the data, and these over the material.
    material : Material, optional
        Values of parameters that are neither free nor given otherwise, and start values.
    prior : Material or mapping of str to Prior, optional
        Normal priors of free parameters: published uncertainties of a material, or any others.
    start : mapping of str to float, optional
        Start values in SI; further starts are random.
    inertia, radiation_damping : bool
        Whether the mass M and the damping eta count.
    runs : RunOptions, optional
        Options of the comparison of recordings with the motion.
    profile : bool
        Whether to compute intervals by profile likelihood rather than the normal approximation.
    bare : bool
        Whether `free` may be empty with tables: the law is then compared with them without a fit.
    starts : int
        Number of random starts that are evaluated in addition to the given one. Minimisations begin
        at the best of them.
    seed : int
        Seed of the starts.
    simpler : sequence of Fit
        Fits of other laws to the same data. Fits of special cases of this law are starts too:
        Rice-Ruina is a special case of the elasto-plastic law.
    further : bool
        Whether to try further starts while no minimum describes a table; not needed if a law of
        which this one is a special case is fitted to the same data.
    check_stiffness : bool
        Whether to fit a table that the law does not describe again with K free; a warning says at
        which K the law describes it. Recordings with a fixed or shared K are always fitted again.
    progress : callable, optional
        Called with the number of steps done so far and of all steps: the minimisations, then the
        intervals of all parameters. A fit with K free follows.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        If a name or value is wrong, numbers are missing, there are fewer data than parameters, or
        the data do not depend on a parameter.
    """
    chosen = get_law(law) if isinstance(law, str) else law
    if not chosen.rate_dependent:
        advice = "its one number follows from the mean friction"
        raise InputError("law", "depend on the velocity", chosen.name, advice)
    options = runs or RunOptions()
    several = listed_data(data, options)
    recordings = [d for d in several if isinstance(d, RecordedRun)]
    names = free_by_default(chosen, several, fixed, material) if free is None else list(free)
    if not (recordings or bare):
        require_some(chosen, names)
    numbers = Given(fixed or {}, material, prior, start)
    motion: dict[str, Any] = {"inertia": inertia, "radiation_damping": radiation_damping}
    others = [d for d in several if not isinstance(d, RecordedRun)]

    def objective_with(recordings: Sequence[RecordedRun]) -> Objective:
        data = [*others, *recordings]
        return objective_of(chosen, data, names, numbers, options=options, motion=motion)

    objective = objective_with(recordings)
    steps = _Steps(progress, len(objective.unknowns))
    special = [f.values for f in simpler if f.converged and extends(chosen, f.objective.law)]
    search = partial(
        minima_of,
        seed=seed,
        progress=steps.minimised,
        drawn=starts,
        simpler=special,
        further=further,
    )
    objective, minima, agreed = _without_wrong_samples(
        objective_with, objective, recordings, search
    )
    if not minima or not math.isfinite(minima[0].chi2):
        return failed_fit(objective)
    holds = objective.terms_of(HoldTerm)
    if holds or any(term.measured_epsilon for term in objective.terms_of(LockInTerm)):
        minima = with_estimated_errors(objective, minima)
    result = described_fit(objective, minima, profile=profile, described=steps.described)
    warnings = [] if agreed else ["the noise and the parameters did not agree after several rounds"]
    warnings += unusual_numbers(result, recordings)
    if not recordings:
        other = stiffness_that_describes(result, steps.again) if check_stiffness else ""
        return replace(result, sentences=(*warnings, *result.sentences, *filter(None, [other])))
    given = numbers.fixed.get("K")
    shared = "K" in names and len(recordings) > 1
    if not others and (given is not None or shared):
        laws = {k.name: result.values[k.name] for k in result.objective.interest}
        # The K of each recording begins at the fixed or shared one.
        begun = {**(start or {}), "K": given, **laws}
        without = {n: v for n, v in numbers.fixed.items() if n != "K"}
        freed = fit(
            recordings,
            law,
            [n for n in names if n != "K"],
            **numbers._replace(fixed=without, start=begun)._asdict(),
            **motion,
            runs=runs,
            starts=1,
            seed=seed,
        )
        warnings += contradicted_stiffness(result, freed, recordings, given)
    return replace(result, sentences=(*warnings, *result.sentences))


def _without_wrong_samples(
    objective_with: Callable[[Sequence[RecordedRun]], Objective],
    objective: Objective,
    recordings: Sequence[RecordedRun],
    search: Callable[[Objective], list[Minimum]],
) -> tuple[Objective, list[Minimum], bool]:
    """The last objective and its minima, and whether noise and parameters agree.

    Samples that neither the motion nor noise explains are left out of the next fit, until a fit
    finds no others.
    """
    cleaner = list(recordings)
    for left in reversed(range(_CLEANINGS + 1)):
        agreed = True
        if recordings:
            # Minima of a long recording are searched with fewer, longer blocks.
            coarse = coarser(cleaner)
            searched = under_drift(objective_with(coarse) if coarse else objective)
            minima = search(searched)
            if minima:
                minima, agreed = with_noise(objective, minima, searched)
        else:
            minima = search(objective)
        if not minima or not math.isfinite(minima[0].chi2):
            break
        values, terms = objective.named(minima[0].u), objective.terms_of(RunTerm)
        before = [(run.wrong or (), run.doubts) for run in cleaner]
        cleaner = [
            with_wrong_samples(run, term.wrong_samples(values) if run.wrong is None else run.wrong)
            for run, term in zip(recordings, terms, strict=True)
        ]
        if not left or before == [(run.wrong, run.doubts) for run in cleaner]:
            break
        objective = objective_with(cleaner)
    return objective, minima, agreed


def with_estimated_errors(objective: Objective, minima: list[Minimum]) -> list[Minimum]:
    """Minima with errors that depend on a fit, best first: of holds without errors, of epsilon."""
    u = minima[0].u
    for hold in objective.terms_of(HoldTerm) if not objective.noise_is_known else ():
        u = _with_scatter(objective, hold, u)
    for table in objective.terms_of(LockInTerm):
        if table.measured_epsilon:
            table.estimate_error(objective.named(u))
    objective.forget()
    return sorted((objective.minimise(m.u) for m in minima), key=attrgetter("chi2"))


def _with_scatter(objective: Objective, hold: HoldTerm, u: Float) -> Float:
    """The minimum at which the error of holds is the scatter of the residuals; sets this error.

    With priors the estimates depend on the error, and the error on the estimates.
    """

    def ratio(log_error: float) -> float:
        """Logarithm of scatter over error; u becomes the minimum with this error."""
        nonlocal u
        hold.error = math.exp(log_error)
        objective.forget()
        u = objective.minimise(u).u
        data, (_, J) = objective.data_residuals(u), objective.residuals(u)
        assert data is not None  # there is a solution at a minimum
        return math.log(hold.scatter(data[0], J.T @ J)) - log_error

    # The scatter is bounded, so that steps of twice the difference pass it.
    begin = math.log(hold.error)
    step = ratio(begin)
    while abs(step) > _AGREED:
        end = begin + 2 * step
        beyond = ratio(end)
        if step * beyond <= 0:
            begin = float(brentq(ratio, begin, end, xtol=_AGREED))
            break
        begin, step = end, beyond
    ratio(begin)
    return u


class _Steps:
    """Progress of a fit: minimisations, then parameters with intervals."""

    def __init__(self, progress: Callable[[int, int], None] | None, parameters: int) -> None:
        self._report = progress or (lambda done, total: None)
        self._parameters, self._done, self._total = parameters, 0, parameters

    def minimised(self, done: int, total: int) -> None:
        # A fit without wrong samples begins again: progress must not decrease.
        self._done = max(self._done, done)
        self._total = max(self._total, total + self._parameters)
        self._report(self._done, self._total)

    def described(self, parameters: int) -> None:
        # If a profile reaches another minimum, all parameters are described again.
        self._done = max(self._done, self._total - self._parameters + parameters)
        self._report(self._done, self._total)

    def again(self, done: int, total: int) -> None:
        self._report(self._total + done, self._total + total)
