"""What is known of a parameter and of an output besides its value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from asperity.parameters.rules import RULES, obeying
from asperity.units import KINDS, to_radians

#: What a parameter belongs to: the friction law, the machine, the equation of motion, the drive,
#: or the normal load.
Place = Literal["law", "slider", "motion", "drive", "load"]


@dataclass(frozen=True)
class Parameter:
    """A number that a calculation depends on.

    Attributes
    ----------
    name : str
        Its one name: in tables, on the command line, in JSON, as a coordinate of datasets.
    kind : str
        Kind of quantity, a key of `asperity.units.KINDS`.
    rule : str
        A key of `asperity.parameters.RULES`.
    meaning : str
        In one line.
    symbol : str
        In LaTeX.
    place : {"law", "slider", "motion", "drive", "load"}
    path : str
        Attributes that lead to it from the equations of an operating point, a
        `asperity.slider.problem.Problem`.
    scale : float
        What is found there over the parameter: 2 pi for the frequency, as equations have omega.
    default : float or None
        Value where none is given; None where one must be.
    label : str
        What messages call it.
    argument : str
        Keyword of the Python functions that take it; empty for a law's own.
    options : tuple of str
        Options of the command line, besides ``--set NAME=VALUE``.
    aliases : tuple of str
        Other names that are understood where a name is asked for.
    meant : tuple of str
        Names, in lower case, that are refused with this one as the suggestion: of something
        near, or too short to be safe.
    geophysics : str
        Usual names in the literature on faults, in Markdown.
    words : mapping of str to float
        Texts that stand for values.
    angle : bool
        Whether it is an angle: a number in rad, or a text such as "5 deg".
    """

    name: str
    kind: str
    rule: str
    meaning: str = ""
    symbol: str = ""
    place: Place = "law"
    path: str = ""
    scale: float = 1.0
    default: float | None = None
    label: str = ""
    argument: str = ""
    options: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    meant: tuple[str, ...] = ()
    geophysics: str = ""
    words: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    angle: bool = False

    def __post_init__(self) -> None:
        # A mistake here is one of the programmer, found when the module is imported.
        for word, known in ((self.kind, KINDS), (self.rule, RULES)):
            if word not in known:
                raise ValueError(f"{self.name} must have a known kind and rule, got '{word}'")

    @property
    def unit(self) -> str:
        """SI unit; empty for a pure number."""
        return KINDS[self.kind].si

    @property
    def example(self) -> str:
        """A text that the command line accepts."""
        return KINDS[self.kind].example.split(" or ")[0]

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the coordinate of a dataset."""
        return {"units": self.unit or "1", "long_name": plain_text(self.meaning) or self.name}

    def check(self, value: Any, label: str = "") -> Any:
        """Convert a value to SI and check the parameter's rule.

        Parameters
        ----------
        value : str, number, array or sequence of these
            A text carries its unit, a number is SI.
        label : str
            What messages call the value; the parameter's own label by default.

        Returns
        -------
        array of float
            Of the shape of `value`; a value that JAX traces is returned as it is.

        Raises
        ------
        InputError
            If the value has another unit or breaks the rule.
        """
        if isinstance(value, str):
            value = self.words.get(value.strip().lower(), value)
            if self.angle:
                value = to_radians(value, label or self.label or self.name)
        elif self.rule == "switch" and np.asarray(value).dtype == bool:
            value = np.asarray(value, dtype=float)
        return obeying(value, label or self.label or self.name, self.kind, self.rule)


def plain_text(markdown: str) -> str:
    """A meaning without the marks of formulas, for terminals and files."""
    return markdown.replace("$", "").replace("_", "")


@dataclass(frozen=True)
class Output:
    """A quantity that a calculation answers with.

    Attributes
    ----------
    name : str
        Its one name: attribute of the response, column, variable of datasets, key in JSON.
    unit : str
        SI unit as datasets write it: "1" for a pure number.
    meaning : str
        In one line; the `long_name` of datasets.
    symbol : str
        In LaTeX.
    former : tuple of str
        Names under which JSON still gives the same, for programs written before the renaming.
    """

    name: str
    unit: str
    meaning: str
    symbol: str = ""
    former: tuple[str, ...] = ()

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the variable of a dataset."""
        return {"units": self.unit, "long_name": self.meaning}
