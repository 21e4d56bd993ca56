"""Figures 2, 3, 5, 6 and 7: the mean friction."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from asperity.figures.paper.parts import (
    AMPLITUDE,
    APPLIED,
    DROP,
    draw_curve,
    key,
    mark_statement,
    say,
    shade_noise,
    statement_key,
)
from asperity.figures.style import (
    ELASTO_PLASTIC,
    FAST,
    GREY,
    RICE_RUINA,
    SLOW,
    STATED,
    new_figure,
)
from asperity.study.paper import FigureNumbers, stated

#: Degrees that a line is tilted in figure 3 as printed, for a slope of 1 in ln V.
_TILT = 1180.0

_SPEEDS = (("1 um/s", SLOW), ("10 um/s", FAST))


def draw_2(numbers: FigureNumbers) -> Figure:
    """Change of the mean against eps."""
    figure, seen = new_figure(), stated()
    axis = figure.subplots()
    shade_noise(axis, seen)
    for name, dashes in _SPEEDS:
        rows = numbers.curve(name)
        draw_curve(axis, rows, APPLIED, "delta_mu", color=ELASTO_PLASTIC, linestyle=dashes)
    layer = numbers.curve("air layer")
    draw_curve(axis, layer, APPLIED, "delta_mu", color=GREY, linestyle="dotted")
    axis.set(xlim=(0, 0.53), ylim=(-0.124, 0.004), xlabel=AMPLITUDE, ylabel=DROP)
    mark_statement(axis, seen.epsilon, seen.drop)
    say(axis, "within the noise", (seen.onset / 2, -0.116), ha="center", va="bottom", rotation=90)
    say(axis, "a drop of 20 %", (0.505, -0.1035), ha="right", va="top")
    share = numbers.scalars["transmission_air"]
    axis.legend(
        handles=[
            key(r"1 µm/s,  $\epsilon_{\mathrm{eff}}=\epsilon/2.1$", color=ELASTO_PLASTIC),
            key(
                r"10 µm/s,  $\epsilon_{\mathrm{eff}}=\epsilon/2.1$",
                color=ELASTO_PLASTIC,
                linestyle=FAST,
            ),
            key(
                rf"1 µm/s,  $\epsilon_{{\mathrm{{eff}}}}={share:.2f}\,\epsilon$ (air layer)",
                color=GREY,
                linestyle="dotted",
            ),
            statement_key(),
        ],
        loc="lower left",
        bbox_to_anchor=(0.1, 0.0),
    )
    return figure


def draw_3(numbers: FigureNumbers) -> Figure:
    """Mean against V."""
    figure = new_figure()
    axis = figure.subplots()
    dashes = ("solid", (0, (7, 1.5)), (0, (3.5, 1.5)), (0, (1, 1.2)))
    for name, dash in zip(numbers.data["curve"].unique(), dashes, strict=False):
        rows = numbers.curve(name)
        V = 1e6 * rows["V"]
        axis.plot(V, rows["mean_friction"], color=ELASTO_PLASTIC, linestyle=dash)
        eps = name.removeprefix("eps = ")
        slope = numbers.scalars[f"slope_{eps}"]
        axis.text(
            V.iloc[2],
            rows["mean_friction"].iloc[2] + 0.003,
            rf"$\epsilon={eps}$,  slope ${slope:.4f}$",
            rotation=_TILT * slope,
            rotation_mode="anchor",
            fontsize=10,
        )
    axis.set(
        xscale="log",
        ylim=(0.33, 0.56),
        xlabel="pulling velocity $V$ (µm/s)",
        ylabel=r"mean friction $\bar{\mu}$",
    )
    axis.set_xticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    say(axis, r"stated: the slope $\partial\bar{\mu}/\partial\ln V$ does not change", (0.12, 0.34))
    return figure


def draw_5(numbers: FigureNumbers) -> Figure:
    """Change of the mean in air and in vacuum."""
    figure, seen = new_figure(5.0, 3.8), stated()
    axis = figure.subplots()
    vacuum, air = numbers.curve("1 mbar"), numbers.curve("1 atm")
    axis.plot(
        air[APPLIED] / seen.divisor_vacuum,
        air["delta_mu"],
        color="#9AD9C3",
        linewidth=6.0,
        zorder=1,
    )
    draw_curve(axis, vacuum, APPLIED, "delta_mu", color=ELASTO_PLASTIC)
    draw_curve(axis, air, APPLIED, "delta_mu", color=ELASTO_PLASTIC, linestyle=FAST)
    thin: dict[str, Any] = {"color": GREY, "linewidth": 1.2}
    layer = numbers.curve("1 mbar, air layer"), numbers.curve("1 atm, air layer")
    draw_curve(axis, layer[0], APPLIED, "delta_mu", **thin)
    draw_curve(axis, layer[1], APPLIED, "delta_mu", linestyle=FAST, **thin)
    axis.set(xlim=(0, 0.5), ylim=(-0.27, 0.008), xlabel=AMPLITUDE, ylabel=DROP)
    told = numbers.scalars
    effective = r"\epsilon_{\mathrm{eff}}"
    axis.legend(
        handles=[
            key(rf"1 mbar,  ${effective}=\epsilon$", color=ELASTO_PLASTIC),
            key(rf"1 atm,  ${effective}=\epsilon/2.5$", color=ELASTO_PLASTIC, linestyle=FAST),
            key(r"1 atm, against $\epsilon/2.5$", color="#9AD9C3", linewidth=6.0),
            key(rf"1 mbar,  ${told['transmission_vacuum']:.2f}\,\epsilon$ (appendix)", **thin),
            key(
                rf"1 atm,  ${told['transmission_air']:.2f}\,\epsilon$ (appendix)",
                linestyle=FAST,
                **thin,
            ),
        ],
        loc="lower left",
    )
    return figure


def draw_6(numbers: FigureNumbers) -> Figure:
    """Rice-Ruina against eps."""
    figure, seen = new_figure(), stated()
    axis = figure.subplots()
    for name, dashes in _SPEEDS:
        rows = numbers.curve(name)
        draw_curve(axis, rows, APPLIED, "delta_mu", color=RICE_RUINA, linestyle=dashes)
    axis.set(xlim=(0, 0.53), ylim=(-0.257, 0.008), xlabel=AMPLITUDE, ylabel=DROP)
    mark_statement(axis, seen.epsilon, seen.drop)
    say(axis, "a drop of 20 %", (0.515, -0.091), ha="right", va="bottom")
    axis.legend(
        handles=[
            key("Rice–Ruina, 1 µm/s", color=RICE_RUINA),
            key("Rice–Ruina, 10 µm/s", color=RICE_RUINA, linestyle=FAST),
            statement_key(),
        ],
        loc="lower left",
    )
    return figure


def draw_7(numbers: FigureNumbers) -> Figure:
    """Where the stated scaling puts the stated drop."""
    figure, seen = new_figure(), stated()
    axis = figure.subplots()
    draw_curve(axis, numbers.curve("1 um/s"), APPLIED, "delta_mu", color=RICE_RUINA)
    axis.set(
        xlim=(0, 0.53),
        ylim=(-0.257, 0.008),
        xlabel=r"$\epsilon$  or  $\epsilon_{\mathrm{eff}}$",
        ylabel=DROP,
    )
    mark_statement(axis, seen.epsilon, seen.drop)
    mark_statement(axis, seen.epsilon_eff, seen.drop)
    middle = sum(seen.drop) / 2
    axis.annotate(
        "",
        xy=(seen.epsilon_eff + 0.025, middle),
        xytext=(seen.epsilon - 0.025, middle),
        arrowprops={"arrowstyle": "-|>", "color": STATED, "linewidth": 1.2},
    )
    say(axis, r"$\epsilon \to \epsilon/2.1$", (0.369, middle + 0.005), ha="center", va="bottom")
    say(axis, "a drop of 20 %", (0.515, -0.103), ha="right", va="top")
    axis.legend(
        handles=[key("Rice–Ruina, 1 µm/s", color=RICE_RUINA), statement_key()], loc="lower left"
    )
    return figure
