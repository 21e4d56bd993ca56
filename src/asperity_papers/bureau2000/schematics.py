"""Figures 1 and 10: the set-up and the rheological element, as schematics.toml describes them."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from functools import partial
from importlib.resources import files
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Rectangle

from asperity.figures import new_figure

Point = tuple[float, float]

_INK, _COIL = "#222222", "#0072B2"


def draw(name: str) -> Figure:
    """A figure whose one axis has equal units and no frame."""
    text = files(__package__).joinpath("schematics.toml").read_text(encoding="utf-8")
    described = tomllib.loads(text)[name]
    figure = new_figure(*described["size"])
    axis = figure.subplots()
    width, height = described["extent"]
    axis.set(xlim=(0, width), ylim=(0, height), aspect="equal")
    axis.set_axis_off()
    for item in described["draw"]:
        _PARTS[item.pop("part")](axis, **item)
    return figure


def _block(axis: Axes, corner: Point, size: Point, text: str = "", **look: Any) -> None:
    """A solid part, with its name inside."""
    chosen: dict[str, Any] = {"facecolor": "#D9DEE3", "edgecolor": _INK, "linewidth": 1.0} | look
    round_box = f"round,pad=0,rounding_size={0.06 * min(size)}"
    axis.add_patch(FancyBboxPatch(corner, *size, boxstyle=round_box, **chosen))
    if text:
        middle = corner[0] + size[0] / 2, corner[1] + size[1] / 2
        axis.text(*middle, text, ha="center", va="center")


def _plate(axis: Axes, corner: Point, size: Point, **look: Any) -> None:
    """A rectangle."""
    axis.add_patch(Rectangle(corner, *size, **({"edgecolor": _INK} | look)))


def _spring(axis: Axes, start: Point, end: Point, turns: int, width: float) -> None:
    """A zigzag between two points, straight over the first and last sixth."""
    a, b = np.array(start), np.array(end)
    along = b - a
    across = np.array([-along[1], along[0]]) / np.hypot(*along) * width / 2
    at = np.concatenate([[0], np.linspace(1 / 6, 5 / 6, 2 * turns + 1), [1]])
    side = np.concatenate([[0, 0], np.resize([1, -1], 2 * turns - 1), [0, 0]])
    path = a + at[:, None] * along + side[:, None] * across
    axis.plot(*path.T, color=_COIL, linewidth=1.5, solid_joinstyle="round")


def _leaf(axis: Axes, start: Point, end: Point) -> None:
    """A leaf spring, clamped at both ends."""
    along = np.linspace(0, 1, 30)
    bent = start[0] + (end[0] - start[0]) * (3 * along**2 - 2 * along**3)
    axis.plot(bent, start[1] + (end[1] - start[1]) * along, color=_COIL, linewidth=2.6)


def _line(axis: Axes, points: list[Point], **look: Any) -> None:
    """A broken line through the points."""
    chosen: dict[str, Any] = {"color": _INK, "linewidth": 1.1} | look
    axis.plot(*np.array(points).T, **chosen)


def _arrow(axis: Axes, start: Point, end: Point, **look: Any) -> None:
    """An arrow from start to end."""
    chosen = {"arrowstyle": "-|>", "color": _INK, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", xy=end, xytext=start, arrowprops=chosen | look)


def _label(
    axis: Axes, at: Point, text: str, to: Point | None = None, ha: str = "center", box: bool = True
) -> None:
    """A name, with a thin leader to the part if that lies elsewhere."""
    if to is not None:
        axis.plot([at[0], to[0]], [at[1], to[1]], color="#777777", linewidth=0.7, zorder=1)
    white = {"facecolor": "white", "edgecolor": "none", "pad": 1.2} if box else None
    axis.text(*at, text, ha=ha, va="center", bbox=white)


_PARTS: Mapping[str, Callable[..., None]] = {
    "block": _block,
    "plate": _plate,
    # Something that does not move: hatched below its edge.
    "ground": partial(_plate, facecolor="white", hatch="//////", linewidth=0),
    "spring": _spring,
    "leaf": _leaf,
    "line": _line,
    "arrow": _arrow,
    "label": _label,
    # Words without a box.
    "text": lambda axis, at, text, **look: axis.text(*at, text, **look),
}
