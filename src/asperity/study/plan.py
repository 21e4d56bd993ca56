"""The plan of a sweep, and its record: all numbers in SI, those of the material included.

Two runs have the same plan if their records are equal. A record is a tree of JSON values, and has
no absolute path of a file, so that it is the same on another machine.
"""

from __future__ import annotations

import ast
import hashlib
import itertools
import sys
from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pydantic import model_validator

from asperity.errors import InputError, keys_of_file, require
from asperity.laws import get_law, known_law
from asperity.operating_point import (
    known_parameters,
    material_of,
    refuse_foreign,
    require_influence,
    sourced_numbers,
    without_numbers,
)
from asperity.parameters import Parameter, canonical_name, point_parameters
from asperity.parameters.arguments import one_of
from asperity.questions.record import without_unit
from asperity.questions.sweep import PlanError, Sweep
from asperity.study.axes import TEXTS, axis_record, checked_value, columns_of, law_name, law_place
from asperity.study.points import RATIOS
from asperity.study.solve import SOLVES

#: Variables of every store with a number for each point, and with a number for each chunk.
OF_POINTS, OF_CHUNKS = ("outcome", "detail"), ("checksum", "status")
#: Group of every store with a second copy of its attributes.
ATTRIBUTES = "attributes"
#: Names that an axis of several columns may not have.
_RESERVED = (*OF_POINTS, *OF_CHUNKS, ATTRIBUTES, *TEXTS)

#: Fields of an axis that are no quantities, and those that are quantities of the axis' column.
_NO_QUANTITY, _OF_COLUMN = ("count", "spacing", "draw"), ("from", "to", "values", "mean", "std")


class SweepPlan(Sweep):
    """A sweep that can be run: the fields of `asperity.questions.sweep.Sweep`.

    Raises
    ------
    PlanError
        An `InputError` with all mistakes; in a file every quantity carries its unit.
    """

    @model_validator(mode="after")
    def _with_units(self) -> SweepPlan:
        # `plan_record` reports mistakes in the laws; here they would be reported twice.
        known = known_names(laws_named(self, []), self.solve)
        axes = {n: table.model_dump(by_alias=True) for n, table in self.axes.items()}
        trees = {"parameters": self.parameters, "axes": axes}
        quantities = (q for n, tree in trees.items() for q in _quantities(n, tree, "", known))
        if mistakes := without_unit(quantities):
            raise PlanError(mistakes).shortened()
        return self


#: Reads a plan from a TOML file; raises `InputError`, with all mistakes a `PlanError`.
load_plan = SweepPlan.from_file


def _quantities(
    place: str, tree: Any, column: str, known: Mapping[str, Parameter]
) -> Iterator[tuple[str, str, Any]]:
    """Path, kind and value of every quantity in a part of a plan."""
    if isinstance(tree, Mapping):
        for key, inner in tree.items():
            at = (place, column) if key in _OF_COLUMN else (f"{place}.{key}", key)
            if key not in _NO_QUANTITY:
                yield from _quantities(at[0], inner, at[1], known)
    elif isinstance(tree, list | tuple):
        for inner in tree:
            yield from _quantities(place, inner, column, known)
    elif (name := canonical_name(column, known)) is not None:
        yield place, known[name].kind, tree


