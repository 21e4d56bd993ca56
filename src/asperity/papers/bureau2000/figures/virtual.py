"""Figures 2 to 5 of the virtual experiment: points with error bars, marked as simulated."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure

from asperity.figures.style import ELASTO_PLASTIC, FAST, SLOW, new_figure
from asperity.papers.bureau2000.figures.elements import (
    AMPLITUDE,
    APPLIED,
    DROP,
    draw_curve,
    drops_key,
    key,
    mark_drops,
    mark_panels,
    mark_statement,
    remark,
    statement_key,
    thousandths,
)
from asperity.papers.bureau2000.numbers import stated
from asperity.papers.bureau2000.virtual import NORMAL, VirtualNumbers

#: Symbols as in the captions of the paper: open for the slow velocity, full for the fast one.
_SYMBOLS = "#B3261E"
_OPEN: dict[str, Any] = {"markerfacecolor": "white"}
_FULL: dict[str, Any] = {"markerfacecolor": _SYMBOLS}
_LINE: dict[str, Any] = {"color": ELASTO_PLASTIC, "linewidth": 1.2, "zorder": 2}
_SMALL = 1e3


def draw_2(numbers: VirtualNumbers) -> Figure:
    """Change of the mean against eps."""
    (figure, axis, below), seen = _with_residuals(), stated()
    axis.set(xlim=(0, 0.53), ylim=(-0.138, 0.004), ylabel=DROP)
    mark_drops(axis, seen.epsilon, seen.drops)
    handles = _series(axis, below, numbers, "delta_mu")
    below.set(xlabel=AMPLITUDE)
    axis.legend(handles=[*handles, drops_key()], loc="lower left", labelspacing=0.35)
    _title(axis)
    return figure


def draw_3(numbers: VirtualNumbers) -> Figure:
    """Mean against V."""
    figure, axis, below = _with_residuals()
    symbols = (("o", _OPEN), ("^", _OPEN), ("o", _FULL), ("^", _FULL))
    handles: list[Any] = []
    curves = numbers.data["curve"].unique()
    for i, (name, (marker, face)) in enumerate(zip(curves, symbols, strict=True)):
        rows = numbers.curve(name)
        axis.plot(1e6 * rows["V"], rows["mean_friction"], **_LINE)
        epsilon = float(rows[APPLIED].iloc[0])
        points = numbers.points[numbers.points["epsilon_set"] == epsilon]
        points = points.assign(V=1e6 * points["V"])
        symbol = {"marker": marker, **face}
        label = rf"$\epsilon={epsilon:g}$"
        handles.append(_points(axis, points, "mean_friction", label, symbol, x="V"))
        aside = _less_model(points.assign(V=points["V"] * 1.07 ** (i - 1.5)), "mean_friction")
        _points(below, aside, "mean_friction", "", symbol, x="V", scale=_SMALL)
    axis.set(xscale="log", xlim=(0.6, 170), ylim=(0.32, 0.56), ylabel=r"mean friction $\bar{\mu}$")
    below.set(xlabel="pulling velocity $V$ (µm/s)")
    below.set_xticks([1, 10, 100], ["1", "10", "100"])
    handles.append(key("elasto-plastic law", **_LINE))
    axis.legend(handles=handles, loc="upper right", ncols=3, columnspacing=1.0)
    remark(axis, "stated: the slope does not change", (0.7, 0.33))
    _title(axis)
    return figure


def draw_4(numbers: VirtualNumbers) -> Figure:
    """First and second harmonic against eps."""
    seen = stated()
    figure = new_figure(5.0, 7.6)
    panels = figure.subplots(4, 1, sharex=True, height_ratios=(3, 1, 3, 1))
    mark_panels([panels[0], panels[2]], "ll")
    handles: list[Any] = []
    for i, (column, symbol, top) in enumerate((("mu1", r"\mu_1", 3.4), ("mu2", r"\mu_2", 0.52))):
        axis, below = panels[2 * i], panels[2 * i + 1]
        _prepare_residuals(below)
        axis.set(xlim=(0, 0.53), ylim=(0, top))
        handles = _series(axis, below, numbers, column, scale=_SMALL)
        thousandths(axis, symbol)
    mark_statement(panels[0], seen.epsilon, seen.mu1, _SMALL)
    remark(panels[0], r"of order $10^{-3}$", (0.475, 3.0), ha="right", va="center")
    panels[-1].set_xlabel(AMPLITUDE)
    panels[2].legend(
        handles=[*handles, statement_key()], loc="upper left", bbox_to_anchor=(0.08, 1.0),
        labelspacing=0.35,
    )  # fmt: skip
    _title(panels[0])
    return figure


def draw_5(numbers: VirtualNumbers) -> Figure:
    """Change of the mean in air and in vacuum, and in air against the scaled amplitude."""
    figure, axis, below = _with_residuals()
    vacuum, air = (series.name for series in numbers.series)
    handles: list[Any] = []
    for name, marker, dashes in ((vacuum, "o", SLOW), (air, "^", FAST)):
        line = _LINE | {"linestyle": dashes}
        draw_curve(axis, numbers.curve(name), APPLIED, "delta_mu", **line)
        mark, rows = {"marker": marker, **_OPEN}, numbers.of(name)
        handles.append(_points(axis, rows, "delta_mu", name, mark))
        handles.append(key(f"elasto-plastic law, {name}", **line))
        _points(below, _less_model(rows, "delta_mu"), "delta_mu", "", mark, scale=_SMALL)
    factor = numbers.recovered[0].value
    points = numbers.of(air)
    scaled = points.assign(epsilon=factor * points["epsilon"])
    label = rf"1 atm, against ${factor:.3f}\,\epsilon$"
    handles.append(_points(axis, scaled, "delta_mu", label, {"marker": "^", **_FULL}))
    axis.set(xlim=(0, 0.53), ylim=(-0.32, 0.01), ylabel=DROP)
    below.set(xlabel=AMPLITUDE)
    axis.legend(handles=handles, loc="lower left", labelspacing=0.35)
    _title(axis)
    return figure


def _series(
    axis: Axes, below: Axes, numbers: VirtualNumbers, column: str, *, scale: float = 1.0
) -> list[Any]:
    """Points, the model's lines and residuals of both velocities; returns the legend's entries."""
    points, lines = [], []
    for i, (name, symbol, dashes) in enumerate(_speeds(numbers)):
        line = _LINE | {"linestyle": dashes}
        draw_curve(axis, numbers.curve(name), APPLIED, column, scale, **line)
        rows = numbers.of(name)
        points.append(_points(axis, rows, column, _speed(name), symbol, scale=scale))
        lines.append(key(f"elasto-plastic law, {_speed(name)}", **line))
        # Moved apart sideways, so that no bar hides another.
        aside = _less_model(rows.assign(epsilon=rows["epsilon"] + 0.008 * i), column)
        _points(below, aside, column, "", symbol, scale=_SMALL)
    return [*points, *lines]


def _with_residuals() -> tuple[Figure, Axes, Axes]:
    """A panel for the points, and one below for what they differ by from the model."""
    figure = new_figure(5.0, 5.0)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    _prepare_residuals(below)
    return figure, above, below


def _prepare_residuals(axis: Axes) -> None:
    axis.axhline(0, **_LINE)
    axis.margins(y=0.12)
    axis.set_ylabel("less the model\n" + r"$(10^{-3})$")


def _less_model(rows: pd.DataFrame, column: str) -> pd.DataFrame:
    return rows.assign(**{column: rows[column] - rows[f"{column}_model"]})


def _speeds(numbers: VirtualNumbers) -> list[tuple[str, dict[str, Any], Any]]:
    """Name, symbol and dashes of the slow series and the fast one."""
    slow, fast = (series.name for series in numbers.series)
    return [(slow, {"marker": "o", **_OPEN}, SLOW), (fast, {"marker": "o", **_FULL}, FAST)]


def _speed(name: str) -> str:
    return name.replace(" um", " µm")


def _points(
    axis: Axes,
    rows: pd.DataFrame,
    column: str,
    label: str,
    symbol: Mapping[str, Any],
    *,
    x: str = "epsilon",
    scale: float = 1.0,
) -> ErrorbarContainer:
    """Readings with 95 % bars; the handle is for the legend."""
    look: dict[str, Any] = {
        "color": _SYMBOLS, "linestyle": "none", "markersize": 5.5, "elinewidth": 1.0,
        "capsize": 2.5, "zorder": 4,
    }  # fmt: skip
    bars = NORMAL * scale * np.asarray(rows[f"{column}_uncertainty"])
    return axis.errorbar(
        rows[x], scale * rows[column], yerr=bars, label=label, **(look | dict(symbol))
    )


def _title(axis: Axes) -> None:
    """Mark the picture, wherever it goes: nobody may take the points for measured ones."""
    axis.set_title("SIMULATED recordings, read by the lock-in; bars: 95 %", color=_SYMBOLS)


#: What draws the numbers of each figure.
VIRTUAL_DRAWN: Mapping[str, Callable[[VirtualNumbers], Figure]] = MappingProxyType(
    {"virtual-02": draw_2, "virtual-03": draw_3, "virtual-04": draw_4, "virtual-05": draw_5}
)
