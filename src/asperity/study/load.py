"""Plans of sweeps from their files, in which every quantity carries its unit."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from typing import Any

from asperity.parameters import canonical_name
from asperity.parameters.toml_file import toml_content
from asperity.study.plan import PlanError, SweepPlan
from asperity.study.record import known_names, laws_named
from asperity.units import KINDS


def load_plan(path: str | os.PathLike[str]) -> SweepPlan:
    """Read a plan from a TOML file, in which every quantity carries its unit.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    PlanError
        An `InputError` with all mistakes.
    """
    file, content = toml_content(path, "plan")
    try:
        plan = SweepPlan(**{"folder": file.parent, **content})
    except PlanError as error:
        raise PlanError(error.mistakes, str(path)) from None
    mistakes = _without_unit(plan)
    if mistakes:
        raise PlanError(mistakes, str(path))
    return plan


def _without_unit(plan: SweepPlan) -> list[str]:
    """Sentences about bare numbers where a unit is needed: a file says what it means."""
    # Mistakes in the laws are reported with all others of the plan.
    known = known_names(laws_named(plan, []), plan.solve)
    mistakes = []
    for place, written, value in _numbers(plan):
        name = canonical_name(written, known)
        unit = known[name].unit if name in known else ""
        bare = isinstance(value, int | float) and not isinstance(value, bool)
        if unit and bare and math.isfinite(value):
            example = KINDS[known[str(name)].kind].example
            mistakes.append(f"{place} must carry a unit, got {value!r}; write it like '{example}'")
    return list(dict.fromkeys(mistakes))


def _numbers(plan: SweepPlan) -> Iterator[tuple[str, str, Any]]:
    """Place, name and value of everything in a plan that may be a quantity."""
    for name, value in plan.parameters.items():
        yield f"parameters.{name}", name, value
    for axis, table in plan.axes.items():
        where = f"axes.{axis}"
        for listed in (table.from_, table.to, *(table.values or ())):
            yield where, axis, listed
        for name, values in (table.zip or {}).items():
            for value in values:
                yield f"{where}.zip.{name}", name, value
        for case in table.cases or ():
            for name, value in case.items():
                grid = isinstance(value, Mapping)
                ends = [value.get("from"), value.get("to")] if grid else value
                for one in ends if isinstance(ends, list | tuple) else [ends]:
                    yield f"{where}.cases.{name}", name, one
        for name, spread in (table.over or {}).items():
            for value in spread.values():
                yield f"{where}.over.{name}", name, value
