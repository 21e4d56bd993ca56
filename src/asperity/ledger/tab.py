"""Interactive figures of a paper on the browser page.

A paper's module ``tab`` has ``FIGURES``, a `TabFigure` by the name of each; figures.toml says which
of the paper's numbers a figure rests on (``numbers``) and how the page labels its columns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from asperity.materials import Material

#: A line of a figure: ``name``, and ``values``, columns by their names.
Line: TypeAlias = dict[str, Any]
#: What a text states at one abscissa: ``x``, ``ends``, one number or two, and ``text``.
Mark: TypeAlias = dict[str, Any]
Progress: TypeAlias = Callable[[int, int], None]


@dataclass(frozen=True)
class TabFigure:
    """A figure that is computed for changed numbers of the paper.

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
