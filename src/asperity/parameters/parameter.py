"""A parameter or an output without its value: kind, unit, rule and meaning.

`Displayed` shows objects on consoles and in notebooks as short texts and tables.
"""

from __future__ import annotations

import html
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np

from asperity.parameters.arguments import typed
from asperity.parameters.rules import RULES, obeying
from asperity.units import KINDS, format_si, to_radians, to_si
from asperity.units.convert import is_traced

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Owner of a parameter: the friction law, the machine, the equation of motion, the drive, or the
#: normal load.
Place = Literal["law", "slider", "motion", "drive", "load"]


@typed
@dataclass(frozen=True)
class Parameter:
    """A number that a calculation depends on.

    Attributes
    ----------
    name : str
        Name in tables, on the command line, in JSON, and as a coordinate of datasets.
    kind : str
        Kind of quantity, a key of `asperity.units.KINDS`.
    rule : str
        A key of `asperity.parameters.RULES`.
    meaning : str
        One line.
    symbol : str
        LaTeX.
    place : {"law", "slider", "motion", "drive", "load"}
    path : str
        Attributes that lead from an `asperity.slider.problem.Problem` to the parameter.
    scale : float
        The attribute at `path` over the parameter: 2 pi for the frequency, as equations have omega.
    default : float or None
        Value if none is given; None if a value is required.
    label : str
        Name in messages.
    argument : str
        Keyword of Python functions; empty for a parameter of one law.
    options : tuple of str
        Options of the command line, in addition to ``--set NAME=VALUE``.
    aliases : tuple of str
        Other accepted names.
    meant : tuple of str
        Refused names, in lower case, for which messages suggest this parameter.
    geophysics : str
        Usual names in the literature on faults, in Markdown.
    words : mapping of str to float
        Texts that stand for values.
    angle : bool
        Whether the value is an angle: a number in rad, or a text such as "5 deg".
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
        # A mistake in the declaration, reported when the module is imported.
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
        return KINDS[self.kind].example

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
            Name of the value in messages; the parameter's label by default.

        Returns
        -------
        array of float
            Same shape as `value`; a value traced by JAX is returned unchanged.

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

    @typed
    def unit_in_si(self, unit: str, label: str) -> float:
        """The SI value of a unit, such as the unit in the heading of a column.

        Raises
        ------
        InputError
            If it is a unit of another kind of quantity.
        """
        one = f"1 {unit}"
        return float(to_radians(one, label) if self.angle else to_si(one, self.kind, label))


def plain_text(markdown: str) -> str:
    """A meaning without the marks of formulas, for terminals and files."""
    return markdown.replace("$", "").replace("_", "")


@dataclass(frozen=True)
class Output:
    """A quantity that a calculation computes.

    Attributes
    ----------
    name : str
        Attribute of the response, column of tables, variable of datasets, key in JSON.
    unit : str
        SI unit as datasets write it: "1" for a pure number.
    meaning : str
        One line; the `long_name` of datasets.
    symbol : str
        LaTeX.
    former : tuple of str
        Further keys of the same number in JSON, for programs that use an earlier name.
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


Names = Literal["friction", "geophysics"]
#: Sets of names for tables, figures and messages. "friction": the letters of Bureau, Baumberger
#: and Caroli (2000).
NAMES: tuple[Names, ...] = ("friction", "geophysics")


class SummaryLine(NamedTuple):
    """A line of a summary: name, value as text, and what it is."""

    name: str
    value: str
    meaning: str = ""


class Displayed:
    """An object whose `repr` is its summary.

    Subclasses that are dataclasses are declared with ``repr=False``.
    """

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Title of the object, and its most important values."""
        raise NotImplementedError

    def __repr__(self) -> str:
        title, lines = self.summary()
        values = ", ".join(f"{line.name}={line.value}" for line in lines)
        return f"<{title}: {values}>" if values else f"<{title}>"

    def _repr_html_(self) -> str:
        title, lines = self.summary()
        rows = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in line) + "</tr>"
            for line in lines
        )
        return f"<table><caption>{html.escape(title)}</caption><tbody>{rows}</tbody></table>"


class Drawn(Displayed):
    """An object with a picture."""

    #: ``module:function`` that draws the object. A text, because the module of the function imports
    #: the class.
    _drawn_by: ClassVar[str]

    @typed
    def plot(self, names: Names = "friction") -> Figure:
        """The object as a Matplotlib figure, to be changed, shown, or written by its ``savefig``.

        Parameters
        ----------
        names : {"friction", "geophysics"}
            Symbols of the labels: F/W, A, B, D0; or tau/sigma_n, a, b, D_c.

        Raises
        ------
        InputError
            If `names` is none of the two, or an object of this shape has no picture.
        """
        module, name = self._drawn_by.split(":")
        with import_module("asperity.figures.style").style():
            figure: Figure = getattr(import_module(module), name)(self)
        return labelled(figure, names)


def labelled(figure: Figure, names: Names) -> Figure:
    """The figure with its labels in a set of names, and µm in place of um."""
    in_symbols: Any = import_module("asperity.parameters.table").in_symbols
    labels: Any = figure.findobj(lambda artist: hasattr(artist, "set_text"))
    for text in labels:
        shown = re.sub(r"\bum\b", "µm", text.get_text())
        text.set_text(in_symbols(shown) if names == "geophysics" else shown)
    return figure


def parameter_line(parameter: Parameter, value: Any) -> SummaryLine:
    """A parameter with its value in a readable unit; for an array the range and the shape.

    Parameters
    ----------
    parameter : Parameter
    value : float or array
        SI, or traced by JAX.
    """
    text = _value_text(value, parameter.kind)
    return SummaryLine(parameter.name, text, plain_text(parameter.meaning))


def _value_text(value: Any, kind: str) -> str:
    if is_traced(value) or (not hasattr(value, "__array__") and not np.isscalar(value)):
        return "traced"
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or not array.size:
        return f"an array of shape {array.shape}"
    if array.size == 1:
        return format_si(float(array.ravel()[0]), kind, 6)
    low, high = format_si(array.min(), kind), format_si(array.max(), kind)
    return f"{low if low == high else f'{low} to {high}'} {array.shape}"


def count_text(count: int, noun: str) -> str:
    """``1 point``, ``2 points``."""
    return f"{count:,} {noun}" + ("" if count == 1 else "s")


def number_line(name: str, values: Any, meaning: str = "") -> SummaryLine:
    """A number, or the range of the finite values of an array."""
    array = np.asarray(values, dtype=float)
    known = array[np.isfinite(array)]
    if not known.size:
        return SummaryLine(name, "none", meaning)
    low, high = (f"{edge:.6g}" for edge in (known.min(), known.max()))
    return SummaryLine(name, low if low == high else f"{low} to {high}", meaning)