def plan_record(plan: Sweep) -> dict[str, Any]:
    """The record of a plan.

    Raises
    ------
    PlanError
        With all mistakes in the names and values of the plan.
    """
    mistakes: list[str | InputError] = []
    axes: dict[str, Any] = {}
    laws = laws_named(plan, mistakes)
    known = known_names(laws, plan.solve)
    for name, table in plan.axes.items():
        try:
            written, axis = axis_record(name, table, known, plan)
            got = f"'{written}' under two names"
            require(written not in axes, "axis", "be given once", got, "leave one out")
            axes[written] = axis
        except InputError as error:
            at = error.field.name
            place = f"axes.{name}" if at in (name, "axis") else f"axes.{name}.{at}"
            mistakes.append(error.about(place) if error.rule else f"axes.{name}: {error}")
    if not plan.axes:
        mistakes.append("axes must have at least one axis, got none; add a table like [axes.K]")
    with _collecting(mistakes):
        numbers, origins = _numbers(plan, axes, laws, known)
    with _collecting(mistakes):
        solve = SOLVES[plan.solve]
        named = plan.model_copy(update={"law": laws[0]}) if plan.law and laws else plan
        settings = solve.settings(named)
        offered = solve.known_outputs(laws, settings)
        asked = plan.outputs or solve.defaults or offered
        outputs = dict.fromkeys(one_of(name, offered, "outputs") for name in asked)
        supplied = solve.supplied(named)
    if not mistakes:
        columns = [columns_of(axis) for axis in axes.values()]
        # A column that varies together with others may be a label without influence.
        alone = [names[0] for names in columns if len(names) == 1]
        varied = dict.fromkeys(itertools.chain(*columns), 1.0)
        with _collecting(mistakes):
            require_influence(alone, {**numbers, **varied}, "axes.{}")
        with _collecting(mistakes):
            fixed = [name for name, origin in origins.items() if origin == "plan"]
            require_influence(fixed, {**numbers, **varied})
        with _collecting(mistakes):
            mistakes += _missing(laws, axes, numbers, supplied)
        mistakes += _mistakes_of_names(axes, {*known, *outputs, *_RESERVED})
    if mistakes:
        raise PlanError(mistakes).shortened()
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


@contextmanager
def _collecting(mistakes: list[str | InputError]) -> Iterator[None]:
    """Add an `InputError` of the block to the mistakes of a plan, which are reported together."""
    try:
        with keys_of_file({"numbers": "parameters"}):
            yield
    except InputError as error:
        mistakes.append(error)


def known_names(laws: Sequence[str], solve: str) -> dict[str, Parameter]:
    """All names that an axis or a fixed number may have."""
    parameters = {**known_parameters(laws[0] if laws else None), **SOLVES[solve].parameters()}
    return {**parameters, **{name: ratio.parameter for name, ratio in RATIOS.items()}}


def law_places(plan: Sweep) -> tuple[str, ...]:
    """Laws that the plan names by module or file; a file by its absolute path."""
    named = dict.fromkeys(law_place(law, plan.folder) for law in plan.laws)
    return tuple(text for text in named if ":" in text)


def _law_files(plan: Sweep) -> dict[str, str]:
    """SHA-256 of the files of each law that the plan names by module or file, by law name."""
    digests = {}
    for place in law_places(plan):
        module = sys.modules[get_law(known_law(place)).__module__]
        content = b"".join(map(Path.read_bytes, _with_imports(Path(str(module.__file__)))))
        digests[known_law(place)] = hashlib.sha256(content).hexdigest()
    return digests


def _with_imports(file: Path) -> list[Path]:
    """A Python file, and the files of its folder that it imports, directly or indirectly."""
    files = [file]
    for source in files:
        code: ast.AST = ast.Pass()
        with suppress(SyntaxError, ValueError):  # a compiled module, or a file never imported
            code = ast.parse(source.read_bytes())
        for node in ast.walk(code):
            imported = node.names if isinstance(node, ast.Import | ast.ImportFrom) else []
            names = [getattr(node, "module", None) or "", *(part.name for part in imported)]
            near = [file.parent / f"{name.rpartition('.')[2]}.py" for name in names]
            files += [path for path in near if path.is_file() and path not in files]
    return files


def laws_named(plan: Sweep, mistakes: list[str | InputError]) -> list[str]:
    """Laws of the plan, without repetition, in their order."""
    names = []
    for law in dict.fromkeys(plan.laws):
        with _collecting(mistakes):
            names.append(law_name(law, plan.folder))
    if not plan.laws:
        mistakes.append(
            "law must be given, got nothing; add law = 'elasto-plastic' or an axis of laws"
        )
    return names


