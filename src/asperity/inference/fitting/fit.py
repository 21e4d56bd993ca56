"""Fit of a friction law to data: maximum likelihood from several starts.

The likelihood is normal: each residual of a `DataTerm` has unit variance. The minimum of
chi-squared is computed by `scipy.optimize.least_squares` with the exact Jacobian.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import numpy as np

from asperity.errors import Argument, InputError, require, symbol
from asperity.inference.cycles import AveragedCycle, CycleTerm
from asperity.inference.fitting.description import described_fit, failed_fit
from asperity.inference.fitting.estimated_noise import under_drift, with_noise
from asperity.inference.fitting.inputs import (
    fixed_values,
    free_by_default,
    require_counted,
    require_enough,
    require_masses,
    require_motion,
    require_some,
    start_values,
)
from asperity.inference.fitting.minima import extends, minima_of
from asperity.inference.fitting.plausibility import (
    contradicted_stiffness,
    stiffness_that_describes,
    unusual_numbers,
)
from asperity.inference.fitting.result import Fit
from asperity.inference.holds import HealingTable, HoldTerm, joined_holds
from asperity.inference.objective import DataTerm, Minimum, Objective
from asperity.inference.runs.assembly import (
    USUAL_STIFFNESS,
    RunOptions,
    require_calibrated,
    require_newtons,
    require_no_layer,
    require_own_samples,
    require_seen,
    run_terms,
    shared_stiffness,
    stiffness_of_table,
    usual_ranges,
)
from asperity.inference.runs.blocks import coarser
from asperity.inference.runs.cleaning import cleaned, with_wrong_samples
from asperity.inference.runs.gauge import GAIN
from asperity.inference.runs.run import RecordedRun, recorded_run
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.table import LockInTable, joined
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import (
    Prior,
    material_priors,
    material_values,
    require_free_names,
    unknowns_of,
)
from asperity.laws import Law, get_law
from asperity.materials import Material
from asperity.parameters import MACHINE, law_parameters
from asperity.parameters.arguments import at_least, typed
from asperity.recording import Trace

#: Largest number of rounds of searching for wrong samples and fitting without them.
_CLEANINGS = 4
#: Assumed mu0 (dimensionless) and V0 (m/s) for healing: it is measured relative to sliding, so that
#: mu0 has no influence.
_OF_THE_LEVEL = {"mu0": 0.6, "V0": 1e-6}

Data = LockInTable | HealingTable | AveragedCycle | RecordedRun | Trace


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
    cycles = [d for d in several if isinstance(d, AveragedCycle)]
    holds = [d for d in several if isinstance(d, HealingTable)]
    tables = [d for d in several if isinstance(d, LockInTable)]
    recordings = [d for d in several if isinstance(d, RecordedRun)]
    table = joined(tables)[0] if tables else None
    names = free_by_default(chosen, several, fixed, material) if free is None else list(free)
    for some, what in ((cycles, "cycles of stick-slip"), (holds, "tables of holds")):
        if some and len(some) < len(several):
            advice = "fit them one after the other, with the first as the prior of the second"
            raise InputError("data", f"be {what} alone or other data", "both", advice)
    if not (recordings or cycles or bare):
        require_some(chosen, names)
    numbers = _Given(fixed or {}, material, prior, start)
    motion: dict[str, Any] = {"inertia": inertia, "radiation_damping": radiation_damping}

    def compared(recordings: Sequence[RecordedRun]) -> Objective:
        return _objective(chosen, table, recordings, names, numbers, options=options, motion=motion)

    if cycles:
        # A cycle needs a mass.
        require_counted(numbers.fixed, motion, ("M", "inertia"), "cycles of stick-slip")
        objective = _cycle_objective(chosen, cycles, free, numbers)
    elif holds:
        require_counted(numbers.fixed, motion, (), "a table of holds")
        objective = _hold_objective(chosen, joined_holds(holds), names, numbers)
    else:
        objective = compared(recordings)
    steps = _Steps(progress, len(objective.unknowns))
    special = [f.values for f in simpler if f.converged and extends(chosen, f.objective.law)]

    def minima_under(
        objective: Objective, recordings: Sequence[RecordedRun]
    ) -> tuple[list[Minimum], bool]:
        # Minima of a long recording are searched with fewer, longer blocks.
        searched = compared(coarse) if (coarse := coarser(recordings)) else objective
        if recordings:
            searched = under_drift(searched)
        minima = minima_of(searched, seed, steps.minimised, drawn=starts, simpler=special)
        return with_noise(objective, minima, searched) if minima and recordings else (minima, True)

    cleaner = recordings
    for left in reversed(range(_CLEANINGS + 1)):
        minima, agreed = minima_under(objective, cleaner)
        if not minima or not math.isfinite(minima[0].chi2):
            return failed_fit(objective)
        # Samples that neither the motion nor noise explains are left out of the next fit.
        values, terms = objective.named(minima[0].u), objective.terms_of(RunTerm)
        before = [(run.wrong or (), run.doubts) for run in cleaner]
        cleaner = [
            with_wrong_samples(run, term.wrong_samples(values) if run.wrong is None else run.wrong)
            for run, term in zip(recordings, terms, strict=True)
        ]
        if not left or before == [(run.wrong, run.doubts) for run in cleaner]:
            break
        objective = compared(cleaner)
    if holds or any(term.measured_epsilon for term in objective.terms_of(LockInTerm)):
        minima = _with_estimated_errors(objective, minima)
    result = described_fit(objective, minima, profile=profile, described=steps.described)
    warnings = [] if agreed else ["the noise and the parameters did not agree after several rounds"]
    warnings += unusual_numbers(result, recordings)
    if not recordings:
        other = stiffness_that_describes(result, steps.again) if check_stiffness else ""
        return replace(result, sentences=(*warnings, *result.sentences, *filter(None, [other])))
    given = numbers.fixed.get("K")
    shared = "K" in names and len(recordings) > 1
    if table is None and (given is not None or shared):
        laws = {k.name: result.values[k.name] for k in result.objective.interest}
        # The K of each recording begins at the fixed or shared one.
        begun = {**(start or {}), "K": given, **laws}
        others = {n: v for n, v in numbers.fixed.items() if n != "K"}
        freed = fit(
            recordings,
            law,
            [n for n in names if n != "K"],
            **numbers._replace(fixed=others, start=begun)._asdict(),
            **motion,
            runs=runs,
            starts=1,
            seed=seed,
        )
        warnings += contradicted_stiffness(result, freed, recordings, given)
    return replace(result, sentences=(*warnings, *result.sentences))


class _Given(NamedTuple):
    """Numbers of the caller; fields as the arguments of `fit`."""

    fixed: Mapping[str, Any]
    material: Material | None
    prior: Material | Mapping[str, Prior] | None
    start: Mapping[str, Any] | None

    def priors(self, free: Sequence[str]) -> dict[str, Prior]:
        """Priors by the names of free parameters."""
        prior = self.prior
        return material_priors(prior, free) if isinstance(prior, Material) else dict(prior or {})


def _hold_objective(
    law: type[Law], table: HealingTable, free: list[str], given: _Given
) -> Objective:
    """The function to minimise for a table of holds; all inputs are checked."""
    numbers = law_parameters(law)
    for name in free:
        holds, advice = name in numbers, "leave it out: the table has stiffness and velocity"
        require(
            holds, "free", f"be parameters of {law.name} with holds", f"'{symbol(name)}'", advice
        )
    fixed = {n: v for n, v in given.fixed.items() if n not in ("V", "K", "W0")}
    constants = fixed_values(law, None, free, fixed, given.material, assumed=_OF_THE_LEVEL)
    begun, priors = start_values(law, free, given.start, given.material), given.priors(free)
    unknowns = unknowns_of(law, free, start=begun, priors=priors)
    require_free_names(unknowns, given.start, priors)
    require_enough(table.name, table.rows, unknowns)
    term = HoldTerm(table, law, constants)
    return Objective((term,), law, unknowns, constants, tolerance=1e-9)


def _cycle_objective(
    law: type[Law],
    cycles: Sequence[AveragedCycle],
    free: Sequence[str] | None,
    given: _Given,
) -> Objective:
    """The function to minimise for averaged cycles; all inputs are checked."""
    first, numbers = cycles[0], law_parameters(law)
    # The level of friction is fitted in each cycle.
    fixed = {n: v for n, v in given.fixed.items() if n not in ("V", "W0")}
    level = float(np.mean(first.values[:-1]))
    fixed = {n: v for n, v in {"mu0": level, "V0": first.V}.items() if n in numbers} | fixed
    names = [n for n in (*numbers, "K", "M") if n not in fixed] if free is None else list(free)
    require_some(law, names)
    advice = "leave it out: a constant friction is fitted in each cycle"
    require("mu0" not in names, "free", "be what the shape of a cycle shows", "'mu0'", advice)
    unseen = [c.name for c in cycles if not c.resolved]
    if unseen and "M" in names:
        rule = "be fixed where a slip is shorter than four samples"
        raise InputError("M", rule, f"it free for {unseen[0]}", "fix M, or sample faster")
    constants = fixed_values(law, None, names, fixed, given.material)
    if "K" in fixed and "K" not in names:
        constants["K"] = float(MACHINE["K"].check(fixed["K"]))
    missing = [n for n in ("K", "M") if n not in names and not constants.get(n)]
    if missing:
        advice = f"name it in {Argument('free')}, or give it in {Argument('fixed')}"
        raise InputError(
            symbol(missing[0]), "be free or fixed for a fit of cycles", "neither", advice
        )
    priors = given.priors(names)
    # A stick loads by K V/W0, and a slip lasts for half a period of sqrt(K/M).
    K = first.loading_slope * first.W0 / first.V
    M = float(constants.get("K", K)) * (first.slip_duration / np.pi) ** 2
    begun = {"K": K, "M": M} | start_values(law, names, given.start, given.material)
    begun, priors = stiffness_of_table(begun, priors, [cycle.W0 for cycle in cycles])
    usual = {"K": (K / 1.5, K * 1.5), "M": (M / 4, M * 2), "B": (first.drop / 40, first.drop / 2)}
    begun = {n: v for n, v in begun.items() if n in names}
    unknowns = unknowns_of(law, names, start=begun, priors=priors, usual=usual)
    require_free_names(unknowns, given.start, priors)
    # A cycle needs a mass.
    unknowns = tuple(
        replace(u, logarithmic=True, scale=1.0) if u.name == "M" else u for u in unknowns
    )
    terms = tuple(CycleTerm(cycle, law, constants) for cycle in cycles)
    return Objective(terms, law, unknowns, constants, curved=True)


def _with_estimated_errors(objective: Objective, minima: list[Minimum]) -> list[Minimum]:
    """Minima with errors that depend on a fit: of holds without errors, and of epsilon."""
    values = objective.named(minima[0].u)
    for hold in objective.terms_of(HoldTerm):
        hold.estimate_error(values, len(objective.unknowns))
    for table in objective.terms_of(LockInTerm):
        if table.measured_epsilon:
            table.estimate_error(values)
    objective.forget()
    best = objective.minimise(minima[0].u)
    return [best, *(Minimum(m.u, objective.chi2(m.u)) for m in minima[1:])]


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


def listed_data(
    data: Data | Iterable[Data], options: RunOptions
) -> list[LockInTable | HealingTable | AveragedCycle | RecordedRun]:
    """Data as a list, with recordings as `RecordedRun`."""
    of_its_own = LockInTable | HealingTable | AveragedCycle | RecordedRun
    several = [data] if isinstance(data, of_its_own | Trace) else list(data)
    ready = [d if isinstance(d, of_its_own) else recorded_run(d) for d in several]
    require_own_samples([d for d in ready if isinstance(d, RecordedRun)])
    rate = options.fit_rate
    return [cleaned(d, rate) if isinstance(d, RecordedRun) else d for d in ready]


def _objective(
    law: type[Law],
    table: LockInTable | None,
    recordings: Sequence[RecordedRun],
    free: list[str],
    given: _Given,
    *,
    options: RunOptions,
    motion: Mapping[str, bool],
) -> Objective:
    """The function to minimise; all inputs are checked before anything is computed."""
    fixed, material = given.fixed, given.material
    require_motion(free, motion)
    require_motion(fixed, motion, label="fixed")
    if recordings:
        require_no_layer(free)
    if recordings and table is None:
        require_seen(recordings, free)
        if not any(run.load_varies for run in recordings):
            counted = ("M", "eta", *motion)
            require_counted(fixed, motion, counted, "a recording of a constant load")
    # The stiffness of a recording is free, shared by all data if it is named.
    shared = "K" in free
    if table is not None and (shared or "K" in fixed):
        require_newtons(recordings)
    named = [name for name in free if not (name == "K" and recordings and table is None)]
    priors = given.priors(free)
    assumed = {}
    if recordings and table is None:
        first = recordings[0]
        assumed = {"V0": first.velocity, "mu0": float(np.median(first.friction[:16]))}
    constants = fixed_values(law, table, free, fixed, material, assumed=assumed)
    require_masses(free, constants, motion)
    begun = start_values(law, free, given.start, material, runs=recordings)
    if table is not None and shared:
        begun, priors = stiffness_of_table(begun, priors, constants.get("W0", math.nan))
    if recordings:
        require_calibrated(
            recordings,
            free,
            priors,
            mu0_given="mu0" in (*free, *fixed, *material_values(material, ["mu0"]))
            or table is not None,
            with_table=table is not None,
        )
        # Its prior makes it free.
        named = [name for name in named if name.partition("[")[0] != GAIN]
    largest = 0.0 if table is None else float(table.points["epsilon"].max())
    usual = usual_ranges(recordings) if recordings else {}
    if "W0" in constants and "K" not in (*begun, *priors):
        W0 = float(np.median(constants["W0"]))
        usual["K"] = (USUAL_STIFFNESS[0] * W0, USUAL_STIFFNESS[1] * W0)
    unknowns = list(
        unknowns_of(
            law,
            named,
            largest_epsilon=largest,
            start=begun,
            priors=priors,
            usual=usual,
        )
    )
    terms: list[DataTerm] = []
    if table is not None:
        count = sum(int(np.isfinite(v).sum()) for v in table.values.values())
        require_enough(table.name, count, unknowns)
        terms.append(LockInTerm(table, law, constants, **motion))
    if recordings:
        if shared and table is None:
            unknowns.append(shared_stiffness(recordings, begun, priors))
        if "mu0" in free and table is None:
            options = replace(options, linear=tuple(n for n in options.linear if n != "offset"))
        terms_of_runs, nuisances = run_terms(
            recordings,
            law,
            {n: v for n, v in constants.items() if np.ndim(v) == 0},
            with_table=table is not None,
            shared_stiffness=shared,
            fixed_stiffness=fixed.get("K"),
            start=begun,
            priors=priors,
            options=options,
            motion=motion,
        )
        terms += terms_of_runs
        unknowns += nuisances
    # The start of a K that is fixed has no influence.
    of_free = {n: v for n, v in (given.start or {}).items() if not (n == "K" and recordings)}
    require_free_names(unknowns, of_free, priors)
    return Objective(
        tuple(terms), law, tuple(unknowns), constants, tolerance=1e-6 if recordings else 1e-10
    )
