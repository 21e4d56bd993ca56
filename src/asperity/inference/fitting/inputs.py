"""Inputs of a fit: start values, fixed parameters, priors, and checks that the data suffice."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from asperity.errors import Argument, InputError, MistakesError, require, symbol, symbols
from asperity.inference.cycles import AveragedCycle
from asperity.inference.holds import HealingTable
from asperity.inference.runs.assembly import PARAMETER, over_load
from asperity.inference.runs.gauge import GAIN
from asperity.inference.runs.run import RecordedRun
from asperity.inference.tables.table import LockInTable, joined
from asperity.inference.unknowns import (
    EPS_RATIO,
    REFERENCES,
    Prior,
    UnfittableLawError,
    Unknown,
    material_priors,
    material_values,
    require_fittable,
)
from asperity.laws import Law, registered
from asperity.materials import Material, load as load_material
from asperity.parameters import (
    MACHINE,
    MODULATION,
    Parameter,
    all_parameters,
    law_parameters,
    point_parameters,
    suggestion,
)
from asperity.questions.fit import NormalPrior
from asperity.questions.record import require_unit
from asperity.units import KINDS, format_si, to_si

#: Parameters of laws that have no influence under a constant load.
_OF_LOAD_CHANGES = ("lambda", "alpha", "L", "V_star")

#: Parameters that count with an option of the equation of motion.
OF_OPTIONS = {"M": "inertia", "eta": "radiation_damping"}
#: Velocity (m/s) at which a free mu0 is reported, if no other is given.
_REFERENCE_VELOCITY = 1e-6


def free_by_default(
    law: type[Law],
    data: Sequence[LockInTable | HealingTable | AveragedCycle | RecordedRun],
    fixed: Mapping[str, Any] | None,
    material: Material | None,
) -> list[str]:
    """Default free parameters: all parameters of a law that the data may determine.

    Parameters
    ----------
    law : type of Law
    data : sequence of LockInTable, HealingTable, AveragedCycle or RecordedRun
        Data of the fit. The stiffness of a recording is always free, and not in the result.
    fixed : mapping, optional
    material : Material, optional
        Source of mu0 if the data have no mean friction.

    Returns
    -------
    list of str
        Parameters of the law, ``eps_ratio`` for a table, and K and M for cycles of stick-slip.
    """
    names = [name for name in law_parameters(law) if name not in REFERENCES]
    if any(isinstance(d, AveragedCycle) for d in data):
        # The level of friction is fitted in each cycle.
        return [n for n in (*names, "K", "M") if n not in {"mu0", *(fixed or {})}]
    tables = [d for d in data if isinstance(d, LockInTable)]
    runs = [d for d in data if isinstance(d, RecordedRun)]
    table = joined(tables)[0] if tables else None
    constant_load = table is None and not any(run.load_varies for run in runs)
    known = {*(fixed or {}), *({} if table is None else table.points)}
    if table is None or ("mean_friction" not in table.values and material and "mu0" in material):
        # The offset of a recording replaces mu0.
        known.add("mu0")
    if table is not None:
        names.append(EPS_RATIO.name)
    return [n for n in names if n not in known and not (constant_load and n in _OF_LOAD_CHANGES)]


def start_values(
    law: type[Law],
    free: Sequence[str],
    start: Mapping[str, Any] | None,
    material: Material | None,
    *,
    runs: Sequence[RecordedRun] = (),
) -> dict[str, Any]:
    """Start values by name in SI, from the user and a material; K as it is given.

    Raises
    ------
    InputError
        If a value is wrong.
    """
    known: dict[str, Any] = {**material_values(material, free)}
    if runs:
        known.pop("K", None)
    for name, value in (start or {}).items():
        # K is converted with its data, which have the unit; `require_free_names` refuses others.
        plain = name in free and name.partition("[")[0] not in ("K", GAIN)
        known[name] = float(_checked(law, "start", name, value)) if plain else value
    return known


def fixed_values(
    law: type[Law],
    table: LockInTable | None,
    free: Sequence[str],
    fixed: Mapping[str, Any] | None,
    material: Material | None,
    *,
    assumed: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Values of all parameters that are not free, by name in SI.

    Without a table, parameters of operating points are left out. Numbers that are given nowhere are
    those in `assumed`. If mu0 is free and V0 is not given, V0 is 1 um/s: the velocity at which mu0
    is reported.

    Raises
    ------
    InputError
        If a name or value is wrong, or a number is missing.
    """
    require_fittable(law, free)
    points: Mapping[str, Any] = {} if table is None else table.points
    of_points = ("V", "epsilon", "frequency", "K", "W0") if table is None else ()
    absent = (*MODULATION, *of_points)
    known = {n: p for n, p in point_parameters(law).items() if n not in absent}
    # The K of a recording is fixed with its load.
    given = {n: v for n, v in (fixed or {}).items() if not (n == "K" and table is None)}
    _require_fixable(law, given, free, known)
    elsewhere = {n: p.default for n, p in known.items() if p.default is not None}
    elsewhere |= {"V0": _REFERENCE_VELOCITY} if "mu0" in free else {}
    elsewhere |= {**(assumed or {}), **material_values(material, known)}
    over = over_load(given.get("K"))
    result: dict[str, Any] = {}
    missing = []
    for name in known:
        if name in free or name == "inertia":
            continue
        column = points.get(name, np.nan)
        recorded = np.isfinite(column)
        if name == "K" and over is not None:
            result[name] = over
        elif name in given:
            result[name] = _checked(law, "fixed", name, given[name])
        elif recorded.all():
            result[name] = column
        elif name not in elsewhere:
            missing.append(name)
        else:
            # One of several tables may have this column.
            some = recorded.any()
            result[name] = np.where(recorded, column, elsewhere[name]) if some else elsewhere[name]
    if missing:
        raise UnfittableLawError(
            law.name,
            "have all its numbers",
            f"none for {symbols(missing)}",
            f"use {Argument('free')} or {Argument('fixed', missing[0])}, add columns, or name a "
            "material",
        )
    if over is not None:
        if "W0" not in result:
            K, W0 = symbol("K"), symbol("W0")
            rule, got = f"come with a fixed {W0}", f"'{given['K']}' and {W0} free"
            raise InputError(
                f"{K} over the load", rule, got, f"give {K} as a stiffness, or fix {W0}"
            )
        result["K"] = result["K"] * result["W0"]
    for name in (n for n in given if n in points):
        require_agreement(known[name], result[name], points[name])
    if "eps_ratio" not in free:
        result["eps_ratio"] = ratio = float(
            _checked(law, "fixed", "eps_ratio", given.get("eps_ratio", 1.0))
        )
        largest = ratio * float(np.max(points.get("epsilon", 0.0)))
        advice = "contact would be lost"
        require(not largest >= 1, "eps_ratio times epsilon", "be below 1", f"{largest:g}", advice)
    return result


