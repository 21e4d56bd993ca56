"""A figure described in a file: panels, and what is drawn on them, from tables of numbers.

A description has panels, each with the columns of its abscissa and ordinate, and items in the order
of the legend: lines and bands of named curves, points with error bars, and marks of what a text
states. Numbers in a description may be names of computed numbers; ``{name:spec}`` in a label
stands for one of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import pandas as pd
from pydantic import Field

from asperity.errors import require_known
from asperity.figures.style import COLOURS, DASHES, STATED, STATED_FILL, new_figure
from asperity.questions.record import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: A number, or the name of one that is computed.
Value: TypeAlias = float | str
Look: TypeAlias = dict[str, Any]

#: Half a 95 % interval, in standard uncertainties.
NORMAL = 1.96
#: Half the width of a mark at one abscissa, over that of the axis.
_HALF_WIDTH = 0.032
_CORNERS = {"l": (0.025, 0.93), "r": (0.975, 0.93), "L": (0.025, 0.08), "R": (0.975, 0.08)}
_QUOTED = re.compile(r"\{([^{}:]+):([^{}:]*)\}")
_STATED_RANGE: Look = {
    "facecolor": STATED_FILL, "edgecolor": STATED, "linewidth": 0.8, "hatch": "/////", "alpha": 0.75
}  # fmt: skip
_STATED_VALUE: Look = {"color": STATED, "linewidth": 2.2, "solid_capstyle": "butt"}


class Panel(Record):
    """Axes of a figure.

    Attributes
    ----------
    x, y : str
        Columns of the table; ``"a/b"`` is a quotient of two.
    points_x : str
        Column of the abscissa in the table of points, if it has another name.
    x_scale, y_scale : float
        Factors from SI to the units of the axes.
    x_kind : str
        Dimension of the abscissa, a key of `asperity.units.KINDS`.
    less : str
        Column that is subtracted from the points of a panel of residuals.
    degrees : bool
        Whether the ordinate is an angle, drawn in degrees and without jumps.
    curve : str
        Format of the name of a curve, such as ``"lambda, {}"``.
    mark : str
        Corner for the panel's letter: l and r are the upper, L and R the lower ones.
    title : str
        A remark in the colour of the points.
    set : mapping
        Arguments of Matplotlib's `Axes.set`.
    ticks : tuple of (float, str)
        Ticks of the abscissa.
    margin, step : float
        Free space above and below, over the height of the panel; distance of the major ticks.
    plain : bool
        Whether the ordinate is written without offset and power of ten.
    legend : mapping
        Arguments of Matplotlib's `Axes.legend`.
    """

    x: str
    y: str
    points_x: str = ""
    x_scale: float = 1.0
    y_scale: float = 1.0
    x_kind: str = "dimensionless"
    less: str = ""
    degrees: bool = False
    curve: str = "{}"
    mark: str = ""
    title: str = ""
    set: dict[str, Any] = Field(default_factory=dict)
    ticks: tuple[tuple[float, str], ...] = ()
    margin: float | None = None
    step: float | None = None
    plain: bool = False
    legend: dict[str, Any] = Field(default_factory=dict)


class Item(Record):
    """An element of panels, and its entry in a legend.

    Attributes
    ----------
    kind : str
        "line" of a curve; "band" between the lowest and the highest of `curves`; "points" with bars
        of 95 %; "value" and "range" that a text states at one abscissa; "remark" on such a value;
        "text"; "marker"; "arrow" between two points; "slope", a line through the origin; "level"
        and "limit", a line across at an ordinate or abscissa; "zone" and "strip", the area between
        two of them; "key", an entry of a legend alone.
    panels : tuple of int
        All by default.
    curve : str
    curves : tuple of str
    where : mapping
        Values of columns that select the points.
    x, y : number or name of a number
        Position of the item; two numbers are its ends.
    times : number or name of a number
        Factor on the abscissa.
    aside : float
        Added to the abscissa of residuals, so that no bar hides another; or its factor, where the
        axis is logarithmic.
    text, label : str
        On the panel, and in the legend.
    legend : int
        Panel that has the entry: by default each of `panels` that has a legend; -1 is the legend of
        the figure.
    look : mapping
        Arguments of Matplotlib; colours and dashes may be names of `asperity.figures.style`, and
        the rotation of a text the name of a number.
    """

    kind: Literal[
        "line", "band", "points", "value", "range", "remark", "text", "marker", "arrow", "slope",
        "level", "limit", "zone", "strip", "key",
    ] = "line"  # fmt: skip
    panels: tuple[int, ...] = ()
    curve: str = ""
    curves: tuple[str, ...] = ()
    where: dict[str, Any] = Field(default_factory=dict)
    x: Value | tuple[Value, ...] = ()
    y: Value | tuple[Value, ...] = ()
    times: Value = 1.0
    aside: float | None = None
    text: str = ""
    label: str = ""
    legend: int | None = None
    look: dict[str, Any] = Field(default_factory=dict)


class Plot(Record):
    """A figure: size in inches, panels row by row, and items in the order of the legend."""

    size: tuple[float, float] = (5.0, 3.5)
    columns: int = 1
    heights: tuple[float, ...] = ()
    panel: tuple[Panel, ...]
    draw: tuple[Item, ...] = ()
    legend: dict[str, Any] = Field(default_factory=dict)

    def figure(
        self,
        data: pd.DataFrame,
        numbers: Mapping[str, float],
        points: pd.DataFrame | None = None,
    ) -> Figure:
        """Draw; the style must be active.

        Parameters
        ----------
        data : DataFrame
            Rows of curves, named in the column ``curve``.
        numbers : mapping of str to float
        points : DataFrame, optional
            Rows of points, with the uncertainty of a column in ``NAME_uncertainty``.

        Raises
        ------
        InputError
            If a curve or a number is missing.
        """
        return _Drawing(self, data, numbers, points).figure


class _Drawing:
    """A plot with its numbers."""

    def __init__(
        self,
        plot: Plot,
        data: pd.DataFrame,
        numbers: Mapping[str, float],
        points: pd.DataFrame | None,
    ) -> None:
        self.data, self.numbers, self.points = data, numbers, points
        self.figure = new_figure(*plot.size)
        columns = plot.columns
        rows = -(-len(plot.panel) // columns)
        of_rows = (plot.panel[k * columns : (k + 1) * columns] for k in range(rows))
        alike = columns > 1 and all(len({p.y for p in row}) == 1 for row in of_rows)
        grid = self.figure.subplots(
            rows, columns, squeeze=False,
            sharex="col" if columns > 1 else True,
            sharey="row" if alike else False, height_ratios=plot.heights or None,
        )  # fmt: skip
        self.panels = list(zip(plot.panel, grid.ravel(), strict=True))
        letters = iter("abcdefgh")
        for panel, axis in self.panels:
            _prepare(panel, axis, letters if panel.mark else None)
        entries: dict[int, list[Any]] = {}
        for item in plot.draw:
            handles: dict[int, Any] = {}
            for n in item.panels or range(len(self.panels)):
                panel, axis = self.panels[n]
                handle = self._add(item, panel, axis)
                if item.label:
                    handles[n] = handle or self._key(item, panel)
            places = {n: n for n in handles if self.panels[n][0].legend}
            if item.legend is not None and handles:
                places = {item.legend: next(iter(handles))}
            for place, n in places.items():
                entries.setdefault(place, []).append(handles[n])
        for n, listed in entries.items():
            panel, axis = self.panels[n]
            if n < 0:
                self.figure.legend(handles=listed, **_plain(plot.legend))
            else:
                options = {k: self.words(v, panel) for k, v in panel.legend.items()}
                axis.legend(handles=listed, **_plain(options))

    # --- Names to numbers ------------------------------------------------------------------------

    def value(self, value: Value, panel: Panel) -> float:
        """A number, or the computed number of that name, of the panel's curve if there is one."""
        if not isinstance(value, str):
            return float(value)
        of_curve = panel.curve.replace("{}", value)
        name = of_curve if of_curve in self.numbers else value
        require_known(name, self.numbers, "a figure's numbers", "be computed")
        return float(self.numbers[name])

    def ends(self, values: Value | tuple[Value, ...], panel: Panel) -> list[float]:
        ends = values if isinstance(values, tuple) else (values,)
        return [self.value(v, panel) for v in ends]

    def words(self, text: Any, panel: Panel) -> Any:
        """A label with its numbers."""
        if not isinstance(text, str):
            return text
        return _QUOTED.sub(lambda m: format(self.value(m[1], panel), m[2]), text)

    def curve(self, name: str, panel: Panel) -> pd.DataFrame:
        full = panel.curve.replace("{}", name)
        names = [str(one) for one in self.data["curve"].unique()]
        require_known(full, names, "a figure's curves", "be computed")
        return self.data[self.data["curve"] == full]

    # --- Items -----------------------------------------------------------------------------------

    def _add(self, item: Item, panel: Panel, axis: Axes) -> Any:
        """Draw an item; returns its handle for the legend, where that is not made by `_key`."""
        if item.kind == "key":
            return None  # an entry of the legend alone
        draw: Callable[[Item, Panel, Axes], Any] = getattr(self, f"_{item.kind}")
        return draw(item, panel, axis)

    def _key(self, item: Item, panel: Panel) -> Any:
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        label, look = self.words(item.label, panel), _look(item.look)
        if item.kind == "band":
            return Patch(label=label, **look)
        if item.kind == "range":
            return Patch(**_STATED_RANGE, label=label)
        if item.kind == "value":
            look = _STATED_VALUE
        return Line2D([], [], label=label, **look)

    def _line(self, item: Item, panel: Panel, axis: Axes) -> None:
        rows = self.curve(item.curve, panel)
        x, y = panel.x_scale * _column(rows, panel.x), _column(rows, panel.y)
        if panel.degrees:
            kept = np.isfinite(y)
            x, y = x[kept], np.degrees(np.unwrap(y[kept]))
        if axis.get_yscale() == "log":
            x, y = x[y > 0], y[y > 0]
        axis.plot(self.value(item.times, panel) * x, panel.y_scale * y, **_look(item.look))

    def _band(self, item: Item, panel: Panel, axis: Axes) -> None:
        curves = [self.curve(name, panel) for name in item.curves]
        values = np.array([_column(rows, panel.y) for rows in curves])
        x = panel.x_scale * _column(curves[0], panel.x)
        low, high = panel.y_scale * values.min(axis=0), panel.y_scale * values.max(axis=0)
        axis.fill_between(x, low, high, zorder=1, **_look(item.look))

    def _points(self, item: Item, panel: Panel, axis: Axes) -> Any:
        assert self.points is not None  # a plot with points is given their table
        rows = self.points
        for column, value in item.where.items():
            rows = rows[rows[column] == value]
        x, y = panel.x_scale * _column(rows, panel.points_x or panel.x), _column(rows, panel.y)
        if panel.less:
            y = y - _column(rows, panel.less)
            if item.aside is not None:
                x = x * item.aside if axis.get_xscale() == "log" else x + item.aside
        look: Look = {
            "color": COLOURS["points"], "linestyle": "none", "markersize": 5.5, "elinewidth": 1.0,
            "capsize": 2.5, "zorder": 4,
        }  # fmt: skip
        bars = NORMAL * panel.y_scale * _column(rows, f"{panel.y}_uncertainty")
        return axis.errorbar(
            self.value(item.times, panel) * x, panel.y_scale * y, yerr=bars,
            label=self.words(item.label, panel), **(look | _look(item.look)),
        )  # fmt: skip

    def _value(self, item: Item, panel: Panel, axis: Axes) -> None:
        """Marks of numbers that a text states at one abscissa without an error."""
        (x,), half = self.ends(item.x, panel), _half_width(axis)
        for y in self.ends(item.y, panel):
            y *= panel.y_scale
            axis.plot([x - half, x + half], [y, y], zorder=5, **_STATED_VALUE)

    def _range(self, item: Item, panel: Panel, axis: Axes) -> None:
        """A hatched bar over the interval that a text states at one abscissa.

        It lies below the curves and is wide, so that it is not taken for a measured point.
        """
        from matplotlib.patches import Rectangle

        (x,), half = self.ends(item.x, panel), _half_width(axis)
        low, high = sorted(panel.y_scale * y for y in self.ends(item.y, panel))
        corner = (x - half, low)
        axis.add_patch(Rectangle(corner, 2 * half, high - low, **_STATED_RANGE, zorder=1.5))

    def _remark(self, item: Item, panel: Panel, axis: Axes) -> None:
        look = {"color": "stated", "style": "italic", "fontsize": 9.5} | item.look
        self._text(item.model_copy(update={"look": look}), panel, axis)

    def _text(self, item: Item, panel: Panel, axis: Axes) -> None:
        look = _look(item.look)
        if look.pop("inside", False):
            look["transform"] = axis.transAxes
        if look.get("rotation") in self.numbers:
            look["rotation"] = self.numbers[look["rotation"]]
        (x,), (y,) = self.ends(item.x, panel), self.ends(item.y, panel)
        axis.text(x, y, self.words(item.text, panel), **look)

    def _marker(self, item: Item, panel: Panel, axis: Axes) -> None:
        look: Look = {"linestyle": "none"} | _look(item.look)
        axis.plot(self.ends(item.x, panel), self.ends(item.y, panel), **look)

    def _arrow(self, item: Item, panel: Panel, axis: Axes) -> None:
        (x, x_end), (y, y_end) = self.ends(item.x, panel), self.ends(item.y, panel)
        look = {"arrowstyle": "-|>"} | _look(item.look)
        axis.annotate("", xy=(x_end, y_end), xytext=(x, y), arrowprops=look)

    def _slope(self, item: Item, panel: Panel, axis: Axes) -> None:
        x, (slope,) = np.array(self.ends(item.x, panel)), self.ends(item.y, panel)
        axis.plot(panel.x_scale * x, panel.y_scale * slope * x, **_look(item.look))

    def _level(self, item: Item, panel: Panel, axis: Axes) -> None:
        for y in self.ends(item.y, panel):
            axis.axhline(panel.y_scale * y, **_look(item.look))

    def _limit(self, item: Item, panel: Panel, axis: Axes) -> None:
        for x in self.ends(item.x, panel):
            axis.axvline(panel.x_scale * x, **_look(item.look))

    def _zone(self, item: Item, panel: Panel, axis: Axes) -> None:
        axis.axhspan(*self.ends(item.y, panel), **_look(item.look))

    def _strip(self, item: Item, panel: Panel, axis: Axes) -> None:
        axis.axvspan(*(panel.x_scale * x for x in self.ends(item.x, panel)), **_look(item.look))


