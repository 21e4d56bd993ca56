"""Figures of a paper: numbers, words and pictures, and the sections of the report that show them.

A function computes the numbers of a figure; figures.toml in the paper's folder has its words and
what is drawn, as `asperity.figures.plot` describes it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import pandas as pd
from pydantic import ConfigDict, Field

from asperity.errors import InputError
from asperity.figures.plot import Panel, Plot
from asperity.ledger.claims import printed_numbers
from asperity.ledger.contents import read_words
from asperity.ledger.rules import formula_value
from asperity.ledger.sentences import fill
from asperity.parameters.arguments import typed
from asperity.questions.record import Question, Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from asperity.materials import Material


#: Number and description of the panel of each quantity of a figure, by its column.
Observables: TypeAlias = Mapping[str, tuple[int, Panel]]


@dataclass(frozen=True)
class FigureTable:
    """The numbers behind a figure, as a CSV file.

    Attributes
    ----------
    name : str
        Name of the file, without its ending.
    data : DataFrame
    header : sequence of str
        First lines of the file.
    columns : mapping of str to str
        Unit and meaning of each column.
    """

    name: str
    data: pd.DataFrame
    header: Sequence[str]
    columns: Mapping[str, str]


@dataclass(frozen=True)
class FigureNumbers:
    """The numbers that a figure shows.

    Attributes
    ----------
    name : str
        Name of its files, and of its words in figures.toml.
    data : DataFrame
        One operating point, or one instant, a row; ``curve`` names the line that it belongs to.
    scalars : mapping of str to float
        Numbers read off the curves, which the head of the table lists.
    quoted : mapping of str to float
        Further numbers that the words or the picture quote.
    points : DataFrame, optional
        Simulated or measured points.
    """

    name: str
    data: pd.DataFrame
    scalars: Mapping[str, float] = field(default_factory=dict)
    quoted: Mapping[str, float] = field(default_factory=dict)
    points: pd.DataFrame | None = None

    @property
    def numbers(self) -> dict[str, float]:
        """All named numbers."""
        return {**self.scalars, **self.quoted}

    def curve(self, name: str) -> pd.DataFrame:
        """The rows of one curve."""
        return self.data[self.data["curve"] == name]

    def last(self, curve: str, column: str) -> float:
        """A quantity at the last point of a curve."""
        return float(self.curve(curve)[column].iloc[-1])

    def at(self, curve: str, column: str, value: float, x: str) -> float:
        """A quantity on a curve at a value of `x`, linear between the curve's points."""
        rows = self.curve(curve)
        return float(np.interp(value, rows[x], rows[column]))

    @property
    def failed(self) -> int:
        """Number of points that were not solved."""
        return int((~self.data["converged"].astype(bool)).sum()) if "converged" in self.data else 0


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the report.

    Attributes
    ----------
    name : str
        Name of its files.
    place : str
        The paper's number for it, such as "Figure 2".
    title, caption : str
    alt : str
        Alternative text for readers who cannot see the figure.
    draw : function
        Returns the Matplotlib figure.
    tables : sequence of FigureTable
    points : int
        Operating points that were solved for it.
    failed : int
        Number of operating points that did not converge.
    """

    name: str
    place: str
    title: str
    caption: str
    alt: str
    draw: Callable[[], Figure]
    tables: Sequence[FigureTable] = ()
    points: int = 0
    failed: int = 0


class FigureWords(Record):
    """A figure in figures.toml.

    Attributes
    ----------
    place, title : str
    caption, alt : str
        Sentences of `asperity.ledger.sentences` that quote the figure's numbers.
    short : str
        Title on the browser page; that above by default.
    numbers : tuple of str
        The paper's numbers that the figure rests on, with which the browser page moves it.
    scalars, quoted : mapping of str to str
        Formulas (`asperity.ledger.rules.formula_value`) of the numbers that are read off the
        curves, and of further ones that the words or the picture quote.
    plot : Plot
        Description of the figure; without it a function of the paper draws.
    """

    place: str
    title: str
    caption: str
    alt: str
    short: str = ""
    numbers: tuple[str, ...] = ()
    scalars: Mapping[str, str] = Field(default_factory=dict)
    quoted: Mapping[str, str] = Field(default_factory=dict)
    plot: Plot | None = None

    @cached_property
    def observables(self) -> Observables:
        """The quantities that measured points can be drawn on."""
        panels = () if self.plot is None else self.plot.panel
        return {p.y: (n, p) for n, p in enumerate(panels) if "/" not in p.y and not p.less}

    def values(self, numbers: Material, terms: Mapping[str, Any]) -> tuple[dict[str, float], ...]:
        """The numbers of `scalars` and of `quoted`.

        Parameters
        ----------
        numbers : Material
            The paper's numbers.
        terms : mapping of str to object
            Further names of the formulas.
        """
        printed = printed_numbers(numbers)
        return tuple(
            {n: formula_value(f, printed, f"figures.{n}", terms) for n, f in formulas.items()}
            for formulas in (self.scalars, self.quoted)
        )

    def draw(self, numbers: FigureNumbers) -> Figure:
        """The picture; the style must be active."""
        if self.plot is None:
            advice = f"add [[{numbers.name}.plot.panel]]"
            raise InputError(f"figures.{numbers.name}", "say what is drawn", "no plot", advice)
        return self.plot.figure(numbers.data, numbers.numbers, numbers.points)


def _minus(text: str) -> str:
    """A text with typographic minus signs."""
    return re.sub(r"(?<=[ =])-(?=\d)", "−", text)


class SectionWords(Record):
    """A section of the report in figures.toml.

    Attributes
    ----------
    title : str
    before : tuple of str
        Paragraphs in front of its figures, which may quote numbers.
    """

    title: str
    before: tuple[str, ...] = ()


class SliderWords(Record):
    """A slider of the browser page that is not made from the paper's parameter alone.

    Attributes
    ----------
    label, meaning : str
    low, high : float
        Its ends; the scale is linear.
    """

    label: str
    meaning: str
    low: float
    high: float


class FiguresFile(Question):
    """All of figures.toml: sections, and a table for each figure.

    Attributes
    ----------
    section : mapping of str to SectionWords
    column, point_column : mapping of str to str
        Unit and meaning of the columns of all tables, and of those of points where they differ.
    label : mapping of str to str
        Names of columns on the browser page.
    slider : mapping of str to SliderWords
        By the name of the paper's number.
    """

    subject = "figures.toml"
    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, FigureWords] = Field(init=False)

    section: dict[str, SectionWords] = Field(default_factory=dict)
    column: dict[str, str] = Field(default_factory=dict)
    point_column: dict[str, str] = Field(default_factory=dict)
    label: dict[str, str] = Field(default_factory=dict)
    slider: dict[str, SliderWords] = Field(default_factory=dict)

    @property
    def figures(self) -> Mapping[str, FigureWords]:
        """Words of the figures by their names, in the order of the file."""
        return self.__pydantic_extra__

    def figure(
        self,
        numbers: FigureNumbers,
        tables: Mapping[str, tuple[pd.DataFrame, Sequence[str]]],
        draw: Callable[[FigureNumbers], Figure] | None = None,
    ) -> PaperFigure:
        """The figure of the report with these numbers.

        Parameters
        ----------
        numbers : FigureNumbers
        tables : mapping of str to (DataFrame, sequence of str)
            Data and first lines of each CSV file, by its name without ending. The first table has
            the curves, with which measured points are compared.
        draw : function, optional
            Draws in place of the plot.
        """
        words = self.figures[numbers.name]
        caption, alt = (
            _minus(fill(text, numbers.numbers, f"figures.{numbers.name}"))
            for text in (words.caption, words.alt)
        )
        # Rows without an outcome are instants, or values of a formula.
        solved = len(numbers.data) if "converged" in numbers.data else 0
        made = []
        for name, (data, header) in tables.items():
            of_points = self.point_column if data is numbers.points else {}
            made.append(FigureTable(name, data, header, self.column | of_points))
        return PaperFigure(
            numbers.name, words.place, words.title, caption, alt,
            draw=lambda: (draw or words.draw)(numbers),
            tables=made, points=solved, failed=numbers.failed,
        )  # fmt: skip


@typed
def figure_words(package: str) -> FiguresFile:
    """The content of a paper's figures.toml.

    Raises
    ------
    InputError
        If the file is not TOML, or has unknown or missing fields.
    """
    return read_words(files(package).joinpath("figures.toml"), FiguresFile)


@dataclass(frozen=True)
class Section:
    """A section of the report that shows figures.

    Attributes
    ----------
    key : str
        Key of the section in addresses within the page.
    title : str
    figures : sequence of functions
        Each computes one figure.
    observables : mapping of str to Observables
        By the name of a figure that takes measured points: the quantities of its first table.
    before, after : functions
        From the figures of the section to HTML that goes before and after them.
    """

    key: str
    title: str
    figures: Sequence[Callable[[], PaperFigure]]
    observables: Mapping[str, Observables] = field(default_factory=dict)
    before: Callable[[Sequence[PaperFigure]], str] = lambda _: ""
    after: Callable[[Sequence[PaperFigure]], str] = lambda _: ""


#: A line of a figure: ``name``; ``values``, columns by their names; ``lost``, why points are
#: missing, if there are such.
Line: TypeAlias = dict[str, Any]
#: What a text states at one abscissa: ``x``, ``ends``, one number or two, and ``text``.
Mark: TypeAlias = dict[str, Any]
Progress: TypeAlias = Callable[[int, int], None]


@dataclass(frozen=True)
class TabFigure:
    """A figure of the browser page, which is computed for changed numbers of the paper.

    A paper's module ``tab`` has ``FIGURES``, a `TabFigure` by the name of each; figures.toml has
    the paper's numbers that a figure follows from (``numbers``), and labels of its columns.

    Attributes
    ----------
    x : str
        Column of the abscissa.
    rows : sequence of str
        Columns of the ordinates, one panel each.
    logarithmic : tuple of str
        Columns with a logarithmic axis.
    lines : function
        Maps the paper's numbers to the fast lines (milliseconds).
    marks : function
        Maps the paper's numbers to the statements of the text, by the column of the ordinate.
    python : function
        From the names and values of the moved numbers to code that computes the same.
    slow : tuple of str
        Names of slow lines (seconds).
    slow_line : function
        Maps the paper's numbers, a name of `slow` and a progress function to this line.
    extras : function
        Maps the paper's numbers to further fields of the answer.
    """

    x: str
    rows: Sequence[str]
    lines: Callable[[Material], list[Line]]
    python: Callable[[Mapping[str, float]], str]
    logarithmic: tuple[str, ...] = ()
    marks: Callable[[Material], Mapping[str, Sequence[Mark]]] = lambda _: {}
    slow: tuple[str, ...] = ()
    slow_line: Callable[[Material, str, Progress], Line] | None = None
    extras: Callable[[Material], Mapping[str, Any]] = lambda _: {}
