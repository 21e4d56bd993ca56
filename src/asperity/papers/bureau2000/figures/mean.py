"""Figures 2, 3, 5, 6 and 7: the mean friction."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from asperity.figures.style import (
    ELASTO_PLASTIC,
    FAST,
    GREY,
    RICE_RUINA,
    SLOW,
    STATED,
    new_figure,
)
from asperity.papers.bureau2000.figures.elements import (
    AMPLITUDE,
    APPLIED,
    DROP,
    INERTIAL,
    band_key,
    draw_band,
    draw_both_speeds,
    draw_curve,
    draw_inertial,
    drops_key,
    inertia_key,
    key,
    mark_drops,
    remark,
    shade_noise,
    speed_keys,
)
from asperity.papers.bureau2000.numbers import FigureNumbers, stated
from asperity.papers.bureau2000.numbers.bands import LENGTH, RATE_AND_STATE
from asperity.papers.bureau2000.numbers.mean import AIR, FULL_DISC, VACUUM, inertial_name

#: Degrees that a line is tilted in figure 3 as printed, for a slope of 1 in ln V.
_TILT = 1180.0
#: Dashes of the amplitudes in figure 3; each line is named as well.
_AMPLITUDE_DASHES = ("solid", (0, (9, 2.2)), (0, (7, 2, 1.2, 2)), (0, (0.8, 1.6)))


def draw_2(numbers: FigureNumbers) -> Figure:
    """Change of the mean against eps."""
    figure, seen = new_figure(5.0, 4.2), stated()
    axis = figure.subplots()
    shade_noise(axis, seen)
    every = (*RATE_AND_STATE, *LENGTH)
    draw_band(axis, numbers, "delta_mu", every)
    draw_inertial(axis, numbers, APPLIED, "delta_mu")
    draw_both_speeds(axis, numbers, APPLIED, "delta_mu", color=ELASTO_PLASTIC)
    dotted: dict[str, Any] = {"color": GREY, "linestyle": "dotted"}
    draw_curve(axis, numbers.curve("air layer"), APPLIED, "delta_mu", **dotted)
    axis.set(xlim=(0, 0.53), ylim=(-0.152, 0.004), xlabel=AMPLITUDE, ylabel=DROP)
    mark_drops(axis, seen.epsilon, seen.drops)
    remark(
        axis, "within the noise", (seen.onset / 2, -0.148), ha="center", va="bottom", rotation=90
    )
    share = numbers.scalars["transmission_air"]
    axis.legend(
        handles=[
            *speed_keys("elasto-plastic", ELASTO_PLASTIC),
            band_key("$A$, $B$, $\\lambda$ uncertain, 1 µm/s", every),
            inertia_key(),
            key(rf"1 µm/s, air layer of the appendix, ${share:.2f}\,\epsilon$", **dotted),
            drops_key(),
        ],
        title=rf"$\epsilon_{{\mathrm{{eff}}}}={seen.share:g}\,\epsilon$",
        alignment="left",
        loc="lower left",
        bbox_to_anchor=(0.1, 0.0),
        labelspacing=0.3,
    )
    return figure


def draw_3(numbers: FigureNumbers) -> Figure:
    """Mean against V."""
    figure = new_figure(5.0, 3.8)
    axis = figure.subplots()
    names = numbers.data["curve"].unique()
    for name, dash in zip(names, _AMPLITUDE_DASHES, strict=True):
        rows = numbers.curve(name)
        V = 1e6 * rows["V"]
        axis.plot(V, rows["mean_friction"], color=ELASTO_PLASTIC, linestyle=dash)
        eps = name.removeprefix("eps = ")
        slope = numbers.scalars[f"slope_{eps}"]
        # The strongest one has its name below: the stated slope lies above it.
        below = name == names[-1]
        axis.text(
            V.iloc[2],
            rows["mean_friction"].iloc[2] + (-0.004 if below else 0.003),
            rf"$\epsilon={eps}$,  slope ${slope:.4f}$",
            rotation=_TILT * slope,
            rotation_mode="anchor",
            va="top" if below else "bottom",
            fontsize=10,
        )
    # The slope without modulation, through the strongest modulation at 1 um/s.
    strongest = numbers.curve(names[-1])
    V, mean = 1e6 * strongest["V"].to_numpy(), strongest["mean_friction"].to_numpy()
    through = float(np.interp(0.0, np.log(V), mean))
    line: dict[str, Any] = {"color": STATED, "linewidth": 1.1}
    axis.plot(V, through + numbers.scalars["slope_0"] * np.log(V), **line)
    axis.set(
        xscale="log",
        ylim=(0.32, 0.56),
        xlabel="pulling velocity $V$ (µm/s)",
        ylabel=r"mean friction $\bar{\mu}$",
    )
    axis.set_xticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    axis.legend(
        handles=[
            key("elasto-plastic law", color=ELASTO_PLASTIC),
            key(r"stated: $\partial\bar{\mu}/\partial\ln V$ as without modulation", **line),
        ],
        loc="lower left",
    )
    return figure


def draw_5(numbers: FigureNumbers) -> Figure:
    """Change of the mean in air and in vacuum, without and with inertia."""
    figure, seen, read = new_figure(5.0, 4.8), stated(), numbers.scalars
    axis = figure.subplots()
    vacuum, air = numbers.curve(VACUUM), numbers.curve(AIR)
    broad: dict[str, Any] = {"color": "#9AD9C3", "linewidth": 6.0}
    axis.plot(seen.collapse * air[APPLIED], air["delta_mu"], zorder=1, **broad)
    draw_curve(axis, vacuum, APPLIED, "delta_mu", color=ELASTO_PLASTIC, linestyle=SLOW)
    draw_curve(axis, air, APPLIED, "delta_mu", color=ELASTO_PLASTIC, linestyle=FAST)
    for name, dashes in ((VACUUM, SLOW), (AIR, FAST)):
        rows = numbers.curve(inertial_name(name))
        draw_curve(axis, rows, APPLIED, "delta_mu", linestyle=dashes, **INERTIAL)
    grey: dict[str, Any] = {"color": GREY, "linestyle": "dotted"}
    draw_curve(axis, numbers.curve(FULL_DISC), APPLIED, "delta_mu", **grey)
    axis.set(xlim=(0, 0.5), ylim=(-0.56, 0.012), xlabel=AMPLITUDE, ylabel=DROP)
    in_vacuum, disc = read["transmission_vacuum"], read["transmission_air"]
    in_air = seen.collapse * in_vacuum
    axis.legend(
        handles=[
            key(rf"elasto-plastic, 1 mbar:  ${in_vacuum:.2f}\,\epsilon$", color=ELASTO_PLASTIC),
            key(
                rf"elasto-plastic, 1 atm:  ${in_air:.2f}\,\epsilon$",
                color=ELASTO_PLASTIC,
                linestyle=FAST,
            ),
            key(r"1 atm, against $\epsilon/2.5$", **broad),
            inertia_key("with inertia, 1 mbar"),
            key("with inertia, 1 atm", linestyle=FAST, **INERTIAL),
            key(rf"1 atm, full disc of the appendix:  ${disc:.2f}\,\epsilon$", **grey),
        ],
        loc="lower left",
        labelspacing=0.35,
    )
    return figure


def draw_6(numbers: FigureNumbers) -> Figure:
    """Rice-Ruina against eps."""
    figure, seen = new_figure(), stated()
    axis = figure.subplots()
    draw_both_speeds(axis, numbers, APPLIED, "delta_mu", color=RICE_RUINA)
    axis.set(xlim=(0, 0.53), ylim=(-0.257, 0.008), xlabel=AMPLITUDE, ylabel=DROP)
    mark_drops(axis, seen.epsilon, seen.drops)
    axis.legend(handles=[*speed_keys("Rice–Ruina", RICE_RUINA), drops_key()], loc="lower left")
    return figure


def draw_7(numbers: FigureNumbers) -> Figure:
    """Where the fitted share puts the stated drop."""
    figure, seen = new_figure(), stated()
    axis = figure.subplots()
    draw_curve(axis, numbers.curve("1 um/s"), APPLIED, "delta_mu", color=RICE_RUINA)
    axis.set(
        xlim=(0, 0.53),
        ylim=(-0.257, 0.008),
        xlabel=r"$\epsilon$  or  $\epsilon_{\mathrm{eff}}$",
        ylabel=DROP,
    )
    drop = seen.drops[0]
    for epsilon in (seen.epsilon, seen.epsilon_eff):
        mark_drops(axis, epsilon, (drop, drop))
    axis.annotate(
        "",
        xy=(seen.epsilon_eff + 0.022, drop),
        xytext=(seen.epsilon - 0.02, drop),
        arrowprops={"arrowstyle": "-|>", "color": STATED, "linewidth": 1.2},
    )
    remark(
        axis, rf"$\epsilon \to {seen.share:g}\,\epsilon$", (0.37, drop + 0.005), ha="center",
        va="bottom",
    )  # fmt: skip
    axis.legend(
        handles=[
            key("Rice–Ruina, 1 µm/s", color=RICE_RUINA),
            drops_key(r"stated: 20 % of $\bar{\mu}$ at 1 µm/s"),
        ],
        loc="lower left",
    )
    return figure
