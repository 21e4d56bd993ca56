"""Terms and free parameters of recorded runs, from the arguments of a fit.

A gain of the gauge multiplies F/W. Under a constant load a recording determines only the products
of the gain with A, B, mu0 and K: the gain needs a prior from a calibration. Recordings that contain
the same samples would count twice, and are refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument, InputError, enumerated, require, symbol
from asperity.inference.runs.gauge import GAIN
from asperity.inference.runs.run import STIFFNESS, RecordedRun
from asperity.inference.runs.term import (
    Linear as Linear,
    RunOptions as RunOptions,
    RunTerm,
    about_zero,
    cut_delays,
)
from asperity.inference.unknowns import Prior, UnfittableLawError, Unknown, unknown_of
from asperity.laws import Law
from asperity.parameters import MACHINE, Parameter

#: Search range of the stiffness over the load (1/m): deformation apparatus and tribometers.
USUAL_STIFFNESS = (5e2, 5e4)
#: Smallest number of samples of a run per free parameter.
_SAMPLES_PER_PARAMETER = 8
#: Names of parameters of an air layer: its gap, the radius of the patch and the pressure.
_LAYER = ("gap", "h0", "R", "radius", "patch_radius", "P0", "pressure")
#: Loads that differ by less than this share are one.
ONE_LOAD = 1e-3
#: Prior standard deviations of the departures of initial friction and states from steady sliding.
_START_FORCE, _START_STATE = 0.05, 2.0


def stiffness_in(run: RecordedRun, value: Any, label: str = "K") -> float:
    """A stiffness, which may be given over the load (``"0.003 1/um"``), in the unit of the run."""
    return _stiffness(value, run.load_unit, run.W0, label)


def _stiffness(value: Any, load_unit: str, W0: float, label: str) -> float:
    over = over_load(value, label) if load_unit else None
    parameter = replace(MACHINE["K"], kind=STIFFNESS[load_unit])
    return float(parameter.check(value, symbol(label))) if over is None else over * W0


def over_load(value: Any, label: str = "K") -> float | None:
    """A stiffness over the load (1/m), as rock laboratories give it; None for other values."""
    if not isinstance(value, str):
        return None
    try:
        return float(replace(MACHINE["K"], kind="per_length").check(value, label))
    except InputError:
        return None


def usual_ranges(runs: Sequence[RecordedRun]) -> dict[str, tuple[float, float]]:
    """Search range of the memory length, from the sampling and the slip of the runs."""
    shortest, longest = np.inf, 0.0
    for run in runs:
        slips = np.abs(np.diff(np.interp(run.drive.edges, run.time, run.slip)))
        longest = max(longest, 0.2 * float(slips.max()))
        slowest = min(v for v in run.velocities if v > 0)
        shortest = min(shortest, slowest * float(np.median(np.diff(run.time))))
    low = max(shortest, 1e-8)
    return {"D0": (low, max(longest, 10 * low))}


def require_seen(runs: Sequence[RecordedRun], free: Sequence[str]) -> None:
    """Refuse parameters that have no influence in any of the runs.

    Raises
    ------
    InputError
        If a free parameter acts on load changes only and the load is constant, if one acts on
        velocity changes only and the velocity is constant, or if there are too few samples.
    """
    names = ", ".join(run.name for run in runs)
    for name in ("alpha", "eps_ratio"):
        rule, got = "be seen in a change of the load", f"a constant load in {names}"
        advice = f"fix {name}, or add a recording with load steps or a modulated load"
        require(name not in free or any(run.load_varies for run in runs), name, rule, got, advice)
    for name in ("A", "B", "D0", "K") if "M" not in free else ():
        holds = name not in free or any(run.cuts or run.load_varies for run in runs)
        rule = "be seen in a change of the velocity or of the load"
        advice = "add a recording with velocity steps or holds, or give the steps"
        require(holds, symbol(name), rule, f"neither in {names}", advice)
    for run in runs:
        needed = _SAMPLES_PER_PARAMETER * (len(free) + len(run.cuts) + 2)
        rule = f"have at least {needed} samples for {len(free)} free parameters"
        if run.time.size < needed:
            advice = "free fewer or give a longer window"
            raise UnfittableLawError(run.name, rule, run.time.size, advice)


def require_no_layer(free: Sequence[str]) -> None:
    """Refuse parameters of an air layer as free parameters of recordings.

    Raises
    ------
    InputError
    """
    for name in free:
        if name in _LAYER:
            raise InputError(
                "free",
                "be parameters of the motion in a recording",
                f"'{name}' of an air layer: a layer has one share of the load at one frequency of "
                "modulation, and a step of the load passes it within a relaxation time",
                "free eps_ratio, and take the gap or the radius from it (asperity.air)",
            )


def run_terms(
    runs: Sequence[RecordedRun],
    law: type[Law],
    constants: Mapping[str, Any],
    *,
    with_table: bool,
    shared_stiffness: bool,
    fixed_stiffness: Any,
    start: Mapping[str, Any],
    priors: Mapping[str, Prior],
    options: RunOptions,
    motion: Mapping[str, bool],
) -> tuple[list[RunTerm], list[Unknown]]:
    """Terms of the runs, and free parameters of single runs.

    Parameters
    ----------
    runs : sequence of RecordedRun
    law : type of Law
    constants : mapping of str to float
        Parameters that are not free, except those of single runs.
    with_table : bool
        Whether lock-in readings are fitted together with the runs and share their K.
    shared_stiffness : bool
        Whether K is one parameter of all runs, which the caller has freed.
    fixed_stiffness : str or float, optional
        K if it is not free.
    start, priors : mapping
        Start values and priors, by names of the nuisances; K stands for the K of each run.
    options : RunOptions
    motion : mapping of str to bool
        ``inertia`` and ``radiation_damping``.
    """
    terms, unknowns = [], []
    for run in runs:
        suffix = f"[{run.name}]" if len(runs) > 1 or with_table else ""
        nuisances = cut_delays(run, suffix)
        fixed = {name: value for name, value in constants.items() if name != "K"}
        if fixed_stiffness is not None:
            fixed["K"] = stiffness_in(run, fixed_stiffness)
        elif not shared_stiffness:
            nuisances.append(free_stiffness(run, f"K{suffix}", start, priors))
        nuisances += _gain(suffix, priors)
        if options.initial == "free":
            nuisances += _initial(law, suffix)
        terms.append(
            RunTerm(
                run,
                law,
                fixed,
                options,
                nuisances=tuple(nuisances),
                suffix=suffix,
                **motion,
            )
        )
        unknowns += nuisances
    return terms, unknowns


def free_stiffness(
    run: RecordedRun, name: str, start: Mapping[str, Any], priors: Mapping[str, Prior]
) -> Unknown:
    """The stiffness of a run as a free parameter."""
    parameter = replace(MACHINE["K"], kind=STIFFNESS[run.load_unit], name=name)
    given = start.get(name, start.get("K"))
    usual = (USUAL_STIFFNESS[0] * run.W0, USUAL_STIFFNESS[1] * run.W0)
    return unknown_of(
        parameter,
        None if given is None else stiffness_in(run, given, f"start.{name}"),
        _prior_in(priors.get(name, priors.get("K")), run.stiffness_unit, run.W0, run.name),
        usual,
    )


def _prior_in(prior: Prior | None, unit: str, W0: float, data: str) -> Prior | None:
    """A prior of the stiffness of some data in its unit."""
    if prior is None or prior.unit in ("", unit):
        return prior
    if prior.unit == "1/m":
        return Prior(prior.mean * W0, prior.sd * W0, prior.source, unit)
    units = " or ".join(dict.fromkeys((unit, "1/m")))
    raise InputError(Argument("prior", "K"), f"be in {units} for {data}", prior.unit, "convert it")


def stiffness_of_table(
    start: Mapping[str, Any], priors: Mapping[str, Prior], W0: Any
) -> tuple[dict[str, Any], dict[str, Prior]]:
    """Starts and priors with those of K in N/m, converted if they are given over the load W0.

    Raises
    ------
    InputError
        If the load is no single number, or the prior is of a stress.
    """
    _require_one_load(W0, start, priors)
    load, text = float(np.ravel(W0)[0]), start.get("K")
    of_start = {} if text is None else {"K": _stiffness(text, "N", load, "start.K")}
    in_newtons = _prior_in(priors.get("K"), "N/m", load, "a table")
    of_prior = {} if in_newtons is None else {"K": in_newtons}
    return {**start, **of_start}, {**priors, **of_prior}


def _require_one_load(W0: Any, start: Mapping[str, Any], priors: Mapping[str, Prior]) -> None:
    """Refuse a start or prior of one K over several loads: its value would be that of one load.

    Raises
    ------
    InputError
    """
    prior, low, high = priors.get("K"), float(np.min(W0)), float(np.max(W0))
    if over_load(start.get("K")) is not None or (prior is not None and prior.unit == "1/m"):
        rule, got = f"come with one {symbol('W0')}", "several or none"
        advice = f"give {symbol('K')} as a stiffness"
        one = high - low <= ONE_LOAD * low
        require(one, f"{symbol('K')} over the load", rule, got, advice)


def shared_stiffness(
    runs: Sequence[RecordedRun], start: Mapping[str, Any], priors: Mapping[str, Prior]
) -> Unknown:
    """The stiffness of all runs as one free parameter.

    Raises
    ------
    InputError
        If their loads have different units, or a start or prior is over several loads.
    """
    units = list(dict.fromkeys(run.load_unit or "none" for run in runs))
    rule = "be one for all runs if it is named"
    advice = f"leave {symbol('K')} out of the free parameters: each run then has its own"
    require(len(units) <= 1, symbol("K"), rule, f"loads in {' and '.join(units)}", advice)
    _require_one_load([run.W0 for run in runs], start, priors)
    return free_stiffness(runs[0], "K", start, priors)


def require_newtons(runs: Sequence[RecordedRun]) -> None:
    """Refuse a stiffness that recordings share with a table if their units differ.

    Raises
    ------
    InputError
        If the load of a recording is not in newtons.
    """
    for run in runs:
        if run.load_unit != "N":
            K = symbol("K")
            raise InputError(
                f"{K} must be in {run.stiffness_unit} for {run.name}, got that of a table in N/m; "
                f"leave {K} out of the free and the fixed parameters, and give the table a column "
                "of K"
            )


def _initial(law: type[Law], suffix: str) -> list[Unknown]:
    """Departures of the initial force and states from steady sliding, as free parameters."""
    places = [("start_force", _START_FORCE)]
    places += [(f"start_state_{i}", _START_STATE) for i in range(len(law.state_names))]
    meaning = "departure of the initial state from steady sliding"
    return [
        about_zero(
            Parameter(name + suffix, "dimensionless", "finite", meaning, place="drive"),
            sd,
            10 * sd,
            "wide",
        )
        for name, sd in places
    ]


PARAMETER = Parameter(
    GAIN, "dimensionless", "positive", "recorded friction over that of the law", place="drive"
)


def _gain(suffix: str, priors: Mapping[str, Prior]) -> list[Unknown]:
    """The gain of a run as a free parameter; none without a prior.

    Parameters
    ----------
    suffix : str
        "[name of the run]" if there are several data sets.
    priors : mapping of str to Prior
        Priors; ``gain`` stands for the gain of each run, ``gain[name]`` for that of one run.
    """
    name = GAIN + suffix
    prior = priors.get(name, priors.get(GAIN))
    if prior is None:
        return []
    return [unknown_of(replace(PARAMETER, name=name), prior.mean, prior, None, nuisance=True)]


def require_calibrated(
    runs: Sequence[RecordedRun],
    free: Sequence[str],
    priors: Mapping[str, Prior],
    *,
    mu0_given: bool,
    with_table: bool,
) -> None:
    """Refuse a gain without a prior, and a gain that a load change would falsely determine.

    Parameters
    ----------
    runs : sequence of RecordedRun
    free : sequence of str
    priors : mapping of str to Prior
    mu0_given : bool
        Whether mu0 is free, or fixed to a number that is not from the recording.
    with_table : bool
        Whether lock-in readings are fitted together with the runs.

    Raises
    ------
    InputError
    """
    given = [n for n in priors if n.partition("[")[0] == GAIN]
    several = len(runs) > 1 or with_table
    for name in free:
        holds = name.partition("[")[0] != GAIN or name in given or GAIN in given
        scaled = enumerated([symbol(n) for n in ("A", "B", "mu0", "K")])
        got = f"none: {scaled} scale with it, so that a recording cannot tell it"
        advice = (
            f"give one by a calibration of the gauge, like {Argument('prior', name, '1+-0.02')}"
        )
        require(holds, name, "have a prior", got, advice)
    known = [GAIN, *((f"{GAIN}[{run.name}]" for run in runs) if several else ())]
    for name in [*given, *(n for n in free if n.partition("[")[0] == GAIN)]:
        rule = f"name {' or '.join(known)}"
        require(name in known, "prior", rule, f"'{name}'", "correct the name")
    varying = [run.name for run in runs if run.load_varies]
    if given and varying and not mu0_given:
        rule = f"be free or given with a gain under a load that changes, as in {varying[0]}"
        got = "neither: the first friction would stand for it, without the gain"
        raise InputError("mu0", rule, got, "free mu0, or fix it")


#: Number of equal samples in a row, and of different values among them, that is no chance.
_EQUAL, _DIFFERENT = 64, 16


def require_own_samples(runs: Sequence[RecordedRun]) -> None:
    """Refuse recordings of which two contain the same samples, at any times.

    Raises
    ------
    InputError
        If 64 successive samples, with at least 16 different values, occur in two recordings.
    """
    for first, second in combinations(runs, 2):
        shared = _same_samples(first.friction, second.friction)
        if shared is None:
            continue
        a, b = (run.origin + run.time[k] for run, k in zip((first, second), shared, strict=True))
        got = f"those from {b:.6g} s on equal to those of {first.name} from {a:.6g} s on"
        advice = "give each recording once, in windows that do not overlap: they would count twice"
        raise InputError(second.name, "hold samples of its own", got, advice)


def _same_samples(x: Float, y: Float) -> tuple[int, int] | None:
    """Indices in x and y of the first run of samples that both contain; None without."""
    rows = x[: x.size // _EQUAL * _EQUAL].reshape(-1, _EQUAL)
    various = 1 + (np.diff(np.sort(rows, axis=1), axis=1) > 0).sum(axis=1) >= _DIFFERENT
    places = {rows[k].tobytes(): k for k in np.flatnonzero(various)[::-1]}
    whole, size = y.tobytes(), y.itemsize
    for j in range(y.size - _EQUAL + 1 if places else 0):
        k = places.get(whole[size * j : size * (j + _EQUAL)])
        if k is not None:
            return int(k) * _EQUAL, j
    return None
