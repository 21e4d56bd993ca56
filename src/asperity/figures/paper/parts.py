"""Pieces that several figures share."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from asperity.figures.style import STATED, STATED_FILL, new_figure
from asperity.study.paper import Stated

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
    for axis, letter, corner in zip(axes, "abc", corners, strict=False):
        at, side = (0.025, "left") if corner == "l" else (0.975, "right")
        axis.text(at, 0.93, f"({letter})", transform=axis.transAxes, va="top", ha=side)
    return figure, axes


def draw_curve(
    axis: Axes, rows: pd.DataFrame, x: str, y: str, scale: float = 1.0, **line: Any
) -> None:
    """One curve of a table; `scale` multiplies what is drawn, as its axis says."""
    axis.plot(rows[x], scale * rows[y], **line)


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


def say(axis: Axes, text: str, at: tuple[float, float], **options: Any) -> None:
    """A remark on what the text states."""
    look: dict[str, Any] = {"color": STATED, "style": "italic", "fontsize": 9.5} | options
    axis.text(*at, text, **look)


def shade_noise(axis: Axes, seen: Stated) -> None:
    """The amplitudes at which the text finds the drop within the noise."""
    axis.axvspan(0, seen.onset, facecolor=STATED_FILL, alpha=0.35, linewidth=0)


def statement_key() -> Patch:
    """What the legend calls a statement of the text."""
    return Patch(**_STATEMENT, label="stated in the text")


def key(label: str, **line: Any) -> Line2D:
    """An entry of the legend."""
    return Line2D([], [], label=label, **line)


def thousandths(axis: Axes, name: str) -> None:
    """Label an axis of harmonics in units of 10^-3, as the paper has it."""
    axis.set_ylabel(rf"${name}\ \ (10^{{-3}})$")
