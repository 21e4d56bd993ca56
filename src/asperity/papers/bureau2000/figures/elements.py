"""Pieces that several figures share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from asperity.figures.style import (
    ELASTO_PLASTIC,
    FAST,
    INERTIA,
    SLOW,
    STATED,
    STATED_FILL,
    new_figure,
)
from asperity.papers.bureau2000.numbers import FigureNumbers, Stated
from asperity.papers.bureau2000.numbers.bands import LENGTH, RATE_AND_STATE, band
from asperity.papers.bureau2000.numbers.mean import inertial_name

APPLIED, BORNE = "epsilon_applied", "epsilon_eff"
AMPLITUDE = r"modulation amplitude $\epsilon$"
EFFECTIVE = r"effective amplitude $\epsilon_{\mathrm{eff}}$"
DROP = r"$\Delta\bar{\mu}$"

#: Half the width of the bar that stands for a statement at one amplitude, over that of the axis.
_HALF_WIDTH = 0.032
_STATEMENT: dict[str, Any] = {
    "facecolor": STATED_FILL,
    "edgecolor": STATED,
    "linewidth": 0.8,
    "hatch": "/////",
    "alpha": 0.75,
}
_DROP_MARK: dict[str, Any] = {"color": STATED, "linewidth": 2.2, "solid_capstyle": "butt"}

#: Name of a curve, what the legend calls it, and its dashes.
SPEEDS = (("1 um/s", "1 µm/s", SLOW), ("10 um/s", "10 µm/s", FAST))
#: Of the curves that count the mass.
INERTIAL: dict[str, Any] = {"color": INERTIA, "linewidth": 1.0}
_BAND_ALPHA = {RATE_AND_STATE: 0.35, LENGTH: 0.16, (*RATE_AND_STATE, *LENGTH): 0.2}


def stacked(panels: int, height: float, corners: str) -> tuple[Figure, list[Axes]]:
    """Panels one above the other on a common axis of amplitudes, marked (a), (b), ...

    Parameters
    ----------
    panels : int
    height : float
        Of the figure, in inches.
    corners : str
        A letter a panel: "l" or "r", the upper corner that is free for the mark.
    """
    figure = new_figure(5.0, height)
    axes = list(figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0])
    mark_panels(axes, corners)
    return figure, axes


def mark_panels(axes: Sequence[Axes], corners: str) -> None:
    """Write (a), (b), ... into the panels.

    `corners` are those of `stacked`; "L" and "R" are the lower ones.
    """
    places = {"l": (0.025, 0.93), "r": (0.975, 0.93), "L": (0.025, 0.08), "R": (0.975, 0.08)}
    for axis, letter, corner in zip(axes, "abcdef", corners, strict=False):
        x, y = places[corner]
        axis.text(
            x, y, f"({letter})", transform=axis.transAxes,
            va="top" if y > 0.5 else "bottom", ha="left" if x < 0.5 else "right",
        )  # fmt: skip


def draw_curve(
    axis: Axes, rows: pd.DataFrame, x: str, y: str, scale: float = 1.0, **line: Any
) -> None:
    """One curve of a table; `scale` multiplies what is drawn, as its axis says."""
    if axis.get_yscale() == "log":
        rows = rows[rows[y] > 0]
    axis.plot(rows[x], scale * rows[y], **line)


def draw_both_speeds(
    axis: Axes, numbers: FigureNumbers, x: str, y: str, scale: float = 1.0, **line: Any
) -> None:
    """The curves of 1 and of 10 um/s, in their dashes."""
    for name, _, dashes in SPEEDS:
        draw_curve(axis, numbers.curve(name), x, y, scale, **{"linestyle": dashes} | line)


def draw_inertial(axis: Axes, numbers: FigureNumbers, x: str, y: str, scale: float = 1.0) -> None:
    """The same curves with the mass of the slider."""
    for name, _, dashes in SPEEDS:
        rows = numbers.curve(inertial_name(name))
        draw_curve(axis, rows, x, y, scale, linestyle=dashes, **INERTIAL)


def draw_band(
    axis: Axes,
    numbers: FigureNumbers,
    y: str,
    parameters: tuple[str, ...],
    *,
    x: str = APPLIED,
    scale: float = 1.0,
) -> None:
    """What the published uncertainties of some parameters make of the curve at 1 um/s."""
    name = SPEEDS[0][0]
    low, high = band(numbers, name, y, parameters)
    axis.fill_between(
        numbers.curve(name)[x], scale * low, scale * high, zorder=1, **band_look(parameters)
    )


def band_look(parameters: tuple[str, ...]) -> dict[str, Any]:
    """Colour of a band, for the axis and for the legend."""
    return {"color": ELASTO_PLASTIC, "alpha": _BAND_ALPHA[parameters], "linewidth": 0}


def band_key(label: str, parameters: tuple[str, ...]) -> Patch:
    """An entry of the legend for a band."""
    return Patch(label=label, **band_look(parameters))


def speed_keys(law: str, colour: str) -> list[Line2D]:
    """Entries of the legend for a law at 1 and at 10 um/s."""
    return [key(f"{law}, {text}", color=colour, linestyle=dashes) for _, text, dashes in SPEEDS]


def inertia_key(label: str = "with inertia") -> Line2D:
    """An entry of the legend for the curves that count the mass."""
    return key(label, **INERTIAL)


def mark_drops(axis: Axes, epsilon: float, drops: tuple[float, float]) -> None:
    """20 % of the friction coefficient at 1 and at 10 um/s: two marks, as no error is stated.

    The limits of the axis must be set before.
    """
    left, right = axis.get_xlim()
    half = _HALF_WIDTH * (right - left)
    for drop in drops:
        axis.plot([epsilon - half, epsilon + half], [drop, drop], zorder=5, **_DROP_MARK)


def drops_key(label: str = r"stated: 20 % of $\bar{\mu}$ at 1 and 10 µm/s") -> Line2D:
    """What the legend calls the marks of `mark_drops`."""
    return key(label, **_DROP_MARK)


def mark_statement(
    axis: Axes, epsilon: float, ends: tuple[float, float], scale: float = 1.0
) -> None:
    """A hatched bar over the interval that the text states at one amplitude.

    It lies below the curves and is wide, so that nobody takes it for a measured point. The limits
    of the axis must be set before.
    """
    low, high = sorted(scale * end for end in ends)
    left, right = axis.get_xlim()
    half = _HALF_WIDTH * (right - left)
    axis.add_patch(Rectangle((epsilon - half, low), 2 * half, high - low, **_STATEMENT, zorder=1.5))


def remark(axis: Axes, text: str, at: tuple[float, float], **options: Any) -> None:
    """A remark on what the text states."""
    look: dict[str, Any] = {"color": STATED, "style": "italic", "fontsize": 9.5} | options
    axis.text(*at, text, **look)


def shade_noise(axis: Axes, seen: Stated) -> None:
    """The amplitudes at which the text finds the drop within the noise."""
    axis.axvspan(0, seen.onset, facecolor=STATED_FILL, alpha=0.35, linewidth=0)


def statement_key(label: str = "stated in the text") -> Patch:
    """What the legend calls an interval that the text states."""
    return Patch(**_STATEMENT, label=label)


def key(label: str, **line: Any) -> Line2D:
    """An entry of the legend."""
    return Line2D([], [], label=label, **line)


def thousandths(axis: Axes, name: str) -> None:
    """Label an axis of harmonics in units of 10^-3, as the paper has it."""
    axis.set_ylabel(rf"${name}\ \ (10^{{-3}})$")
