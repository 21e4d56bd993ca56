"""The plan of a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, StrictFloat, StrictInt, model_validator

from asperity.errors import MistakesError, require
from asperity.questions.fit import Estimation
from asperity.questions.point import Point
from asperity.questions.record import WHOLE, Given, Names, Record


class PlanError(MistakesError):
    """A plan that cannot be run."""

    subject = "plan"


class AxisTable(Record):
    """An axis as a plan writes it, in exactly one of five forms.

    Attributes
    ----------
    from_, to, count, spacing
        A grid that includes both ends; ``from_`` is written ``from`` in the plan, and ``spacing``
        is ``"linear"`` or ``"log"``.
    values : tuple
        All values.
    zip : mapping of str to tuple
        Several numbers that vary together, with equally many values.
    cases : tuple of mapping
        Rows; a case with lists gives a row for every combination of the values in the lists.
    draw : {"random", "sobol", "halton"}
        ``count`` draws of the numbers in ``over``.
    over : mapping of str to mapping
        For each drawn number ``from``, ``to`` and ``spacing``, or ``mean`` and ``std``.
    """

    from_: Given | None = Field(default=None, alias="from")
    to: Given | None = None
    count: Annotated[StrictInt, Field(gt=0), WHOLE] | None = None
    spacing: Literal["linear", "log"] | None = None
    values: tuple[Given, ...] | None = None
    zip: Mapping[str, tuple[Given, ...]] | None = None
    cases: tuple[Mapping[str, Any], ...] | None = None
    draw: Literal["random", "sobol", "halton"] | None = None
    over: Mapping[str, Mapping[str, Any]] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> AxisTable:
        allowed = {
            "from": {"from_", "to", "count", "spacing"},
            "values": {"values"},
            "zip": {"zip"},
            "cases": {"cases"},
            "draw": {"draw", "over", "count"},
        }
        fields = {name for name in type(self).model_fields if getattr(self, name) is not None}
        forms = [form for form in allowed if form.replace("from", "from_") in fields]
        shown = ", ".join(sorted(name.rstrip("_") for name in fields)) or "nothing"
        one = len(forms) == 1 and not fields - allowed[forms[0]]
        rule = "have one of from-to-count, values, zip, cases or draw"
        like = "write it like { from = 0.01, to = 0.5, count = 20 } or { values = [0.1, 0.2] }"
        require(one, "", rule, shown, like)
        needed = {"from": ("to", "count"), "draw": ("over", "count")}.get(forms[0], ())
        missing = [name for name in needed if getattr(self, name) is None]
        rule = f"have {' and '.join(needed)} together with {forms[0]}"
        require(not missing, "", rule, f"no {' and no '.join(missing)}", "add it")
        return self


class ThresholdTable(Record):
    """Settings of the search for stiffness thresholds.

    Attributes
    ----------
    between : pair of float
        Limits of the search, in units of K_c of unmodulated sliding at the same point.
    scan : int
        Number of stiffnesses solved before the search, at equal ratios.
    """

    between: tuple[StrictFloat, StrictFloat] = (0.3, 4.0)
    scan: Annotated[StrictInt, Field(gt=0, lt=2**63), WHOLE] = 24


class NumberTable(Record):
    """A number computed from a transient.

    Attributes
    ----------
    of : str
        A channel: ``friction``, ``force``, ``load``, ``velocity``, ``slip_velocity``,
        ``displacement``.
    take : str
        ``mean``, ``min``, ``max``, ``range``, ``std``, ``first`` or ``last``.
    from_, to : float or str, optional
        First and last time (s) of the samples, written ``from`` and ``to``; all by default.
    """

    of: str
    take: str
    from_: float | str | None = Field(default=None, alias="from")
    to: float | str | None = None


class TransientTable(Record):
    """A transient, and the numbers that are computed from it.

    Attributes
    ----------
    steps : tuple of str
        Lines of a protocol; ``{epsilon}`` stands for the value at the point.
    numbers : mapping of str to NumberTable
    sampling : float or str
        Samples per second (Hz).
    rtol : float
    most_steps : float
    """

    steps: tuple[str, ...]
    numbers: Mapping[str, NumberTable]
    sampling: float | str
    rtol: StrictFloat = 1e-9
    most_steps: StrictFloat = 2e6


class FitTable(Estimation):
    """Settings of a fit at every point.

    Attributes
    ----------
    data : tuple of str
        Tables of readings that are fitted together; left out if an axis has a column ``data``.
    """

    data: Names | None = None


class Sweep(Point):
    """What a sweep computes.

    Attributes
    ----------
    axes : mapping of str to AxisTable
        Axes in the order of the dimensions. The grid is the product of the axes.
    law : str
        Friction law; left out if an axis has a column ``law``.
    material : str
        Material whose numbers apply where neither an axis nor `parameters` has a value.
    parameters : mapping of str to float, str or bool
        Numbers and ratios that are the same at every point, by name.
    solve : {"periodic", "threshold", "transient", "fit"}
    outputs : tuple of str
        Outputs to store; the default outputs of `solve` if left out.
    seed : int
        Seed of drawn axes.
    chunk : int, optional
        Approximate number of points that are solved and written together.
    threshold, transient, fit
        Settings for these values of `solve`.
    title : str
    folder : Path
        Folder of the files that the plan names.
    """

    subject = "plan"
    mistakes_error = PlanError

    axes: Mapping[str, AxisTable]
    solve: Literal["periodic", "threshold", "transient", "fit"] = "periodic"
    outputs: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    seed: Annotated[StrictInt, Field(ge=0), WHOLE] = 0
    chunk: Annotated[StrictInt, Field(gt=0), WHOLE] | None = None
    threshold: ThresholdTable = ThresholdTable()
    transient: TransientTable | None = None
    fit: FitTable | None = None
    title: str = ""

    @model_validator(mode="after")
    def _settings_of_this_solve(self) -> Sweep:
        for name in ("transient", "fit"):
            wanted, given = self.solve == name, getattr(self, name) is not None
            rule = f"be {'given' if wanted else 'left out'} where solve is '{self.solve}'"
            advice = f"add the table [{name}]" if wanted else f"write solve = '{name}' or remove it"
            require(wanted == given, name, rule, "a table" if given else "nothing", advice)
        rule = f"be left out where solve is '{self.solve}'"
        advice = "write solve = 'threshold' or remove it"
        needless = self.solve != "threshold" and self.threshold != ThresholdTable()
        require(not needless, "threshold", rule, "a table", advice)
        return self

    @property
    def columns(self) -> dict[str, tuple[Any, ...]]:
        """Columns of the axes as the plan writes them; drawn columns have no values."""
        columns: dict[str, tuple[Any, ...]] = {}
        for name, table in self.axes.items():
            if table.values is not None or table.from_ is not None:
                columns[name] = (*columns.get(name, ()), *(table.values or ()))
            for column, values in (table.zip or {}).items():
                columns[column] = (*columns.get(column, ()), *values)
            for case in table.cases or ():
                for column, value in case.items():
                    values = tuple(value) if isinstance(value, list | tuple) else (value,)
                    columns[column] = (*columns.get(column, ()), *values)
            for column in table.over or {}:
                columns.setdefault(column, ())
        return columns

    @property
    def single_columns(self) -> list[str]:
        """Axes of one column; a column that varies together with others may be a label."""
        axes = self.axes.items()
        return [n for n, axis in axes if axis.values is not None or axis.from_ is not None]

    @property
    def laws(self) -> list[str]:
        """Laws as the plan writes them, in their order."""
        return [str(law) for law in (self.law, *self.columns.get("law", ())) if law]
