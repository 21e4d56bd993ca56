"""What the schematics are drawn with: blocks, springs, ground and arrows."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Rectangle

from asperity.figures.style import new_figure

Point = tuple[float, float]

INK, STEEL, GLASS, COIL, AIR = "#222222", "#D9DEE3", "#DCEBF5", "#0072B2", "#F6F7F8"


def canvas(width: float, height: float, size: Point) -> tuple[Figure, Axes]:
    """A figure (inches) whose one axis runs from 0 to `size` in equal units, without frame."""
    figure = new_figure(width, height)
    axis = figure.subplots()
    axis.set(xlim=(0, size[0]), ylim=(0, size[1]), aspect="equal")
    axis.set_axis_off()
    return figure, axis


def block(axis: Axes, corner: Point, size: Point, text: str = "", **look: Any) -> None:
    """A solid part, with its name inside."""
    chosen: dict[str, Any] = {"facecolor": STEEL, "edgecolor": INK, "linewidth": 1.0} | look
    round_box = f"round,pad=0,rounding_size={0.06 * min(size)}"
    axis.add_patch(FancyBboxPatch(corner, *size, boxstyle=round_box, **chosen))
    if text:
        middle = corner[0] + size[0] / 2, corner[1] + size[1] / 2
        axis.text(*middle, text, ha="center", va="center")


def spring(axis: Axes, start: Point, end: Point, *, turns: int = 6, width: float = 0.22) -> None:
    """A zigzag between two points, straight over the first and last sixth."""
    a, b = np.array(start), np.array(end)
    along = b - a
    across = np.array([-along[1], along[0]]) / np.hypot(*along) * width / 2
    at = np.concatenate([[0], np.linspace(1 / 6, 5 / 6, 2 * turns + 1), [1]])
    side = np.concatenate([[0, 0], np.resize([1, -1], 2 * turns - 1), [0, 0]])
    path = a + at[:, None] * along + side[:, None] * across
    axis.plot(*path.T, color=COIL, linewidth=1.5, solid_joinstyle="round")


def ground(axis: Axes, corner: Point, size: Point) -> None:
    """Something that does not move: hatched below (or beside) its edge."""
    axis.add_patch(
        Rectangle(corner, *size, facecolor="white", edgecolor=INK, hatch="//////", linewidth=0)
    )


def line(axis: Axes, *points: Point, **look: Any) -> None:
    """A broken line through the points."""
    chosen: dict[str, Any] = {"color": INK, "linewidth": 1.1} | look
    axis.plot(*np.array(points).T, **chosen)


def arrow(axis: Axes, start: Point, end: Point, *, style: str = "-|>", **look: Any) -> None:
    """An arrow from start to end."""
    chosen = {"arrowstyle": style, "color": INK, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", xy=end, xytext=start, arrowprops=chosen | look)


def label(axis: Axes, text: str, at: Point, to: Point | None = None, **look: Any) -> None:
    """A name, with a thin leader to the part if that lies elsewhere."""
    if to is not None:
        axis.plot([at[0], to[0]], [at[1], to[1]], color="#777777", linewidth=0.7, zorder=1)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.2}
    axis.text(*at, text, **({"ha": "center", "va": "center", "bbox": box} | look))
