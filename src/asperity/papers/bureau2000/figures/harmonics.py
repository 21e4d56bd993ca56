"""Figures 4, 8, 9 and 11: the harmonics of the force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.figures.style import (
    ELASTO_PLASTIC,
    FAST,
    GREY,
    LINKER_DIETERICH,
    LINKER_DIETERICH_LOW,
    RICE_RUINA,
    SLOW,
    STATED_FILL,
)
from asperity.papers.bureau2000.figures.elements import (
    AMPLITUDE,
    APPLIED,
    BORNE,
    DROP,
    EFFECTIVE,
    INERTIAL,
    SPEEDS,
    band_key,
    draw_band,
    draw_both_speeds,
    draw_curve,
    draw_inertial,
    drops_key,
    inertia_key,
    key,
    mark_drops,
    mark_statement,
    remark,
    speed_keys,
    stacked,
    statement_key,
    thousandths,
)
from asperity.papers.bureau2000.numbers import FigureNumbers, stated
from asperity.papers.bureau2000.numbers.bands import LENGTH, RATE_AND_STATE
from asperity.papers.bureau2000.numbers.mean import inertial_name

_HARMONICS = ((r"\mu_1", "mu1"), (r"\mu_2", "mu2"))
_SMALL = 1e3


def draw_4(numbers: FigureNumbers) -> Figure:
    """First and second harmonic against eps, and their ratio."""
    figure, axes = stacked(3, 8.0, "lll")
    seen, every = stated(), (*RATE_AND_STATE, *LENGTH)
    for axis, (symbol, column) in zip(axes, _HARMONICS, strict=False):
        draw_band(axis, numbers, column, every, scale=_SMALL)
        draw_inertial(axis, numbers, APPLIED, column, _SMALL)
        draw_both_speeds(axis, numbers, APPLIED, column, _SMALL, color=ELASTO_PLASTIC)
        thousandths(axis, symbol)
    for name, _, dashes in SPEEDS:
        for curve, line in ((name, {"color": ELASTO_PLASTIC}), (inertial_name(name), INERTIAL)):
            rows = numbers.curve(curve)
            rows = rows[rows[APPLIED] > 0]
            ratio = rows["mu2"] / rows["mu1"]
            axes[2].plot(rows[APPLIED], ratio, linestyle=dashes, **line)
    axes[2].axhspan(*seen.ratio, facecolor=STATED_FILL, alpha=0.45, linewidth=0)
    remark(axes[2], "typically 0.1 to 0.2", (0.34, 0.125), va="center")
    axes[0].set(xlim=(0, 0.53), ylim=(0, 3.4))
    mark_statement(axes[0], seen.epsilon, seen.mu1, _SMALL)
    remark(axes[0], r"of order $10^{-3}$", (0.475, 3.0), ha="right", va="center")
    axes[1].set(ylim=(0, 0.72))
    axes[2].set(ylim=(0, 0.33), xlabel=AMPLITUDE, ylabel=r"$\mu_2/\mu_1$")
    axes[1].legend(
        handles=[
            *speed_keys("elasto-plastic", ELASTO_PLASTIC),
            band_key("$A$, $B$, $\\lambda$ uncertain, 1 µm/s", every),
            inertia_key(),
            statement_key(),
        ],
        loc="upper left",
        bbox_to_anchor=(0.06, 1.0),
        labelspacing=0.3,
    )
    return figure


def draw_8(numbers: FigureNumbers) -> Figure:
    """Rice-Ruina harmonics, the limits they saturate at, and what the text states."""
    figure, axes = stacked(2, 6.0, "ll")
    _logarithmic_harmonics(axes)
    read = numbers.scalars
    for axis, (_, column), order in zip(axes, _HARMONICS, (1, 2), strict=True):
        for limit, dashes in ((read["limit_slow"], SLOW), (read["limit_fast"], FAST)):
            axis.axhline(limit / order, color=GREY, linewidth=0.8, linestyle=dashes)
        draw_both_speeds(axis, numbers, BORNE, column, color=RICE_RUINA)
    axes[0].set(xlim=(0, 0.3))
    _mark_orders(axes)
    axes[1].set_xlabel(EFFECTIVE)
    axes[1].legend(
        handles=[
            *speed_keys("Rice–Ruina", RICE_RUINA),
            key("limit of one short pulse a period", color=GREY, linewidth=0.8),
            statement_key(),
        ],
        loc="lower center",
        bbox_to_anchor=(0.5, 0.0),
        labelspacing=0.3,
    )
    return figure


def draw_9(numbers: FigureNumbers) -> Figure:
    """Linker-Dieterich: mean and harmonics."""
    figure, axes = stacked(3, 8.6, "rll")
    _logarithmic_harmonics(axes[1:])
    high = {"color": LINKER_DIETERICH}
    low = {"color": LINKER_DIETERICH_LOW}
    law = r"Linker–Dieterich, $\alpha$ = "
    lines: Sequence[tuple[str, Mapping[str, Any], str]] = (
        ("RR, 1 um/s", {"color": RICE_RUINA, "linewidth": 0.8}, "Rice–Ruina, both velocities"),
        ("RR, 10 um/s", {"color": RICE_RUINA, "linewidth": 0.8}, ""),
        ("alpha = 0.02, 1 um/s", {"color": "#AAAAAA"}, f"{law}0.02, 1 µm/s"),
        ("alpha = 0.02, 10 um/s", low, f"{law}0.02, 10 µm/s"),
        ("alpha = 0.2, 10 um/s", high | {"linestyle": FAST}, f"{law}0.2, 10 µm/s"),
        (
            "alpha = 0.2, 1 um/s",
            high | {"linestyle": "dotted", "linewidth": 2.2},
            f"{law}0.2, 1 µm/s",
        ),
    )
    for name, line, _ in lines:
        for axis, (_, column) in zip(axes, _mean_first(), strict=True):
            draw_curve(axis, numbers.curve(name), BORNE, column, **line)
    handles = [key(label, **line) for _, line, label in reversed(lines) if label]
    _finish_mean(axes[0], handles)
    _mark_orders(axes[1:])
    axes[2].set_xlabel(EFFECTIVE)
    axes[2].legend(
        handles=[statement_key("stated: order $10^{-3}$; $\\mu_2$ 0.1 to 0.2 of it")],
        loc="lower right",
    )
    return figure


def draw_11(numbers: FigureNumbers) -> Figure:
    """Elasto-plastic: mean and harmonics, what the uncertainties make of them, and inertia."""
    figure, axes = stacked(3, 8.6, "rll")
    for axis, (_, column), scale in zip(axes, _mean_first(), (1, _SMALL, _SMALL), strict=True):
        for parameters in (LENGTH, RATE_AND_STATE):
            draw_band(axis, numbers, column, parameters, x=BORNE, scale=scale)
        draw_inertial(axis, numbers, BORNE, column, scale)
        draw_both_speeds(axis, numbers, BORNE, column, scale, color=ELASTO_PLASTIC)
    slow = numbers.curve("1 um/s")
    plateau = numbers.scalars["elastic_slope"]
    axes[1].plot(slow[BORNE], _SMALL * plateau * slow[BORNE], color=GREY, linestyle="dotted")
    _finish_mean(
        axes[0], [*speed_keys("elasto-plastic", ELASTO_PLASTIC), inertia_key()], lowest=-0.17
    )
    for axis, (symbol, _) in zip(axes[1:], _HARMONICS, strict=True):
        thousandths(axis, symbol)
    mark_statement(axes[1], stated().epsilon_eff, stated().mu1, _SMALL)
    remark(axes[1], r"of order $10^{-3}$", (stated().epsilon_eff - 0.014, 0.42), ha="right")
    axes[1].set(ylim=(0, 3.4))
    axes[1].legend(
        handles=[key("elastic asperities alone", color=GREY, linestyle="dotted"), statement_key()],
        loc="upper left",
        bbox_to_anchor=(0.06, 1.0),
    )
    axes[2].set(ylim=(0, 0.86), xlabel=EFFECTIVE)
    axes[2].legend(
        handles=[
            band_key(r"$\lambda=0.62\pm0.15$ µm, 1 µm/s", LENGTH),
            band_key(r"$A=0.013\pm0.005$, $B=0.026\pm0.01$, 1 µm/s", RATE_AND_STATE),
        ],
        loc="upper left",
        bbox_to_anchor=(0.06, 1.0),
    )
    return figure


def _mean_first() -> tuple[tuple[str, str], ...]:
    return ((DROP, "delta_mu"), *_HARMONICS)


def _logarithmic_harmonics(axes: Sequence[Axes]) -> None:
    """Axes of mu1 and mu2 on which the curves of neither velocity lie flat."""
    limits = ((3e-6, 7e-3), (2e-7, 1.5e-3))
    for axis, (symbol, _), ends in zip(axes, _HARMONICS, limits, strict=True):
        axis.set(yscale="log", ylim=ends, ylabel=f"${symbol}$")


def _mark_orders(axes: Sequence[Axes]) -> None:
    """mu1 "of order 1e-3", and mu2 as 0.1 to 0.2 of it; the limits must be set before."""
    seen = stated()
    for axis, ends in zip(axes, (seen.mu1, seen.mu2), strict=True):
        mark_statement(axis, seen.epsilon_eff, ends)
    left = seen.epsilon_eff - 0.014
    remark(axes[0], r"of order $10^{-3}$", (left, 1.7e-3), ha="right", va="center")
    remark(axes[1], r"0.1 to 0.2 of $\mu_1$", (left, 6.5e-4), ha="right", va="center")


def _finish_mean(axis: Axes, handles: list[Any], lowest: float = -0.185) -> None:
    """Axis of the mean against eps_eff, with the stated drop."""
    seen = stated()
    axis.set(xlim=(0, 0.3), ylim=(lowest, 0.012), ylabel=DROP)
    mark_drops(axis, seen.epsilon_eff, seen.drops)
    axis.legend(handles=[*handles, drops_key()], loc="lower left", labelspacing=0.3)
