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

from asperity.figures.paper.parts import (
    AMPLITUDE,
    APPLIED,
    DROP,
    draw_curve,
    key,
    mark_statement,
    say,
    stacked,
    statement_key,
    thousandths,
)
from asperity.figures.style import ELASTO_PLASTIC, FAST, SLOW, new_figure
from asperity.study.paper import stated
from asperity.study.paper.virtual import NORMAL, VirtualNumbers

#: Symbols as in the captions of the paper: open for the slow velocity, full for the fast one.
_SYMBOLS = "#B3261E"
_OPEN: dict[str, Any] = {"markerfacecolor": "white"}
_FULL: dict[str, Any] = {"markerfacecolor": _SYMBOLS}
_LINE: dict[str, Any] = {"color": ELASTO_PLASTIC, "linewidth": 1.2, "zorder": 2}
_SMALL = 1e3


def draw_2(numbers: VirtualNumbers) -> Figure:
    """Change of the mean against eps."""
    (figure, axis, below), seen = _with_residuals(), stated()
    handles: list[Any] = []
    axis.set(xlim=(0, 0.53), ylim=(-0.124, 0.004), ylabel=DROP)
    mark_statement(axis, seen.epsilon, seen.drop)
    for i, (name, symbol, dashes) in enumerate(_speeds(numbers)):
        draw_curve(axis, numbers.curve(name), APPLIED, "delta_mu", linestyle=dashes, **_LINE)
        rows = numbers.of(name)
        handles.append(_points(axis, rows, "delta_mu", _speed(name), symbol))
        aside = rows.assign(epsilon=rows["epsilon"] + 0.008 * i)
        _points(below, _less_model(aside, "delta_mu"), "delta_mu", "", symbol, scale=_SMALL)
    below.set(xlabel=AMPLITUDE)
    handles += [key("elasto-plastic law", **_LINE), statement_key()]
    axis.legend(handles=handles, loc="lower left")
    _simulated(axis)
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
    say(axis, "stated: the slope does not change", (0.7, 0.33))
    _simulated(axis)
    return figure


def draw_4(numbers: VirtualNumbers) -> Figure:
    """First and second harmonic against eps."""
    figure, axes = stacked(2, 6.0, "ll")
    seen = stated()
    limits = (3.4, 0.46)
    for axis, column, symbol, top in zip(
        axes, ("mu1", "mu2"), (r"\mu_1", r"\mu_2"), limits, strict=True
    ):
        handles: list[Any] = []
        axis.set(xlim=(0, 0.53), ylim=(0, top))
        for name, mark, dashes in _speeds(numbers):
            rows = numbers.curve(name)
            draw_curve(axis, rows, APPLIED, column, _SMALL, linestyle=dashes, **_LINE)
            points = numbers.of(name)
            handles.append(_points(axis, points, column, _speed(name), mark, scale=_SMALL))
        thousandths(axis, symbol)
        _simulated(axis, title=axis is axes[0])
    mark_statement(axes[0], seen.epsilon, seen.mu1, _SMALL)
    say(axes[0], r"of order $10^{-3}$", (0.475, 3.0), ha="right", va="center")
    axes[1].set_xlabel(AMPLITUDE)
    handles += [key("elasto-plastic law", **_LINE), statement_key()]
    axes[1].legend(handles=handles, loc="upper left", bbox_to_anchor=(0.08, 1.0))
    return figure


def draw_5(numbers: VirtualNumbers) -> Figure:
    """Change of the mean in air and in vacuum, and in air against the scaled amplitude."""
    figure, axis, below = _with_residuals()
    vacuum, air = (series.name for series in numbers.series)
    handles: list[Any] = []
    for name, marker, dashes in ((vacuum, "o", SLOW), (air, "^", FAST)):
        draw_curve(axis, numbers.curve(name), APPLIED, "delta_mu", linestyle=dashes, **_LINE)
        mark, rows = {"marker": marker, **_OPEN}, numbers.of(name)
        handles.append(_points(axis, rows, "delta_mu", name, mark))
        _points(below, _less_model(rows, "delta_mu"), "delta_mu", "", mark, scale=_SMALL)
    factor = numbers.findings[0].value
    points = numbers.of(air)
    scaled = points.assign(epsilon=factor * points["epsilon"])
    label = rf"1 atm, against ${factor:.3f}\,\epsilon$"
    handles.append(_points(axis, scaled, "delta_mu", label, {"marker": "^", **_FULL}))
    axis.set(xlim=(0, 0.53), ylim=(-0.30, 0.01), ylabel=DROP)
    below.set(xlabel=AMPLITUDE)
    handles.append(key("elasto-plastic law", **_LINE))
    axis.legend(handles=handles, loc="lower left")
    _simulated(axis)
    return figure


def _with_residuals() -> tuple[Figure, Axes, Axes]:
    """A panel for the points, and one below for what they differ by from the model."""
    figure = new_figure(5.0, 4.8)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    below.axhline(0, **_LINE)
    below.margins(y=0.12)
    below.set_ylabel("less the model\n" + r"$(10^{-3})$")
    return figure, above, below


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


def _simulated(axis: Axes, *, title: bool = True) -> None:
    """So that nobody takes the points for measured ones, wherever the picture goes."""
    if title:
        axis.set_title("SIMULATED recordings, read by the lock-in; bars: 95 %", color=_SYMBOLS)
    axis.text(
        0.5, 0.5, "SIMULATED", transform=axis.transAxes, fontsize=40, color=_SYMBOLS, alpha=0.09,
        ha="center", va="center", rotation=24, zorder=0, fontweight="bold",
    )  # fmt: skip


#: What draws the numbers of each figure.
VIRTUAL_DRAWN: Mapping[str, Callable[[VirtualNumbers], Figure]] = MappingProxyType(
    {"virtual-02": draw_2, "virtual-03": draw_3, "virtual-04": draw_4, "virtual-05": draw_5}
)