def _require_fixable(
    law: type[Law],
    given: Mapping[str, Any],
    free: Sequence[str],
    known: Mapping[str, Parameter],
) -> None:
    """Refuse fixed parameters that are free, or that the law and its data do not have.

    Raises
    ------
    InputError
    """
    for name in given:
        require(name not in free, symbol(name), "be free or fixed", "both", "leave one out")
        rule, advice = "be parameters of a harmonic load", "leave it out: fits take no other load"
        require(name not in MODULATION, "fixed", rule, f"'{symbol(name)}'", advice)
        if name not in known and name != "eps_ratio":
            rule = f"be parameters of {law.name}"
            advice = suggestion(name, known, "leave it out or choose another law")
            raise InputError("fixed", rule, f"'{symbol(name)}'", advice)


def require_agreement(parameter: Parameter, fixed: Any, column: Any) -> None:
    """Refuse a fixed number that differs from the numbers of the data.

    Parameters
    ----------
    parameter : Parameter
    fixed : float, str or array
        In SI, or a text with its unit.
    column : array
        In SI; NaN where the data have no number.

    Raises
    ------
    InputError
    """
    column, value = np.broadcast_arrays(np.atleast_1d(column), parameter.check(fixed))
    other = np.isfinite(column) & ~np.isclose(column, value, rtol=1e-9, atol=0.0)
    if other.any():
        at, kind = int(np.argmax(other)), parameter.kind
        got = f"{format_si(value[at], kind)} and {format_si(column[at], kind)}"
        rule, advice = "agree with the column of the data", "leave it out, or remove the column"
        raise InputError(Argument("fixed", parameter.name), rule, got, advice)


def _checked(law: type[Law], field: str, name: str, value: Any) -> Any:
    """A value in SI, checked by the rule of its parameter; a text has a unit."""
    known = {**point_parameters(law), EPS_RATIO.name: EPS_RATIO}
    try:
        return known[name].check(value)
    except InputError as error:
        raise error.about(Argument(field, key=name)) from None


def require_some(law: type[Law], free: Sequence[str]) -> None:
    """Refuse a fit without free parameters.

    Raises
    ------
    InputError
    """
    rule = f"name a parameter of {law.name}"
    require(free, "free", rule, "none", f"free one, such as {symbol('A')} or eps_ratio")


def require_motion(
    names: Collection[str], motion: Mapping[str, bool], *, label: str = "free"
) -> None:
    """Refuse M without inertia and eta without radiation damping.

    Parameters
    ----------
    names : collection of str
        Parameters that are free, or that the user has fixed.
    motion : mapping of str to bool
        ``inertia`` and ``radiation_damping``.
    label : str
        Name of `names` in messages.

    Raises
    ------
    InputError
    """
    for name, option in OF_OPTIONS.items():
        if name in names and not motion[option]:
            got = f"'{name}', which has no influence without {option.replace('_', ' ')}"
            advice = f"add {Argument(option, value='True')} or leave it out"
            raise InputError(label, "be parameters that count", got, advice)


