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
from typing import TYPE_CHECKING, Any

from pydantic import field_validator

from asperity.errors import InputError, closest, require, require_known
from asperity.materials.number import Number
from asperity.parameters import EXPERIMENT, INTERFACE, law_parameters
from asperity.parameters.arguments import file_path, typed
from asperity.parameters.toml_file import parsed_toml, toml_content
from asperity.questions.record import Question

if TYPE_CHECKING:
    from asperity.laws import Law


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
            needs a parameter that neither the material nor `overrides` has.
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
            values[about.path.rpartition(".")[2]] = (
                about.check(given[parameter], label)
                if parameter in given
                else self.numbers[parameter].si
            )
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
