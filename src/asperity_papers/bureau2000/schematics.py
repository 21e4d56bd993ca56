"""Figures 1 and 10: the set-up and the rheological element, drawn from the text's description."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Point = tuple[float, float]

INK, STEEL, GLASS, COIL, AIR = "#222222", "#D9DEE3", "#DCEBF5", "#0072B2", "#F6F7F8"


def canvas(width: float, height: float, size: Point) -> tuple[Figure, Axes]:
    """A figure (inches) whose one axis runs from 0 to `size` in equal units, without frame."""
    from asperity.figures import new_figure

    figure = new_figure(width, height)
    axis = figure.subplots()
    axis.set(xlim=(0, size[0]), ylim=(0, size[1]), aspect="equal")
    axis.set_axis_off()
    return figure, axis


def block(axis: Axes, corner: Point, size: Point, text: str = "", **look: Any) -> None:
    """A solid part, with its name inside."""
    chosen: dict[str, Any] = {"facecolor": STEEL, "edgecolor": INK, "linewidth": 1.0} | look
    from matplotlib.patches import FancyBboxPatch

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
    """Something that does not move: hatched below its edge."""
    from matplotlib.patches import Rectangle

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


def draw_1() -> Figure:
    """The tribometer, with the spring-slider system as an inset."""
    figure, axis = canvas(5.6, 4.5, (11.2, 9.0))
    ground(axis, (0.5, 0.2), (10.4, 0.35))
    line(axis, (0.5, 0.55), (10.9, 0.55))
    block(axis, (0.5, 0.57), (6.2, 0.75), facecolor=GLASS)
    axis.text(0.75, 0.92, "track (PMMA)", va="center", fontsize=9.5)
    block(axis, (2.3, 1.36), (3.4, 1.0), "slider (PMMA)", facecolor=GLASS)
    _exciter(axis)
    _weighting(axis)
    _drive(axis)
    _inset(axis)
    return figure


def _exciter(axis: Axes) -> None:
    """Exciter fixed to the slider; its moving element carries the accelerometer."""
    block(axis, (2.65, 2.36), (1.35, 1.15), "Vb")
    line(axis, (3.325, 3.51), (3.325, 3.85), linewidth=2.4)
    block(axis, (2.85, 3.85), (0.95, 0.3))
    block(axis, (3.1, 4.15), (0.45, 0.3), facecolor="#E9C46A")
    arrow(axis, (2.5, 3.65), (2.5, 4.45), style="<|-|>")
    label(axis, "Acc", (1.75, 4.85), (3.1, 4.32))


def _weighting(axis: Axes) -> None:
    """The vertical spring, hung from a point that moves along at V."""
    line(axis, (4.95, 2.36), (4.95, 2.75), linewidth=1.6)
    spring(axis, (4.95, 2.7), (4.95, 5.35), turns=7, width=0.5)
    label(axis, "Spr", (5.75, 4.1))
    block(axis, (4.25, 5.35), (1.4, 0.4))
    line(axis, (3.75, 5.78), (6.15, 5.78), linewidth=2.0)
    arrow(axis, (5.85, 5.55), (6.75, 5.55))
    label(axis, "$V$", (7.05, 5.55))


def _drive(axis: Axes) -> None:
    """Stage, leaf spring and the gauge that reads its deflection."""
    block(axis, (8.1, 0.57), (2.5, 1.74), "Drv")
    block(axis, (8.1, 2.31), (0.7, 2.2))
    line(axis, (7.35, 4.4), (8.1, 4.4), linewidth=3.0)
    down = np.linspace(0, 1, 30)
    bent = 7.42 - 0.32 * (3 * down**2 - 2 * down**3)  # clamped at both ends
    axis.plot(bent, 4.4 - 2.54 * down, color=COIL, linewidth=2.6)
    line(axis, (5.7, 1.86), (7.1, 1.86), linewidth=1.6)
    label(axis, "Lsp", (6.65, 3.65), (7.3, 3.25))
    block(axis, (7.5, 2.55), (0.6, 0.32), facecolor="#E9C46A")
    label(axis, "Gg", (7.75, 3.4), (7.8, 2.87))
    arrow(axis, (9.0, 2.75), (10.2, 2.75))
    label(axis, "$V$", (10.5, 2.75))


def _inset(axis: Axes) -> None:
    """The spring-slider system with its control parameters."""
    from matplotlib.patches import Rectangle

    x, y = 0.4, 6.35
    axis.add_patch(Rectangle((x, y), 10.4, 2.45, facecolor=AIR, edgecolor="#9AA3AB", linewidth=0.8))
    ground(axis, (x + 0.7, y + 0.3), (9.0, 0.2))
    line(axis, (x + 0.7, y + 0.5), (x + 9.7, y + 0.5))
    block(axis, (x + 2.3, y + 0.52), (1.8, 0.85), "$M$", facecolor=GLASS)
    arrow(axis, (x + 3.2, y + 2.2), (x + 3.2, y + 1.45))
    label(axis, r"$W = W_0\,(1+\epsilon\,\cos\omega t)$", (x + 3.4, y + 1.9), ha="left", bbox=None)
    spring(axis, (x + 4.1, y + 0.95), (x + 7.7, y + 0.95), turns=8, width=0.4)
    label(axis, "$K$", (x + 5.9, y + 1.42), bbox=None)
    line(axis, (x + 7.7, y + 0.7), (x + 7.7, y + 1.2), linewidth=2.0)
    arrow(axis, (x + 7.7, y + 0.95), (x + 9.0, y + 0.95))
    label(axis, "$V$", (x + 9.35, y + 0.95), bbox=None)


def draw_10() -> Figure:
    """Asperities as a spring in series with the frictional joint."""
    figure, axis = canvas(5.6, 2.7, (11.2, 5.4))
    ground(axis, (0.35, 1.1), (0.4, 2.6))
    line(axis, (0.75, 1.1), (0.75, 3.7))
    line(axis, (0.75, 2.0), (3.8, 2.0), linewidth=1.6)
    _joint(axis, (1.7, 2.0))
    line(axis, (4.2, 2.4), (4.6, 2.4), linewidth=1.6)
    spring(axis, (4.6, 2.4), (8.2, 2.4), turns=7, width=0.55)
    block(axis, (8.2, 1.6), (1.5, 1.6), "slider", facecolor=GLASS)
    arrow(axis, (9.7, 2.4), (10.8, 2.4))
    label(axis, "$F$", (10.3, 2.85))
    arrow(axis, (8.95, 4.35), (8.95, 3.3))
    label(axis, "$W(t)$", (8.95, 4.65))
    label(axis, r"$\kappa_{\mathrm{asp}} = W/\lambda$", (6.4, 3.25))
    label(axis, r"$f(\dot{x}_{\mathrm{pl}})$", (2.75, 3.25))
    for left, right, name in ((0.75, 4.4, "pl"), (4.4, 8.2, "el")):
        arrow(axis, (left, 0.75), (right, 0.75), style="<|-|>", linewidth=0.9)
        label(axis, rf"$x_{{\mathrm{{{name}}}}}$", ((left + right) / 2, 0.75))
        line(axis, (right, 0.55), (right, 1.45), linewidth=0.6, color="#999999")
    axis.text(2.75, 0.15, "frictional joint", ha="center", fontsize=9.5, color="#555555")
    axis.text(6.3, 0.15, "elastic asperities", ha="center", fontsize=9.5, color="#555555")
    return figure


def _joint(axis: Axes, corner: tuple[float, float]) -> None:
    """Two plates that rub: the element whose force depends on the sliding rate."""
    from matplotlib.patches import Rectangle

    x, y = corner
    axis.add_patch(Rectangle((x, y), 2.1, 0.34, facecolor=STEEL, edgecolor=INK, hatch="......"))
    axis.add_patch(Rectangle((x + 0.45, y + 0.34), 2.05, 0.2, facecolor=GLASS, edgecolor=INK))