def _prepare(panel: Panel, axis: Axes, letters: Any) -> None:
    axis.set(**_plain(panel.set))
    if panel.ticks:
        axis.set_xticks([at for at, _ in panel.ticks], [text for _, text in panel.ticks])
        axis.tick_params(which="minor", labelbottom=False)
    if panel.margin is not None:
        axis.margins(y=panel.margin)
    if panel.title:
        axis.set_title(panel.title, color=COLOURS["points"])
    if panel.plain:
        axis.ticklabel_format(axis="y", useOffset=False, style="plain")
    if panel.step is not None:
        from matplotlib.ticker import MultipleLocator

        axis.yaxis.set_major_locator(MultipleLocator(panel.step))
    if letters is not None:
        x, y = _CORNERS[panel.mark]
        axis.text(
            x, y, f"({next(letters)})", transform=axis.transAxes,
            va="top" if y > 0.5 else "bottom", ha="left" if x < 0.5 else "right",
        )  # fmt: skip


def _half_width(axis: Axes) -> float:
    left, right = axis.get_xlim()
    return _HALF_WIDTH * float(right - left)


def _column(rows: pd.DataFrame, name: Any) -> np.ndarray:
    top, _, bottom = str(name).partition("/")
    values = rows[top].to_numpy(float)
    if not bottom:
        return values
    with np.errstate(invalid="ignore"):
        return values / rows[bottom].to_numpy(float)


def _look(look: Mapping[str, Any]) -> Look:
    """Matplotlib's words, with names of colours and dashes replaced."""
    named = {
        key: COLOURS.get(value, DASHES.get(value, value)) if isinstance(value, str) else value
        for key, value in look.items()
    }
    return _plain(named)


def _plain(options: Mapping[str, Any]) -> Look:
    """Arrays of TOML as the tuples that Matplotlib asks for."""
    return {key: _tupled(value) for key, value in options.items()}


def _tupled(value: Any) -> Any:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(_tupled(one) for one in value)
    return value
