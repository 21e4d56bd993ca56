"""Where modulation stabilises sliding, and where it does not: three cuts through the parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from asperity.figures.map import KIND_LINES, draw_plane
from asperity.figures.style import ELASTO_PLASTIC, GREY, RICE_RUINA, new_figure

if TYPE_CHECKING:
    import xarray

_CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "rice-ruina": ("rigid asperities", {"color": RICE_RUINA}),
    "elasto-plastic": ("elastic asperities", {"color": ELASTO_PLASTIC}),
    "rice-ruina, inertia": ("rigid, inertia", {"color": RICE_RUINA, "linestyle": "dashed"}),
    "elasto-plastic, inertia": ("elastic, inertia", {"color": ELASTO_PLASTIC,
                                                     "linestyle": "dashed"}),
}  # fmt: skip
_RATIO = r"critical stiffness $K^*/K_c$"


def draw_stabilisation(
    cuts: pd.DataFrame, stick_slip_frequency: float, resonance: xarray.Dataset
) -> Figure:
    """Critical stiffness against amplitude and frequency, and the resonance of the asperities.

    Parameters
    ----------
    cuts : DataFrame
        From `asperity.papers.bureau2000.stabilisation.stabilisation_diagram`.
    stick_slip_frequency : float
        f_c (Hz).
    resonance : Dataset
        From `asperity.papers.bureau2000.stabilisation.resonance_map`.
    """
    figure = new_figure(5.0, 9.6)
    amplitude, frequency, plane = figure.subplots(3, 1)
    _draw_amplitudes(amplitude, cuts[cuts["cut"] == "amplitude"])
    _draw_frequencies(frequency, cuts[cuts["cut"] == "frequency"], stick_slip_frequency)
    mesh = draw_plane(plane, resonance, "log_multiplier")
    bar = figure.colorbar(mesh, ax=plane, pad=0.02, aspect=20, extend="both")
    bar.set_label(r"$\ln|m|$")
    bar.ax.minorticks_off()
    plane.set_ylabel(r"amplitude $\epsilon_{\mathrm{eff}}$")
    for axis, letter in zip((amplitude, frequency, plane), "abc", strict=True):
        axis.set_title(f"({letter})", loc="left", fontsize=11)
    amplitude.set_title("120 Hz, far above stick-slip", fontsize=11)
    frequency.set_title("elastic asperities, no inertia", fontsize=11)
    plane.set_title(r"elastic asperities with inertia, $K=2K_c$", fontsize=11)
    return figure


def _draw_amplitudes(axis: Axes, rows: pd.DataFrame) -> None:
    for case, own in rows.groupby("case", sort=False):
        label, line = _CASES[str(case)]
        axis.plot(own["epsilon"], own["ratio"], label=label, **line)
    axis.axhline(1, color=GREY, linewidth=0.9)
    axis.set(
        xlabel=r"amplitude $\epsilon_{\mathrm{eff}}$",
        ylabel=_RATIO,
        xlim=(0, rows["epsilon"].max()),
        ylim=(0.55, 1.1),
    )
    axis.legend(loc="lower left")
    axis.text(
        0.97,
        0.97,
        "stable above the curves",
        transform=axis.transAxes,
        ha="right",
        va="top",
        color=GREY,
    )


def _draw_frequencies(axis: Axes, rows: pd.DataFrame, f_c: float) -> None:
    levels = sorted(rows["epsilon"].unique())
    shades = cm.lipari_r(np.linspace(0.25, 0.85, len(levels)))
    for level, shade in zip(levels, shades, strict=True):
        own = rows[rows["epsilon"] == level].sort_values("frequency")
        x, y = (own["frequency"] / f_c).to_numpy(), own["ratio"].to_numpy()
        kinds = own["kind"].to_numpy(dtype=str)
        for k in range(len(x) - 1):
            # A stretch is drawn as the kind at both its ends, a change of kind as a thin step.
            same = kinds[k] == kinds[k + 1]
            style = KIND_LINES.get(kinds[k], "solid") if same else (0, (0.6, 1.2))
            axis.plot(x[k : k + 2], y[k : k + 2], color=shade, linestyle="solid",
                      alpha=1.0 if same else 0.6, linewidth=_width(style))  # fmt: skip
    handles = [
        Line2D([], [], color=shade, label=rf"$\epsilon_{{\mathrm{{eff}}}}={level:g}$")
        for level, shade in zip(levels, shades, strict=True)
    ]
    handles += [
        Line2D([], [], color="#111111", linewidth=_width(KIND_LINES[kind]), label=name)
        for kind, name in (("period doubling", "period doubling"),
                           ("Neimark-Sacker", "Neimark–Sacker"))
    ]  # fmt: skip
    axis.axhline(1, color=GREY, linewidth=0.9, zorder=0)
    axis.axvline(2, color=GREY, linewidth=0.9, linestyle="dotted", zorder=0)
    axis.set(
        xscale="log",
        xlabel=r"frequency $f/f_c$",
        ylabel=_RATIO,
        xlim=(rows["frequency"].min() / f_c, rows["frequency"].max() / f_c),
        ylim=(0.6, 2.4),
    )
    axis.legend(handles=handles, loc="upper right")


def _width(style: Any) -> float:
    """Period doubling is the broad line: dashes would be shorter than the stretches."""
    return 2.8 if style == KIND_LINES["period doubling"] else 1.3
