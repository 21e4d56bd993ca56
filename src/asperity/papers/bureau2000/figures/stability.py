"""The leading Floquet multiplier against the amplitude of the modulation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.figures.style import (
    ELASTO_PLASTIC,
    GREY,
    LINKER_DIETERICH,
    LINKER_DIETERICH_LOW,
    RICE_RUINA,
)
from asperity.papers.bureau2000.figures.elements import BORNE, EFFECTIVE, key, stacked
from asperity.papers.bureau2000.numbers import FigureNumbers

_LAWS = (
    ("RR", "Rice–Ruina", {"color": RICE_RUINA, "linestyle": "solid"}),
    (
        "LD 0.2",
        r"Linker–Dieterich, $\alpha=0.2$",
        {"color": LINKER_DIETERICH, "linestyle": "dashed"},
    ),
    (
        "LD 0.02",
        r"Linker–Dieterich, $\alpha=0.02$",
        {"color": LINKER_DIETERICH_LOW, "linestyle": (0, (1, 1.4)), "linewidth": 2.4},
    ),
    ("EXT", "elasto-plastic", {"color": ELASTO_PLASTIC, "linestyle": (0, (7, 1.5, 1.5, 1.5))}),
)
_PANELS = (("1 um/s", "1 µm/s", (0.9984, 1.0018)), ("10 um/s", "10 µm/s", (0.984, 1.018)))


def draw_floquet(numbers: FigureNumbers) -> Figure:
    """One panel a velocity; dots on the axis are unmodulated sliding, triangles the thresholds."""
    figure, axes = stacked(2, 6.4, "ll")
    for axis, (speed, label, limits) in zip(axes, _PANELS, strict=True):
        axis.axhspan(1, limits[1], facecolor="#F3F3F3", linewidth=0, zorder=0)
        axis.axhline(1, color=GREY, linewidth=0.9)
        handles = []
        for law, name, line in _LAWS:
            at = numbers.scalars[f"threshold {law}, {speed}"]
            _draw_law(axis, numbers.curve(f"{law}, {speed}"), at, line)
            handles.append(key(f"{name}:  {at:.4f}", **line))
        axis.legend(
            handles=handles, title=r"stable above $\epsilon_{\mathrm{eff}}$ =", loc="upper right"
        )
        axis.ticklabel_format(axis="y", useOffset=False, style="plain")
        axis.set(xlim=(0, 0.3), ylim=limits, ylabel=r"leading multiplier $|m|$")
        axis.text(0.03, 0.07, f"$V$ = {label}", transform=axis.transAxes)
        for word, side in (("unstable", "bottom"), ("stable", "top")):
            axis.text(0.296, 1, word, va=side, ha="right", color=GREY, fontsize=9.5)
    axes[1].set_xlabel(EFFECTIVE)
    return figure


def _draw_law(axis: Axes, rows: pd.DataFrame, threshold: float, line: Mapping[str, Any]) -> None:
    axis.plot(rows[BORNE], rows["floquet_max"], **line)
    mark = {"color": line["color"], "zorder": 6, "markeredgecolor": "white", "markersize": 7}
    axis.plot([0], rows["floquet_max"].iloc[:1], "o", clip_on=False, **mark)
    axis.plot([threshold], [1], "v", **mark)
