"""A material: the numbers of one paper by name, and the friction laws built from them.

A material file is TOML with a ``title``, a ``source`` (key of `CITATIONS.bib`, or empty),
``notes``, and one table ``[numbers.NAME]`` a number, with the fields of `Number`.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from asperity.errors import InputError, closest, require, require_known
from asperity.parameters import EXPERIMENT, INTERFACE, law_parameters
from asperity.parameters.arguments import file_path, typed
from asperity.parameters.toml_file import parsed_toml, toml_content
from asperity.questions.record import Question, Record
from asperity.units import KINDS, to_si

if TYPE_CHECKING:
    from asperity.laws import Law


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


class Material(Question):
    """The numbers of one paper.

    ``material.K`` is a value in SI, ``material["K"]`` the `Number` with its unit, uncertainty,
    place and kind. ``lambda``, a word of Python, is ``material.lambda_``.

    Attributes
    ----------
    name, title, source, notes : str
    numbers : mapping of str to Number
    """

    subject = "material"

    name: str
    title: str
    source: str = ""
    notes: str = ""
    numbers: Mapping[str, Number]

    @field_validator("numbers")
    @classmethod
    def _usable(cls, numbers: Mapping[str, Number]) -> Mapping[str, Number]:
        for name, number in numbers.items():
            holds = name.isidentifier() and not name.startswith("_") and not hasattr(cls, name)
            rule = "have names that are Python attributes and not in use"
            require(holds, "numbers", rule, f"'{name}'", "rename that number")
            if number.value is not None:
                # A number that is no known parameter may have any value.
                known = {**INTERFACE, **EXPERIMENT}.get(name)
                if known is not None and known.kind == number.dimension:
                    known.check(number.si, f"numbers.{name}")
        return numbers

    @typed
    def __getitem__(self, name: str) -> Number:
        plain = _plain(name)
        require_known(plain, self.numbers, self.name, "have the number")
        return self.numbers[plain]

    def __getattr__(self, name: str) -> float:
        # Python and pydantic probe for names with underscores.
        if name.startswith("_") or _plain(name) not in self.numbers:
            raise AttributeError(
                f"material '{self.name}' has no number '{name}'; {closest(name, self.numbers)}"
            )
        number = self.numbers[_plain(name)]
        if number.value is None:
            advice = f"take si_range or si_values of material['{name}']"
            raise InputError(f"{self.name}.{name}", "be a single value here", number, advice)
        return number.si

    def __contains__(self, name: str) -> bool:
        return _plain(name) in self.numbers

    def __dir__(self) -> Iterator[str]:
        yield from super().__dir__()
        yield from (f"{n}_" if keyword.iskeyword(n) else n for n in self.numbers)

    @typed
    def law(self, name: str, **overrides: Any) -> Law:
        """Build a friction law from the material's numbers.

        Parameters
        ----------
        name : str
            A registered law, such as ``"elasto-plastic"``.
        **overrides : number, array or str
            Parameters to use instead of the material's: SI numbers, or texts with a unit.
            ``lambda`` is written ``lambda_``.

        Returns
        -------
        Law

        Raises
        ------
        InputError
            If the law or a parameter is unknown, a value has the wrong unit or sign, or the law
            needs a parameter that neither the material nor `overrides` has, or that is another
            kind of quantity in the material.
        """
        # The laws load JAX, which reading numbers does not need.
        from asperity.laws import get_law

        law = get_law(name)
        wanted = law_parameters(law)
        given = {_plain(parameter): value for parameter, value in overrides.items()}
        for parameter in given:
            require_known(parameter, wanted, name, "be given its own parameters")
        values = {}
        for parameter, about in wanted.items():
            label = f"{name}.{parameter}"
            got = f"nothing and '{self.name}' has no such number"
            advice = f"write {parameter}=... after the law's name"
            require(parameter in {**self.numbers, **given}, label, "be given", got, advice)
            if parameter not in given:
                number = self.numbers[parameter]
                fits, rule = number.dimension == about.kind, f"be {KINDS[about.kind].noun}"
                require(fits, label, rule, f"'{number}' in '{self.name}'", advice)
                given[parameter] = number.si
            values[about.path.rpartition(".")[2]] = about.check(given[parameter], label)
        return law(**values)


def _plain(name: str) -> str:
    """`lambda_` is how Python has to write `lambda`."""
    return name.removesuffix("_") if keyword.iskeyword(name.removesuffix("_")) else name


@cache
def packaged() -> Mapping[str, Any]:
    """The material files that come with the package, by name."""
    folder = files("asperity.materials")
    return {f.name.removesuffix(".toml"): f for f in folder.iterdir() if f.name.endswith(".toml")}


@cache
def _packaged_content(name: str) -> dict[str, Any]:
    """The parsed file of a material that comes with the package; parsing takes milliseconds."""
    text = packaged()[name].read_text(encoding="utf-8")
    return parsed_toml(text, "material", f"'{name}'")


def available() -> tuple[str, ...]:
    """Names of the materials that come with the package."""
    return tuple(sorted(packaged()))


@typed
def load_from(folder: Path, name: str) -> Material:
    """Load a material by its name, or by a path relative to the folder.

    Raises
    ------
    InputError
        As in `load`.
    """
    return load(folder / name if name.endswith(".toml") else name)


def load(name: str | PathLike[str]) -> Material:
    """Load a material by name, or a material file by its path.

    Parameters
    ----------
    name : str or path
        One of `available`, or the path of a TOML file: anything that is a path object, ends in
        ``.toml`` or has a folder in it.

    Raises
    ------
    InputError
        If there is no such material, or the file is not a valid material file.
    """
    text = fspath(file_path(name, "material"))
    if not isinstance(name, str) or text.endswith(".toml") or Path(text).name != text:
        file, content = toml_content(text, "material")
        return Material.of_content({"name": file.stem, **content}, text)
    require_known(text, packaged(), "material", "be a known material or the path of a .toml file")
    return Material.of_content({"name": text, **_packaged_content(text)}, text)
