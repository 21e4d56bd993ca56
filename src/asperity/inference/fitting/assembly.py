"""The function that a fit minimises, for data of any kind: all inputs are checked here.

Its terms are lock-in tables and recordings, which may be fitted together, or tables of holds, or
averaged cycles.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from asperity.errors import Argument, InputError, require, symbol
from asperity.inference.cycles import AveragedCycle, CycleTerm
from asperity.inference.fitting.inputs import (
    OF_OPTIONS,
    fixed_values,
    require_agreement,
    require_counted,
    require_enough,
    require_masses,
    require_motion,
    require_some,
    start_values,
)
from asperity.inference.holds import HealingTable, HoldTerm, joined_holds
from asperity.inference.objective import DataTerm, Objective
from asperity.inference.runs.assembly import (
    USUAL_STIFFNESS,
    RunOptions,
    over_load,
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
from asperity.inference.runs.cleaning import cleaned
from asperity.inference.runs.gauge import GAIN
from asperity.inference.runs.run import RecordedRun, recorded_run
from asperity.inference.tables.table import LockInTable, joined
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import (
    Prior,
    UnfittableLawError,
    material_priors,
    material_values,
    require_free_names,
    unknowns_of,
)
from asperity.laws import Law
from asperity.materials import Material
from asperity.parameters import MACHINE, law_parameters, point_parameters
from asperity.recording import Trace

#: Assumed mu0 (dimensionless) and V0 (m/s) for healing: it is measured relative to sliding, so that
#: mu0 has no influence.
_OF_THE_LEVEL = {"mu0": 0.6, "V0": 1e-6}

Measured = LockInTable | HealingTable | AveragedCycle | RecordedRun
Data = Measured | Trace


class Given(NamedTuple):
    """Numbers of the caller; fields as the arguments of `fit`."""

    fixed: Mapping[str, Any]
    material: Material | None
    prior: Material | Mapping[str, Prior] | None
    start: Mapping[str, Any] | None

    def priors(self, free: Sequence[str]) -> dict[str, Prior]:
        """Priors by the names of free parameters."""
        prior = self.prior
        return material_priors(prior, free) if isinstance(prior, Material) else dict(prior or {})


def listed_data(data: Data | Iterable[Data], options: RunOptions) -> list[Measured]:
    """Data as a list, with recordings as `RecordedRun`."""
    several = [data] if isinstance(data, Measured | Trace) else list(data)
    require(several, "data", "hold readings or a recording", "none", "give a table or a recording")
    ready = [d if isinstance(d, Measured) else recorded_run(d) for d in several]
    require_own_samples([d for d in ready if isinstance(d, RecordedRun)])
    rate = options.fit_rate
    return [cleaned(d, rate) if isinstance(d, RecordedRun) else d for d in ready]


def objective_of(
    law: type[Law],
    data: Sequence[Measured],
    free: Sequence[str],
    given: Given,
    *,
    options: RunOptions | None = None,
    motion: Mapping[str, bool] | None = None,
) -> Objective:
    """The function to minimise for some data.

    Parameters
    ----------
    law : type of Law
    data : sequence
        As `listed_data` returns them.
    free : sequence of str
    given : Given
    options : RunOptions, optional
    motion : mapping, optional
        Whether `inertia` and `radiation_damping` count; neither by default.

    Raises
    ------
    InputError
        As `fit`.
    """
    motion = motion or {"inertia": False, "radiation_damping": False}
    cycles = [d for d in data if isinstance(d, AveragedCycle)]
    holds = [d for d in data if isinstance(d, HealingTable)]
    tables = [d for d in data if isinstance(d, LockInTable)]
    recordings = [d for d in data if isinstance(d, RecordedRun)]
    for some, what in ((cycles, "cycles of stick-slip"), (holds, "tables of holds")):
        if some and len(some) < len(data):
            advice = "fit them one after the other, with the first as the prior of the second"
            raise InputError("data", f"be {what} alone or other data", "both", advice)
    called = [d.name for d in data if isinstance(d, AveragedCycle | RecordedRun)]
    rule, advice = "have different names", "give names, or each file once"
    require(len({*called}) == len(called), "recordings", rule, ", ".join(called), advice)
    names = list(free)
    others = options in (None, RunOptions()) or bool(recordings)
    require(others, "runs", "go with recorded runs", "options of runs alone", "leave it out")
    if cycles:
        # A cycle needs a mass.
        require_counted(given.fixed, motion, ("M", "inertia"), "cycles of stick-slip")
        return _of_cycles(law, cycles, names, given)
    if holds:
        require_counted(given.fixed, motion, (), "a table of holds")
        return _of_holds(law, joined_holds(holds), names, given)
    table = joined(tables)[0] if tables else None
    options = options or RunOptions()
    return _of_readings(law, table, recordings, names, given, options=options, motion=motion)


def _of_holds(law: type[Law], table: HealingTable, free: list[str], given: Given) -> Objective:
    """The function to minimise for a table of holds; all inputs are checked."""
    numbers = law_parameters(law)
    for name in free:
        holds, advice = name in numbers, "leave it out: the table has stiffness and velocity"
        require(
            holds, "free", f"be parameters of {law.name} with holds", f"'{symbol(name)}'", advice
        )
    known = point_parameters(law)
    if "V" in given.fixed:
        require_agreement(known["V"], given.fixed["V"], table.V)
    K, W0 = (given.fixed.get(name) for name in ("K", "W0"))
    over = over_load(K)
    if over is None and not (K is None or W0 is None):
        over = known["K"].check(K) / known["W0"].check(W0)
    if over is not None:
        require_agreement(replace(known["K"], kind="per_length"), over, table.K)
    fixed = {n: v for n, v in given.fixed.items() if n not in ("V", "K", "W0")}
    constants = fixed_values(law, None, free, fixed, given.material, assumed=_OF_THE_LEVEL)
    begun, priors = start_values(law, free, given.start, given.material), given.priors(free)
    unknowns = unknowns_of(law, free, start=begun, priors=priors)
    require_free_names(unknowns, given.start, priors)
    require_enough(table.name, table.rows, unknowns)
    if table.errors is None and table.rows <= len(unknowns):
        rule = "have healing_err, or more holds than free parameters"
        got, advice = f"{table.rows} for {len(unknowns)}", "no residuals are left to estimate it by"
        raise UnfittableLawError(table.name, rule, got, advice)
    term = HoldTerm(table, law, constants)
    return Objective((term,), law, unknowns, constants, tolerance=1e-9)


def _of_cycles(
    law: type[Law],
    cycles: Sequence[AveragedCycle],
    free: list[str],
    given: Given,
) -> Objective:
    """The function to minimise for averaged cycles; all inputs are checked."""
    first, numbers = cycles[0], law_parameters(law)
    known = point_parameters(law)
    for name in [n for n in ("V", "W0") if n in given.fixed]:
        require_agreement(known[name], given.fixed[name], [getattr(c, name) for c in cycles])
    # The level of friction is fitted in each cycle.
    fixed = {n: v for n, v in given.fixed.items() if n not in ("V", "W0")}
    level = float(np.mean(first.values[:-1]))
    fixed = {n: v for n, v in {"mu0": level, "V0": first.V}.items() if n in numbers} | fixed
    require_some(law, free)
    advice = "leave it out: a constant friction is fitted in each cycle"
    require("mu0" not in free, "free", "be what the shape of a cycle shows", "'mu0'", advice)
    unseen = [c.name for c in cycles if not c.resolved]
    if unseen and "M" in free:
        rule = "be fixed where a slip is shorter than four samples"
        raise InputError("M", rule, f"it free for {unseen[0]}", "fix M, or sample faster")
    constants = fixed_values(law, None, free, fixed, given.material)
    if "K" in fixed and "K" not in free:
        constants["K"] = float(MACHINE["K"].check(fixed["K"]))
    missing = [n for n in ("K", "M") if n not in free and not constants.get(n)]
    if missing:
        advice = f"name it in {Argument('free')}, or give it in {Argument('fixed')}"
        raise InputError(
            symbol(missing[0]), "be free or fixed for a fit of cycles", "neither", advice
        )
    priors = given.priors(free)
    # A stick loads by K V/W0, and a slip lasts for half a period of sqrt(K/M).
    K = first.loading_slope * first.W0 / first.V
    M = float(constants.get("K", K)) * (first.slip_duration / np.pi) ** 2
    begun = {"K": K, "M": M} | start_values(law, free, given.start, given.material)
    begun, priors = stiffness_of_table(begun, priors, [cycle.W0 for cycle in cycles])
    usual = {"K": (K / 1.5, K * 1.5), "M": (M / 4, M * 2), "B": (first.drop / 40, first.drop / 2)}
    begun = {n: v for n, v in begun.items() if n in free}
    unknowns = unknowns_of(law, free, start=begun, priors=priors, usual=usual)
    require_free_names(unknowns, given.start, priors)
    # A cycle needs a mass.
    unknowns = tuple(
        replace(u, logarithmic=True, scale=1.0) if u.name == "M" else u for u in unknowns
    )
    terms = tuple(CycleTerm(cycle, law, constants) for cycle in cycles)
    return Objective(terms, law, unknowns, constants, curved=True)


def _of_readings(
    law: type[Law],
    table: LockInTable | None,
    recordings: Sequence[RecordedRun],
    free: list[str],
    given: Given,
    *,
    options: RunOptions,
    motion: Mapping[str, bool],
) -> Objective:
    """The function to minimise for a table, recordings, or both."""
    require_motion(free, motion)
    require_motion(given.fixed, motion, label="fixed")
    alone = table is None
    # The stiffness of a recording is free, shared by all data if it is named.
    shared = "K" in free
    # The gain of a gauge is a nuisance of recordings: its prior makes it free.
    of_law = [n for n in free if not (recordings and n.partition("[")[0] == GAIN)]
    constants = _constants(law, table, recordings, free, of_law, given, motion)
    begun, priors, usual = _starts(law, table, recordings, free, given, constants)
    unknowns = list(
        unknowns_of(
            law,
            [n for n in of_law if not (alone and n == "K")],
            largest_epsilon=0.0 if table is None else float(table.points["epsilon"].max()),
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
    elif shared:
        unknowns.append(shared_stiffness(recordings, begun, priors))
    if recordings:
        if "mu0" in free and alone:
            options = replace(options, linear=tuple(n for n in options.linear if n != "offset"))
        terms_of_runs, nuisances = run_terms(
            recordings,
            law,
            _of_recordings(law, constants, motion),
            with_table=not alone,
            shared_stiffness=shared,
            fixed_stiffness=given.fixed.get("K"),
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


def _mu0_is_given(table: LockInTable | None, free: Sequence[str], given: Given) -> bool:
    """Whether mu0 has a value or is free; recordings alone need neither."""
    known = (*free, *given.fixed, *material_values(given.material, ["mu0"]))
    return table is not None or "mu0" in known


def _constants(
    law: type[Law],
    table: LockInTable | None,
    recordings: Sequence[RecordedRun],
    free: list[str],
    of_law: list[str],
    given: Given,
    motion: Mapping[str, bool],
) -> dict[str, Any]:
    """Values of the parameters that are not in `of_law`, the free ones without a gain."""
    assumed = {}
    if recordings:
        require_no_layer(free)
    if table is None:
        require_seen(recordings, free)
        if not any(run.load_varies for run in recordings):
            counted = ("M", "eta", *motion)
            require_counted(given.fixed, motion, counted, "a recording of a constant load")
        # Under a constant load the offset of a recording takes up any mu0.
        first = next((run for run in recordings if run.load_varies), recordings[0])
        mu0_given = _mu0_is_given(table, free, given)
        assumed = _reference_of(first, given.fixed, mu0_given=mu0_given)
    elif "K" in free or "K" in given.fixed:
        require_newtons(recordings)
    constants = fixed_values(law, table, of_law, given.fixed, given.material, assumed=assumed)
    require_masses(free, constants, motion)
    return constants


def _starts(
    law: type[Law],
    table: LockInTable | None,
    recordings: Sequence[RecordedRun],
    free: list[str],
    given: Given,
    constants: Mapping[str, Any],
) -> tuple[dict[str, Any], dict[str, Prior], dict[str, tuple[float, float]]]:
    """Start values, priors, and the usual ranges of further starts."""
    begun = start_values(law, free, given.start, given.material, runs=recordings)
    priors = given.priors(free)
    if "K" in free and table is not None:
        loads = [*np.ravel(constants.get("W0", math.nan)), *(run.W0 for run in recordings)]
        begun, priors = stiffness_of_table(begun, priors, loads)
    usual: dict[str, tuple[float, float]] = {}
    if recordings:
        mu0_given, with_table = _mu0_is_given(table, free, given), table is not None
        require_calibrated(recordings, free, priors, mu0_given=mu0_given, with_table=with_table)
        usual = usual_ranges(recordings)
    if "W0" in constants and "K" not in (*begun, *priors):
        W0 = float(np.median(constants["W0"]))
        usual["K"] = (USUAL_STIFFNESS[0] * W0, USUAL_STIFFNESS[1] * W0)
    return begun, priors, usual


def _reference_of(
    run: RecordedRun, fixed: Mapping[str, Any], *, mu0_given: bool
) -> dict[str, float]:
    """V0 and mu0 of recordings, if they are not given: the first velocity, and friction there.

    Raises
    ------
    InputError
        If V0 is fixed without mu0.
    """
    rule, got = f"come with {symbol('mu0')}", "it alone: the friction at the first velocity"
    advice = f"free {symbol('mu0')}, which is then that at {symbol('V0')}, or leave it out"
    require(mu0_given or "V0" not in fixed, Argument("fixed", "V0"), rule, got, advice)
    return {"V0": run.velocity, "mu0": float(np.median(run.friction[:16]))}


def _of_recordings(
    law: type[Law], constants: Mapping[str, Any], motion: Mapping[str, bool]
) -> dict[str, float]:
    """Constants with one value each: those of a table may be columns.

    Raises
    ------
    InputError
        If one on which the motion depends has several values.
    """
    counted = {*law_parameters(law), *(n for n, option in OF_OPTIONS.items() if motion[option])}
    for name in counted & constants.keys():
        rule, advice = "have one value in a fit with recordings", "fit table and recordings apart"
        require(np.ptp(constants[name]) == 0, symbol(name), rule, "several in the table", advice)
    return {name: float(np.ravel(value)[0]) for name, value in constants.items()}
