"""Draws docs/theory/stabilisation.png: python docs/theory/draw_stabilisation.py (two minutes)."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from cmcrameri import cm
from matplotlib.lines import Line2D

import asperity as asp
from asperity.figures import COLOURS, draw_plane, new_figure
from asperity.figures.style import style
from asperity.study.map import Axis
from asperity.study.threshold import natural_scales

PMMA = asp.materials.load("bureau2000")
VELOCITY = 1e-6


class Case(NamedTuple):
    """A model of the slider."""

    law: str
    inertia: bool = False

    @property
    def name(self):
        """What tables call it."""
        return f"{self.law}, inertia" if self.inertia else self.law


#: Rigid and elastic asperities, without and with the slider's mass.
LAWS = ("rice-ruina", "elasto-plastic")
CASES = [Case(law, inertia) for inertia in (False, True) for law in LAWS]
#: Amplitudes of the cut over the frequency.
LEVELS = (0.05, 0.1, 0.2)


def slider(law):
    """The slider of the paper with a law."""
    return asp.Slider(PMMA.law(law), spring=PMMA.K, load=PMMA.W0, mass=PMMA.M)


def threshold(cut, case, epsilon, frequency):
    """Critical stiffness of the modulated slider, a row for each operating point."""
    solved = asp.stiffness_threshold(
        slider(case.law), epsilon=epsilon, frequency=frequency, velocity=VELOCITY,
        inertia=case.inertia,
    )  # fmt: skip
    eps, f = np.broadcast_arrays(epsilon, frequency)
    columns = {"cut": cut, "case": case.name, "epsilon": eps, "frequency": f}
    return pd.DataFrame(columns | {n: getattr(solved, n) for n in ("ratio", "kind")})


RIGID, ELASTIC = COLOURS["rice-ruina"], COLOURS["elasto-plastic"]
LOOKS = {
    "rice-ruina": ("rigid asperities", {"color": RIGID}),
    "elasto-plastic": ("elastic asperities", {"color": ELASTIC}),
    "rice-ruina, inertia": ("rigid, inertia", {"color": RIGID, "linestyle": "dashed"}),
    "elasto-plastic, inertia": ("elastic, inertia", {"color": ELASTIC, "linestyle": "dashed"}),
}
RATIO = r"critical stiffness $K^*/K_c$"


def draw(cuts, stick_slip_frequency, resonance):
    """Critical stiffness against amplitude and frequency, and the resonance of the asperities."""
    figure = new_figure(5.0, 9.6)
    amplitude, frequency, plane = figure.subplots(3, 1)
    draw_amplitudes(amplitude, cuts[cuts["cut"] == "amplitude"])
    draw_frequencies(frequency, cuts[cuts["cut"] == "frequency"], stick_slip_frequency)
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


def draw_amplitudes(axis, rows):
    """Critical stiffness against the amplitude."""
    for case, curve in rows.groupby("case", sort=False):
        label, line = LOOKS[str(case)]
        axis.plot(curve["epsilon"], curve["ratio"], label=label, **line)
    axis.axhline(1, color=COLOURS["grey"], linewidth=0.9)
    axis.set(
        xlabel=r"amplitude $\epsilon_{\mathrm{eff}}$",
        ylabel=RATIO,
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
        color=COLOURS["grey"],
    )


def draw_frequencies(axis, rows, f_c):
    """Critical stiffness against the frequency, its line by the kind of bifurcation."""
    levels = sorted(rows["epsilon"].unique())
    shades = cm.lipari_r(np.linspace(0.25, 0.85, len(levels)))
    for level, shade in zip(levels, shades, strict=True):
        curve = rows[rows["epsilon"] == level].sort_values("frequency")
        x, y = (curve["frequency"] / f_c).to_numpy(), curve["ratio"].to_numpy()
        kinds = curve["kind"].to_numpy(dtype=str)
        for k in range(len(x) - 1):
            # A stretch is drawn as the kind at both its ends, a change of kind as a thin step.
            same = kinds[k] == kinds[k + 1]
            axis.plot(x[k : k + 2], y[k : k + 2], color=shade, alpha=1.0 if same else 0.6,
                      linewidth=width(kinds[k] if same else ""))  # fmt: skip
    handles = [
        Line2D([], [], color=shade, label=rf"$\epsilon_{{\mathrm{{eff}}}}={level:g}$")
        for level, shade in zip(levels, shades, strict=True)
    ]
    handles += [
        Line2D([], [], color="#111111", linewidth=width(kind), label=name)
        for kind, name in (("period doubling", "period doubling"),
                           ("Neimark-Sacker", "Neimark–Sacker"))
    ]  # fmt: skip
    axis.axhline(1, color=COLOURS["grey"], linewidth=0.9, zorder=0)
    axis.axvline(2, color=COLOURS["grey"], linewidth=0.9, linestyle="dotted", zorder=0)
    axis.set(
        xscale="log",
        xlabel=r"frequency $f/f_c$",
        ylabel=RATIO,
        xlim=(rows["frequency"].min() / f_c, rows["frequency"].max() / f_c),
        ylim=(0.6, 2.4),
    )
    axis.legend(handles=handles, loc="upper right")


def width(kind):
    """Period doubling is the broad line: dashes would be shorter than the stretches."""
    return 2.8 if kind == "period doubling" else 1.3


elastic = slider("elasto-plastic")
Kc, f_c = natural_scales(slider("rice-ruina"), VELOCITY)
amplitudes = np.linspace(0.005, 0.3, 25)
frequencies = f_c * np.concatenate([np.geomspace(1.0, 4.2, 22), np.geomspace(5.0, 300.0, 9)])
tables = [threshold("amplitude", case, amplitudes, np.array(PMMA.frequency)) for case in CASES]
tables += [threshold("frequency", Case("elasto-plastic"), np.array(e), frequencies) for e in LEVELS]
numbers = {name: PMMA[name].si for name in ("mu0", "A", "B", "D0", "V0", "lambda", "W0", "M")}
plane = asp.map(
    "elasto-plastic", numbers | {"K": 2 * Kc, "V": VELOCITY, "inertia": 1.0},
    x=Axis("frequency", 600.0, 1100.0, 51), y=Axis("epsilon", 0.02, 0.3, 29),
)  # fmt: skip
with style():
    figure = draw(pd.concat(tables, ignore_index=True), f_c, plane)
    target = Path(__file__).with_name("stabilisation.png")
    figure.savefig(target, dpi=110, metadata={"Software": None})
