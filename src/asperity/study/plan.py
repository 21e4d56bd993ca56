"""A plan checked for what only the laws can say: in a file every quantity carries its unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import model_validator

from asperity.parameters import canonical_name
from asperity.questions.record import without_unit
from asperity.questions.sweep import PlanError, Sweep
from asperity.study.record import known_names, laws_named


class SweepPlan(Sweep):
    """A sweep that can be run: the fields of `asperity.questions.sweep.Sweep`.

    Raises
    ------
    PlanError
        An `InputError` with all mistakes.
    """

    @model_validator(mode="after")
    def _with_units(self) -> SweepPlan:
        if mistakes := without_unit(_quantities(self)):
            raise PlanError(mistakes)
        return self


#: Reads a plan from a TOML file; raises `InputError`, with all mistakes a `PlanError`.
load_plan = SweepPlan.from_file


def _quantities(plan: Sweep) -> Iterator[tuple[str, str, Any]]:
    """Place, kind and value of every quantity in a plan."""
    # `plan_record` reports mistakes in the laws; here they would be reported twice.
    known = known_names(laws_named(plan, []), plan.solve)
    for place, written, value in _numbers(plan):
        name = canonical_name(written, known)
        if name is not None:
            yield place, known[name].kind, value


def _numbers(plan: Sweep) -> Iterator[tuple[str, str, Any]]:
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
                entries = [value.get("from"), value.get("to")] if grid else value
                for entry in entries if isinstance(entries, list | tuple) else [entries]:
                    yield f"{where}.cases.{name}", name, entry
        for name, spread in (table.over or {}).items():
            for value in spread.values():
                yield f"{where}.over.{name}", name, value