def _numbers(
    plan: Sweep, axes: Mapping[str, Any], laws: Sequence[str], known: Mapping[str, Parameter]
) -> tuple[dict[str, float], dict[str, str]]:
    """Numbers that are the same at every point, in SI, and the origin of each."""
    material = material_of(plan)
    ratios = {
        ratio: checked_value(RATIOS[ratio].parameter, value)
        for name, value in plan.parameters.items()
        if (ratio := str(canonical_name(name, known))) in RATIOS
    }
    written = {n: v for n, v in plan.parameters.items() if canonical_name(n, known) not in ratios}
    varied = {column for axis in axes.values() for column in columns_of(axis)}
    targets = {RATIOS[n].target: n for n in {*ratios, *varied} & set(RATIOS)}
    offered = sourced_numbers(written, material, "plan", laws[0] if laws else None)
    explicit = {canonical_name(name, known) for name in written}
    for name in sorted({*explicit, *ratios} & varied, key=str):
        rule = "be given once"
        raise InputError(f"parameters.{name}", rule, "an axis too", "leave one of them out")
    for target, ratio in targets.items():
        got = f"{ratio} too, which determines it"
        require(target not in explicit | varied, target, "be given once", got, "leave one out")
    wanted: set[str] = set(SOLVES[plan.solve].parameters())
    for law in laws:
        wanted |= set(point_parameters(get_law(law)))
    for name in targets.values():
        wanted |= set(RATIOS[name].needs)
    for law in laws:
        refuse_foreign(law, sorted(map(str, (explicit | varied) - wanted - set(TEXTS))))
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
    """Mistakes of parameters that a law of the plan needs and that have no value."""
    for law in laws:
        present = {*numbers, *supplied}
        for axis in axes.values():
            present |= _present(axis, law)
        for name in [n for n in RATIOS if n in present]:
            lacking = [n for n in RATIOS[name].needs if n not in present]
            if lacking:
                yield (
                    f"{name} must have the numbers of its definition, got none for "
                    f"{', '.join(lacking)}; add them to parameters or name a material"
                )
            present.add(RATIOS[name].target)
        known = point_parameters(get_law(law))
        missing = [n for n, p in known.items() if p.default is None and n not in present]
        if missing:
            yield str(without_numbers(law, missing, known))


def _present(axis: Mapping[str, Any], law: str) -> set[str]:
    """Columns of an axis with a value in every row of a law."""
    if "over" in axis:
        return set(axis["over"])
    columns = axis["columns"]
    laws = columns.get("law")
    rows = [i for i, value in enumerate(laws) if value == law] if laws is not None else None
    present = set()
    for name, values in columns.items():
        chosen = values if rows is None else [values[i] for i in rows]
        if chosen and all(value is not None for value in chosen):
            present.add(name)
    return present


def _mistakes_of_names(axes: Mapping[str, Any], taken: Set[str]) -> Iterator[str]:
    """Mistakes of columns that two axes have, and of axes whose name is invalid or taken."""
    owners: dict[str, str] = {}
    for name, axis in axes.items():
        columns = columns_of(axis)
        for column in columns:
            if column in owners:
                yield (
                    f"axes.{name} must have columns of its own, got '{column}', which "
                    f"axes.{owners[column]} has too; leave one out"
                )
            owners[column] = name
        # An axis with the name of its only column labels the dimension.
        if columns != (name,) and not name.isidentifier():
            yield (
                f"axes.{name} must have a name of letters, digits and underscores, got '{name}'; "
                "rename it"
            )
        elif columns != (name,) and name in taken:
            yield (
                f"axes.{name} must have a name of its own, got '{name}', the name of a variable of "
                "the store; rename it, like 'sample'"
            )


def is_extension(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Whether `new` only appends rows to axes of `old`."""
    others = [key for key in {*old, *new} if key not in ("axes", "laws")]
    if any(old.get(key) != new.get(key) for key in others):
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
