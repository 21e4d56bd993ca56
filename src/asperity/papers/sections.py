"""What a paper hands to its report: figures with their tables, in sections."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from asperity.papers.measured_points import Observable

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class FigureTable:
    """The numbers behind a figure, as a CSV file.

    Attributes
    ----------
    name : str
        Of the file, without its ending.
    data : DataFrame
    header : sequence of str
        What the first lines of the file say.
    columns : mapping of str to str
        Unit and meaning of each column.
    """

    name: str
    data: pd.DataFrame
    header: Sequence[str]
    columns: Mapping[str, str]


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the report.

    Attributes
    ----------
    name : str
        Of its files.
    place : str
        The paper's number for it, such as "Figure 2".
    title, caption : str
    alt : str
        What someone who cannot see the figure needs to know.
    draw : function
        Returns the Matplotlib figure.
    tables : sequence of FigureTable
    points : int
        Operating points that were solved for it.
    failed : int
        Those of them that did not converge.
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


@dataclass(frozen=True)
class Section:
    """A section of the report that shows figures.

    Attributes
    ----------
    key : str
        Of the section in addresses within the page.
    title : str
    figures : sequence of functions
        Each computes one figure.
    observables : mapping of str to sequence of Observable
        By the name of a figure that takes measured points: the quantities of its first table.
    before, after : functions
        From the figures of the section to HTML that goes before and after them.
    """

    key: str
    title: str
    figures: Sequence[Callable[[], PaperFigure]]
    observables: Mapping[str, Sequence[Observable]] = field(default_factory=dict)
    before: Callable[[Sequence[PaperFigure]], str] = lambda _: ""
    after: Callable[[Sequence[PaperFigure]], str] = lambda _: ""
