"""A plan in SI, with everything looked up: what two runs are compared by.

A record is a tree of JSON values. It names no file, so that a worker on another machine needs
nothing but the record.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import sys
from collections.abc import Iterator, Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import numpy as np

from asperity import materials
from asperity.errors import InputError
from asperity.laws import get_law, known_law
from asperity.operating_point import known_parameters, sourced_numbers
from asperity.parameters import Parameter, canonical_name, point_parameters, suggestion
from asperity.parameters.arguments import shown
from asperity.study.axes import SOBOL_BITS, TEXTS, columns_of
from asperity.study.plan import AxisTable, PlanError, SweepPlan
from asperity.study.points import RATIOS
from asperity.study.solve import SOLVES

#: Variables of every store with a number for each point, and with one for each chunk.
OF_POINTS, OF_CHUNKS = ("outcome", "detail"), ("checksum", "status")
#: Group of every store that has its attributes once more.
ATTRIBUTES = "attributes"
#: Names that no axis may have.
_TAKEN = (*OF_POINTS, *OF_CHUNKS, ATTRIBUTES, *TEXTS)

#: Rows that an axis may list: they are kept in memory and in the record.
MOST_LISTED = 1_000_000


def plan_record(plan: SweepPlan) -> dict[str, Any]:
    """The record of a plan.

    Raises
    ------
    PlanError
        With all mistakes that concern the meaning of its fields.
    """
    mistakes: list[str] = []
    axes: dict[str, Any] = {}
    plan = with_places(plan)
    laws = laws_named(plan, mistakes)
    known = known_names(laws, plan.solve)
    for name, table in plan.axes.items():
        try:
            written, axis = _axis(name, table, known, plan.seed)
            if written in axes:
                raise InputError(
                    f"axis must be given once, got '{written}' under two names; leave one out"
                )
            axes[written] = axis
        except InputError as error:
            mistakes.append(f"axes.{name}: {error}")
    if not plan.axes:
        mistakes.append("axes must have at least one axis, got none; add a table like [axes.K]")
    numbers: dict[str, float] = {}
    origins: dict[str, str] = {}
    try:
        numbers, origins = _numbers(plan, axes, laws, known)
    except InputError as error:
        mistakes.append(str(error))
    solve = SOLVES[plan.solve]
    settings: dict[str, Any] = {}
    outputs: tuple[str, ...] = ()
    supplied: tuple[str, ...] = ()
    try:
        named = plan.model_copy(update={"law": laws[0]}) if plan.law and laws else plan
        settings = solve.settings(named)
        outputs = solve.chosen_outputs(named)
        supplied = solve.supplied(named)
    except InputError as error:
        mistakes.append(str(error))
    if not mistakes:
        mistakes += _missing(laws, axes, numbers, supplied)
        mistakes += _twice(axes)
        mistakes += _misnamed(axes, {*known, *outputs, *_TAKEN})
    if mistakes:
        raise PlanError(mistakes)
    return {
        "solve": plan.solve,
        **({"settings": settings} if settings else {}),
        "laws": laws,
        **({"law_files": files} if (files := _law_files(plan)) else {}),
        "numbers": numbers,
        "origins": origins,
        "axes": axes,
        "outputs": list(outputs),
        **({"chunk": plan.chunk} if plan.chunk else {}),
    }


def known_names(laws: Sequence[str], solve: str) -> dict[str, Parameter]:
    """Every name that an axis or a fixed number may have."""
    parameters = {**known_parameters(laws[0] if laws else None), **SOLVES[solve].parameters()}
    return {**parameters, **{name: ratio.parameter for name, ratio in RATIOS.items()}}


def law_places(plan: SweepPlan) -> tuple[str, ...]:
    """Places of the laws that the plan names by one; files by their whole path."""
    named = dict.fromkeys(map(str, _named(with_places(plan))))
    return tuple(text for text in named if ":" in text)


def _law_files(plan: SweepPlan) -> dict[str, str]:
    """SHA-256 of the file of each law that is named by its place, by its name."""
    found = {}
    for place in law_places(plan):
        module = sys.modules[get_law(known_law(place)).__module__]
        content = Path(str(module.__file__)).read_bytes()
        found[known_law(place)] = hashlib.sha256(content).hexdigest()
    return found


def with_places(plan: SweepPlan) -> SweepPlan:
    """The plan with whole paths: files of laws lie beside it, or where their path says."""

    def place(law: Any) -> Any:
        if isinstance(law, list | tuple):
            return type(law)(place(one) for one in law)
        file, _, name = str(law).rpartition(":")
        return f"{(plan.folder / file).resolve()}:{name}" if file.endswith(".py") else law

    axes = {}
    for name, table in plan.axes.items():
        fields: dict[str, Any] = {}
        if name == "law" and table.values is not None:
            fields["values"] = place(table.values)
        if table.zip is not None and "law" in table.zip:
            fields["zip"] = {**table.zip, "law": place(table.zip["law"])}
        if table.cases is not None:
            fields["cases"] = tuple(
                {**case, "law": place(case["law"])} if "law" in case else case
                for case in table.cases
            )
        axes[name] = table.model_copy(update=fields)
    return plan.model_copy(update={"law": place(plan.law), "axes": axes})


def _named(plan: SweepPlan) -> list[Any]:
    """Laws as the plan writes them, in their order."""
    named: list[Any] = [plan.law] if plan.law else []
    for name, table in plan.axes.items():
        if name == "law" and table.values is not None:
            named += table.values
        if table.zip is not None:
            named += table.zip.get("law", ())
        for case in table.cases or ():
            value = case.get("law")
            named += value if isinstance(value, list | tuple) else [value] if value else []
    return named


def laws_named(plan: SweepPlan, mistakes: list[str]) -> list[str]:
    """Laws of the plan, without repetition, in their order."""
    named = _named(plan)
    found = []
    for law in dict.fromkeys(named):
        try:
            found.append(known_law(str(law)) if ":" in str(law) else get_law(str(law)).name)
        except InputError as error:
            mistakes.append(str(error))
    if not named:
        mistakes.append(
            "law must be given, got nothing; add law = 'elasto-plastic' or an axis of laws"
        )
    return found


def _axis(
    name: str, table: AxisTable, known: Mapping[str, Parameter], seed: int
) -> tuple[str, dict[str, Any]]:
    """Name and record of an axis."""
    if table.draw is not None:
        spreads = {
            _name(column, known): _spread(column, spread, known)
            for column, spread in (table.over or {}).items()
        }
        if not spreads:
            raise InputError("over must name what is drawn, got nothing; add over.K = { ... }")
        if table.draw == "sobol" and (table.count or 0) > 2**SOBOL_BITS:
            raise InputError(
                f"count must be at most 2^{SOBOL_BITS} of a Sobol sequence, got {table.count:,}; "
                "draw 'halton' or 'random'"
            )
        return name, {
            "draw": table.draw,
            "seed": seed,
            "count": table.count,
            "over": spreads,
        }
    if table.zip is not None:
        columns = {_name(n, known): _column(n, v, known) for n, v in table.zip.items()}
        lengths = {n: len(v) for n, v in columns.items()}
        if len(set(lengths.values())) != 1:
            raise InputError(
                "zip must have lists of one length, got "
                + (", ".join(f"{k} of {v}" for k, v in lengths.items()) or "nothing")
                + "; make them equal"
            )
        return name, _listed(columns)
    if table.cases is not None:
        return name, _listed(_cases(table.cases, known))
    own = _name(name, known)
    if table.values is not None:
        return own, _listed({own: _column(name, table.values, known)})
    grid = {"from": table.from_, "to": table.to, "count": table.count, "spacing": table.spacing}
    return own, _listed({own: _grid(name, grid, known)})


def _listed(columns: Mapping[str, list[Any]]) -> dict[str, Any]:
    _check_length(len(next(iter(columns.values()))))
    return {"columns": dict(columns)}


def _check_length(length: int) -> None:
    """Refuse an axis without rows, or of more than are kept in memory."""
    if not 1 <= length <= MOST_LISTED:
        raise InputError(
            f"axis must have from 1 to {MOST_LISTED:,} rows, got {length:,}; draw them, or split "
            "the axis"
        )


def _name(name: str, known: Mapping[str, Parameter]) -> str:
    """The one name of a column."""
    if name in TEXTS:
        return name
    found = canonical_name(name, known)
    if found is None:
        raise InputError(
            f"axis must be a parameter, a ratio or 'law', got {shown(name)}; "
            + suggestion(name, {**known, "law": Parameter("law", "dimensionless", "finite")})
        )
    return found


def _column(name: str, values: Sequence[Any], known: Mapping[str, Parameter]) -> list[Any]:
    """Values in SI; None where a row has none."""
    own = _name(name, known)
    if own == "law":
        return [_law_name(value) for value in values]
    if own in TEXTS:
        return [str(value) for value in values]
    return [None if value == "" else _value(known[own], value) for value in values]


def _law_name(value: Any) -> str:
    return known_law(str(value)) if ":" in str(value) else get_law(str(value)).name


def _value(parameter: Parameter, value: Any) -> float:
    found = parameter.check(value)
    if np.ndim(found):
        raise InputError(f"{parameter.name} must be one number, got {shown(value)}")
    return float(found)


def _grid(name: str, table: Mapping[str, Any], known: Mapping[str, Parameter]) -> list[float]:
    """Values at equal distances or ratios, both ends among them."""
    own = _name(name, known)
    extra = set(table) - {"from", "to", "count", "spacing"}
    if own in TEXTS or extra or not {"from", "to", "count"} <= set(table):
        raise InputError(
            f"{name} must have from, to and count, got {', '.join(sorted(table))}; write it like "
            "{ from = 0.01, to = 0.5, count = 20 }"
        )
    low, high = _value(known[own], table["from"]), _value(known[own], table["to"])
    count, spacing = table["count"], table.get("spacing") or "linear"
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_LISTED:
        raise InputError(f"count must be from 1 to {MOST_LISTED:,}, got {shown(count)}")
    _check_spacing(name, spacing, low, high, ("linear", "log"))
    u = np.linspace(0.0, 1.0, count)
    values = low * (high / low) ** u if spacing == "log" else low + (high - low) * u
    # Fifteen digits: what a longer grid of the same step has in common with this one is then
    # the same to the last bit, and decimal steps are the numbers that one would write.
    return [float(f"{value:.15g}") for value in values]


def _check_spacing(
    name: str, spacing: Any, low: float, high: float, kinds: tuple[str, ...]
) -> None:
    if spacing not in kinds:
        raise InputError(
            f"{name}.spacing must be {' or '.join(kinds)}, got {shown(spacing)}; choose one"
        )
    if spacing == "log" and not low * high > 0:
        raise InputError(
            f"{name} must have ends above zero to be logarithmic, got {low:g} and {high:g}; "
            "change them or the spacing"
        )


def _spread(name: str, table: Mapping[str, Any], known: Mapping[str, Parameter]) -> dict[str, Any]:
    """How a number is drawn: ends or mean and standard deviation in SI, and the kind."""
    own = _name(name, known)
    if own in TEXTS:
        raise InputError(f"over must name numbers, got '{own}'; add an axis of its values")
    if set(table) == {"mean", "std"}:
        mean, std = _value(known[own], table["mean"]), _width(known[own], table["std"])
        return {"low": mean, "high": std, "kind": "normal"}
    if not {"from", "to"} <= set(table) <= {"from", "to", "spacing"}:
        raise InputError(
            f"over.{name} must have from and to, or mean and std, got "
            f"{', '.join(sorted(table)) or 'nothing'}; write it like {{ from = 0.01, to = 0.5 }}"
        )
    low, high = _value(known[own], table["from"]), _value(known[own], table["to"])
    spacing = table.get("spacing", "linear")
    _check_spacing(f"over.{name}", spacing, low, high, ("linear", "log"))
    return {"low": low, "high": high, "kind": spacing}


def _width(parameter: Parameter, value: Any) -> float:
    """A standard deviation, in the unit of its number."""
    from asperity.parameters import obeying

    return float(obeying(value, f"{parameter.name}.std", parameter.kind, "positive"))


def _cases(cases: Sequence[Mapping[str, Any]], known: Mapping[str, Parameter]) -> dict[str, Any]:
    """Rows of all cases, each with every combination of its lists."""
    names = dict.fromkeys(_name(name, known) for case in cases for name in case)
    columns: dict[str, list[Any]] = {name: [] for name in names}
    length = 0
    for case in cases:
        lists = {}
        for name, value in case.items():
            if isinstance(value, Mapping):
                lists[_name(name, known)] = _grid(name, value, known)
            else:
                values = value if isinstance(value, list | tuple) else [value]
                lists[_name(name, known)] = _column(name, values, known)
        length += math.prod(map(len, lists.values()))
        _check_length(length)
        for row in itertools.product(*lists.values()):
            own = dict(zip(lists, row, strict=True))
            for name in names:
                columns[name].append(own.get(name, "" if name in TEXTS else None))
    if not columns:
        raise InputError("cases must have at least one case, got none; write [{ law = '...' }]")
    return columns


def _numbers(
    plan: SweepPlan,
    axes: Mapping[str, Any],
    laws: Sequence[str],
    known: Mapping[str, Parameter],
) -> tuple[dict[str, float], dict[str, str]]:
    """Numbers that are the same everywhere, in SI, and where each comes from."""
    material = None
    if plan.material:
        file = plan.material.endswith(".toml")
        material = materials.load(plan.folder / plan.material if file else plan.material)
    ratios = {
        found: _value(RATIOS[found].parameter, value)
        for name, value in plan.parameters.items()
        if (found := str(canonical_name(name, known))) in RATIOS
    }
    given = {n: v for n, v in plan.parameters.items() if canonical_name(n, known) not in ratios}
    varied = {column for axis in axes.values() for column in columns_of(axis)}
    targets = {RATIOS[n].target: n for n in {*ratios, *varied} & set(RATIOS)}
    offered = sourced_numbers(given, material, "plan", laws[0] if laws else None)
    explicit = {canonical_name(name, known) for name in given}
    for name in sorted({*explicit, *ratios} & varied, key=str):
        raise InputError(
            f"parameters.{name} must be given once, got an axis too; leave one of them out"
        )
    for target, ratio in targets.items():
        if target in explicit | varied:
            raise InputError(
                f"{target} must be given once, got {ratio} too, which determines it; leave one out"
            )
    wanted: set[str] = set(SOLVES[plan.solve].parameters())
    for law in laws:
        wanted |= set(point_parameters(get_law(law)))
    for name in targets.values():
        wanted |= set(RATIOS[name].needs)
    for name in sorted(explicit - wanted, key=str):
        raise InputError(
            f"parameters.{name} must belong to the laws of the plan, got {', '.join(laws)}; leave "
            "it out"
        )
    kept = {
        n: s for n, s in offered.items() if n in wanted and n not in varied and n not in targets
    }
    numbers = {n: s.value for n, s in kept.items()} | ratios
    origins = {n: s.origin for n, s in kept.items()} | dict.fromkeys(ratios, "plan")
    return dict(sorted(numbers.items())), dict(sorted(origins.items()))


def _missing(
    laws: Sequence[str],
    axes: Mapping[str, Any],
    numbers: Mapping[str, float],
    supplied: Sequence[str],
) -> Iterator[str]:
    """What a law of the plan needs and no point of it has."""
    for law in laws:
        present = {*numbers, *supplied}
        for axis in axes.values():
            present |= _present(axis, law)
        for name in [n for n in RATIOS if n in present]:
            lacking = [n for n in RATIOS[name].needs if n not in present]
            if lacking:
                yield (
                    f"{name} must have the numbers that it is made of, got none for "
                    f"{', '.join(lacking)}; add them to parameters or name a material"
                )
            present.add(RATIOS[name].target)
        known = point_parameters(get_law(law))
        missing = [n for n, p in known.items() if p.default is None and n not in present]
        if missing:
            example = known[missing[0]].example
            yield (
                f"parameters must have all numbers of {law}, got none for {', '.join(missing)}; "
                f"name a material that has them or give each one, like {missing[0]} = '{example}'"
            )


def _present(axis: Mapping[str, Any], law: str) -> set[str]:
    """Columns of an axis that have a value in every row for a law."""
    if "over" in axis:
        return set(axis["over"])
    columns = axis["columns"]
    own = columns.get("law")
    rows = [i for i, value in enumerate(own) if value == law] if own is not None else None
    found = set()
    for name, values in columns.items():
        chosen = values if rows is None else [values[i] for i in rows]
        if chosen and all(value is not None for value in chosen):
            found.add(name)
    return found


def _misnamed(axes: Mapping[str, Any], taken: Set[str]) -> Iterator[str]:
    """Axes of several columns whose name is no name of a dimension, or is that of a variable."""
    for name, axis in axes.items():
        if columns_of(axis) == (name,):
            continue
        if not name.isidentifier():
            yield (
                f"axes.{name} must have a name of letters, digits and underscores, got '{name}'; "
                "rename it"
            )
        elif name in taken:
            yield (
                f"axes.{name} must have a name of its own, got '{name}', which a number of the "
                "store has; rename it, like 'sample'"
            )


def _twice(axes: Mapping[str, Any]) -> Iterator[str]:
    """Columns that two axes have."""
    owners: dict[str, str] = {}
    for name, axis in axes.items():
        for column in columns_of(axis):
            if column in owners:
                yield (
                    f"axes.{name} must have numbers of its own, got '{column}', which "
                    f"axes.{owners[column]} has too; leave one out"
                )
            owners[column] = name


def is_extension(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Whether `new` has all points of `old`, and others only behind them along axes."""
    rest = [key for key in {*old, *new} if key not in ("axes", "laws")]
    if any(old.get(key) != new.get(key) for key in rest):
        return False
    if list(old["axes"]) != list(new["axes"]) or new["laws"][: len(old["laws"])] != old["laws"]:
        return False
    return all(_longer(old["axes"][name], new["axes"][name]) for name in old["axes"])


def _longer(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    if "columns" in old and "columns" in new:
        before, after = old["columns"], new["columns"]
        return list(before) == list(after) and all(
            after[name][: len(before[name])] == before[name] for name in before
        )
    if "over" in old and "over" in new:
        same = all(old[key] == new[key] for key in ("draw", "seed", "over"))
        return same and new["count"] >= old["count"]
    return False