def require_masses(
    free: Collection[str], constants: Mapping[str, Any], motion: Mapping[str, bool]
) -> None:
    """Refuse inertia without M and radiation damping without eta.

    Parameters
    ----------
    free : collection of str
    constants : mapping of str to number or array
        Values of the parameters that are not free.
    motion : mapping of str to bool
        As of `require_motion`.

    Raises
    ------
    InputError
    """
    for name, option in OF_OPTIONS.items():
        known = name in free or np.all(np.asarray(constants.get(name, 0.0)) > 0)
        like = Argument("fixed", name, MACHINE[name].example)
        advice = f"add {like}, or name it in {Argument('free')}"
        require(known or not motion[option], option, f"go with a value of {name}", "none", advice)


def require_counted(
    fixed: Collection[str], motion: Mapping[str, bool], counted: Collection[str], data: str
) -> None:
    """Refuse numbers and terms of the equation of motion on which a kind of data does not depend.

    Parameters
    ----------
    fixed : collection of str
        Parameters that the user has fixed.
    motion : mapping of str to bool
        As of `require_motion`.
    counted : collection of str
        Those of M, eta, eps_ratio, inertia and radiation_damping on which the data depend.
    data : str
        The kind of data in messages.

    Raises
    ------
    InputError
    """
    rule, advice = "have an influence", "leave it out"
    for option, included in motion.items():
        require(option in counted or not included, option, rule, f"it with {data}", advice)
    for name in ("M", "eta", EPS_RATIO.name):
        given = name in fixed and name not in counted
        require(not given, Argument("fixed", name), rule, f"it with {data}", advice)


def require_enough(name: str, count: int, unknowns: Sequence[Unknown]) -> None:
    """Refuse a table of `count` data unless it has more of them than free parameters.

    With one datum for the only parameter, the fit is an inversion. With equally many data and
    parameters, the minima form a valley if some parameters have no influence, and no degree of
    freedom is left to judge the law.

    Raises
    ------
    InputError
    """
    needed = sum(1 for u in unknowns if u.prior is None)
    rule = "hold more data than free parameters"
    advice = f"free fewer with {Argument('free')}, or measure more"
    got = f"{count} for {len(unknowns)} ({symbols(u.name for u in unknowns)})"
    require(not count < max(needed + (needed > 1), 1), name, rule, got, advice)


def priors_of(
    given: Mapping[str, NormalPrior | None], free: Sequence[str] | None
) -> dict[str, Prior]:
    """Priors by the names of parameters, in SI; those by name take precedence over a material.

    Parameters
    ----------
    given : mapping of str to NormalPrior or None
        Priors by parameter; the name of a material with None means its published uncertainties.
    free : sequence of str or None
        Parameters that get the priors of a material.

    Raises
    ------
    InputError
        If a name is no parameter, a value has another unit, or a deviation is not positive.
    """
    known = {**all_parameters(registered().values()), EPS_RATIO.name: EPS_RATIO, GAIN: PARAMETER}
    of_materials: dict[str, Prior] = {}
    result: dict[str, Prior] = {}
    for name, prior in given.items():
        if prior is None:
            if free is None:
                rule, got = f"go with {Argument('free')}", "no free parameters"
                advice = "name those that the priors of the material are meant for"
                raise InputError(f"{Argument('prior', value=name)}", rule, got, advice)
            try:
                material = load_material(name)
            except MistakesError:
                raise
            except InputError as error:
                raise error.about("prior") from None
            of_materials |= material_priors(material, free)
            continue
        parameter = known.get(name.partition("[")[0])
        if parameter is None:
            raise InputError("prior", "name a parameter", f"'{name}'", suggestion(name, known))
        label = f"{Argument('prior', name)}"
        mean, unit = _of_some_kind(parameter, prior.mean, label)
        sd, other = _of_some_kind(parameter, prior.std, label)
        rule = "have a positive deviation" if unit == other else "have one unit"
        got = f"{sd:g}" if unit == other else f"{unit} and {other}"
        require(sd > 0 and unit == other, label, rule, got, "give one")
        result[name] = Prior(mean, sd, "given", unit)
    return of_materials | result


def _of_some_kind(parameter: Parameter, value: float | str, label: str) -> tuple[float, str]:
    """SI value and SI unit; K may be a force, a stress or a pure number over a length."""
    require_unit(value, parameter.kind, label)
    others = ["stress_per_length", "per_length"] if parameter.name == "K" else []
    if isinstance(value, str):
        for kind in others:
            with contextlib.suppress(InputError):
                return float(to_si(value, kind, label)), KINDS[kind].si
    return float(to_si(value, parameter.kind, label)), parameter.unit
