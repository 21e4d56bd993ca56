"""`Number` of a material file: printed value, unit, uncertainty, place, and value in SI."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from asperity.errors import InputError, require_known
from asperity.questions.record import Record
from asperity.units import KINDS, to_si

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]


class Number(Record):
    """A number of a paper.

    Attributes
    ----------
    value, uncertainty, range, values : float, float, (float, float), tuple of float
        As printed, in `unit`; at least one of `value`, `range` and `values` is given.
    unit : str
        Empty for a pure number.
    dimension : str
        A key of `asperity.units.KINDS`.
    kind : {"published", "fitted", "assumed"}
        "published": printed in the paper; "fitted": printed there as the result of a fit;
        "assumed": not in the paper.
    relation : {"equal", "about", "order", "below", "above"}
        How the text qualifies the number.
    place : str
        Section, equation or figure.
    note : str
    """

    value: Finite | None = None
    uncertainty: Annotated[Finite, Field(ge=0)] | None = None
    range: tuple[Finite, Finite] | None = None
    values: tuple[Finite, ...] | None = None
    unit: str
    dimension: str
    kind: Literal["published", "fitted", "assumed"]
    relation: Literal["equal", "about", "order", "below", "above"] = "equal"
    place: str
    note: str = ""

    @field_validator("dimension")
    @classmethod
    def _dimension_is_known(cls, dimension: str) -> str:
        require_known(dimension, KINDS, "", "be a kind of quantity")
        return dimension

    @model_validator(mode="after")
    def _has_value(self) -> Self:
        if self.value is None and self.range is None and not self.values:
            raise InputError("", "have a value, a range or values", "none of them", "add one")
        if self.uncertainty is not None and self.value is None:
            got = f"only its uncertainty {self.uncertainty:g}"
            raise InputError("", "have a value", got, "add the value")
        if self.range is not None and self.range[0] > self.range[1]:
            raise InputError("", "have a range from low to high", list(self.range), "swap its ends")
        try:
            self._to_si(1.0)
        except InputError:
            raise InputError(
                "",
                f"have a unit of the dimension {self.dimension}",
                f"'{self.unit}'",
                f"write the unit as in '{KINDS[self.dimension].example}'",
            ) from None
        return self

    @property
    def si(self) -> float:
        """The value in SI; raises `InputError` where the paper gives only a range or a list."""
        if self.value is None:
            got = f"only {'a range' if self.range else 'a list'}"
            raise InputError("number.value", "be given", got, "take si_range or si_values")
        return self._to_si(self.value)

    @property
    def si_uncertainty(self) -> float | None:
        """The uncertainty in SI, None where the paper gives none."""
        return None if self.uncertainty is None else self._to_si(self.uncertainty)

    @property
    def si_range(self) -> tuple[float, float] | None:
        """The range in SI, None where the paper gives none."""
        low, high = self.range or (None, None)
        return None if low is None or high is None else (self._to_si(low), self._to_si(high))

    @property
    def si_values(self) -> tuple[float, ...] | None:
        """The list of settings in SI, None where the paper gives none."""
        return None if self.values is None else tuple(self._to_si(v) for v in self.values)

    @property
    def si_unit(self) -> str:
        """SI unit of the number; empty for a pure number."""
        return KINDS[self.dimension].si

    def __str__(self) -> str:
        shown = {"equal": "", "about": "about ", "order": "of order ", "below": "< ", "above": "> "}
        parts = [] if self.value is None else [f"{shown[self.relation]}{self.value:g}"]
        if self.uncertainty is not None:
            parts.append(f"+- {self.uncertainty:g}")
        if self.range is not None:
            parts.append(f"{self.range[0]:g} to {self.range[1]:g}")
        if self.values is not None:
            parts.append(", ".join(f"{v:g}" for v in self.values))
        return " ".join([*parts, self.unit]).rstrip()

    def _to_si(self, value: float) -> float:
        return _in_si(value, self.unit, self.dimension)


@cache
def _in_si(value: float, unit: str, dimension: str) -> float:
    # The shortest text of a double is the decimal in the file, which is converted exactly.
    return to_si(f"{value!r} {unit}", dimension, "number.value")
