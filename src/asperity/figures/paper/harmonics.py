"""Figures 4, 8, 9 and 11: the harmonics of the force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.figures.paper.parts import (
    AMPLITUDE,
    APPLIED,
    BORNE,
    DROP,
    EFFECTIVE,
    draw_curve,
    key,
    mark_statement,
    say,
    stacked,
    statement_key,
    thousandths,
)
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
from asperity.study.paper import FigureNumbers, stated

_SPEEDS = (("1 um/s", SLOW), ("10 um/s", FAST))
_HARMONICS = ((r"\mu_1", "mu1"), (r"\mu_2", "mu2"))
_SMALL = 1e3


def draw_4(numbers: FigureNumbers) -> Figure:
    """First and second harmonic against eps, and their ratio."""
    figure, axes = stacked(3, 7.4, "lll")
    seen = stated()
    for name, dashes in _SPEEDS:
        rows = numbers.curve(name)
        line: dict[str, Any] = {"color": ELASTO_PLASTIC, "linestyle": dashes}
        for axis, (_, column) in zip(axes, _HARMONICS, strict=False):
            draw_curve(axis, rows, APPLIED, column, _SMALL, **line)
        some = rows[rows[APPLIED] > 0]
        axes[2].plot(some[APPLIED], some["mu2"] / some["mu1"], **line)
    axes[2].axhspan(*seen.ratio, facecolor=STATED_FILL, alpha=0.45, linewidth=0)
    say(axes[2], "typically 0.1 to 0.2", (0.25, 0.155), va="center")
    for axis, (symbol, _) in zip(axes, _HARMONICS, strict=False):
        thousandths(axis, symbol)
    axes[0].set(xlim=(0, 0.53), ylim=(0, 3.4))
    mark_statement(axes[0], seen.epsilon, seen.mu1, _SMALL)
    say(axes[0], r"of order $10^{-3}$", (0.475, 3.0), ha="right", va="center")
    axes[1].set(ylim=(0, 0.46))
    axes[2].set(ylim=(0, 0.26), xlabel=AMPLITUDE, ylabel=r"$\mu_2/\mu_1$")
    _legend_of_speeds(axes[1], ELASTO_PLASTIC, extra=[statement_key()])
    return figure


def draw_8(numbers: FigureNumbers) -> Figure:
    """Rice-Ruina harmonics and the limits they saturate at."""
    figure, axes = stacked(2, 5.4, "ll")
    told = numbers.scalars
    for axis, (symbol, column), order in zip(axes, _HARMONICS, (1, 2), strict=True):
        for limit, dashes in ((told["limit_slow"], SLOW), (told["limit_fast"], FAST)):
            axis.axhline(_SMALL * limit / order, color=GREY, linewidth=0.8, linestyle=dashes)
        _both_speeds(axis, numbers, column, RICE_RUINA, _SMALL)
        thousandths(axis, symbol)
    axes[0].set(xlim=(0, 0.3), ylim=(0, 0.88))
    axes[1].set(ylim=(0, 0.44), xlabel=EFFECTIVE)
    axes[0].legend(
        handles=[
            key("Rice–Ruina, 1 µm/s", color=RICE_RUINA),
            key("Rice–Ruina, 10 µm/s", color=RICE_RUINA, linestyle=FAST),
            key(r"limit of one short pulse a period", color=GREY, linewidth=0.8),
        ],
        loc="center right",
        bbox_to_anchor=(1.0, 0.42),
    )
    return figure


def draw_9(numbers: FigureNumbers) -> Figure:
    """Linker-Dieterich: mean and harmonics."""
    figure, axes = stacked(3, 7.8, "rll")
    high = {"color": LINKER_DIETERICH}
    low = {"color": LINKER_DIETERICH_LOW}
    lines: Sequence[tuple[str, Mapping[str, Any], str]] = (
        ("RR, 1 um/s", {"color": RICE_RUINA, "linewidth": 0.8}, "Rice–Ruina, both velocities"),
        ("RR, 10 um/s", {"color": RICE_RUINA, "linewidth": 0.8}, ""),
        ("alpha = 0.02, 1 um/s", {"color": "#AAAAAA"}, r"$\alpha=0.02$, 1 µm/s"),
        ("alpha = 0.02, 10 um/s", low, r"$\alpha=0.02$, 10 µm/s"),
        ("alpha = 0.2, 10 um/s", high | {"linestyle": FAST}, r"$\alpha=0.2$, 10 µm/s"),
        (
            "alpha = 0.2, 1 um/s",
            high | {"linestyle": "dotted", "linewidth": 2.2},
            r"$\alpha=0.2$, 1 µm/s",
        ),
    )
    for name, line, _ in lines:
        for axis, (_, column), scale in zip(axes, _mean_first(), (1, _SMALL, _SMALL), strict=True):
            draw_curve(axis, numbers.curve(name), BORNE, column, scale, **line)
    handles = [key(label, **line) for _, line, label in reversed(lines) if label]
    _finish_mean(axes, handles)
    axes[1].set(ylim=(0, 0.95))
    axes[2].set(ylim=(0, 0.4))
    return figure


def draw_11(numbers: FigureNumbers) -> Figure:
    """Elasto-plastic: mean and harmonics."""
    figure, axes = stacked(3, 7.8, "rll")
    low, high = numbers.curve("lambda low"), numbers.curve("lambda high")
    for axis, (_, column) in zip(axes[1:], _HARMONICS, strict=True):
        axis.fill_between(
            low[BORNE],
            _SMALL * low[column],
            _SMALL * high[column],
            color=ELASTO_PLASTIC,
            alpha=0.18,
            linewidth=0,
        )
    slow = numbers.curve("1 um/s")
    plateau = numbers.scalars["elastic_slope"]
    axes[1].plot(slow[BORNE], _SMALL * plateau * slow[BORNE], color=GREY, linewidth=1.0)
    for axis, (_, column), scale in zip(axes, _mean_first(), (1, _SMALL, _SMALL), strict=True):
        _both_speeds(axis, numbers, column, ELASTO_PLASTIC, scale)
    _finish_mean(
        axes,
        [
            key("elasto-plastic, 1 µm/s", color=ELASTO_PLASTIC),
            key("elasto-plastic, 10 µm/s", color=ELASTO_PLASTIC, linestyle=FAST),
        ],
    )
    mark_statement(axes[1], stated().epsilon_eff, stated().mu1, _SMALL)
    say(axes[1], r"of order $10^{-3}$", (stated().epsilon_eff - 0.014, 0.5), ha="right")
    axes[1].text(0.212, 2.4, "elastic asperities alone", color=GREY, fontsize=9.5, ha="right")
    axes[1].set(ylim=(0, 3.4))
    axes[2].set(ylim=(0, 0.62))
    axes[2].legend(
        handles=[key(r"$\lambda=0.62\pm0.15$ µm, 1 µm/s", color="#CFE6DF", linewidth=7.0)],
        loc="upper left",
        bbox_to_anchor=(0.06, 1.0),
    )
    return figure


def _mean_first() -> tuple[tuple[str, str], ...]:
    return ((DROP, "delta_mu"), *_HARMONICS)


def _both_speeds(
    axis: Axes, numbers: FigureNumbers, column: str, colour: str, scale: float
) -> None:
    for name, dashes in _SPEEDS:
        draw_curve(axis, numbers.curve(name), BORNE, column, scale, color=colour, linestyle=dashes)


def _finish_mean(axes: Sequence[Axes], handles: list[Any]) -> None:
    """Axes of mean, first and second harmonic against eps_eff, with the stated drop."""
    seen = stated()
    axes[0].set(xlim=(0, 0.3), ylim=(-0.145, 0.012), ylabel=DROP)
    mark_statement(axes[0], seen.epsilon_eff, seen.drop)
    say(axes[0], "20 %", (seen.epsilon_eff, seen.drop[0] - 0.006), ha="right", va="top")
    axes[0].legend(handles=[*handles, statement_key()], loc="lower left", labelspacing=0.3)
    for axis, (symbol, _) in zip(axes[1:], _HARMONICS, strict=True):
        thousandths(axis, symbol)
    axes[2].set_xlabel(EFFECTIVE)


def _legend_of_speeds(axis: Axes, colour: str, extra: list[Any]) -> None:
    axis.legend(
        handles=[
            key("elasto-plastic, 1 µm/s", color=colour),
            key("elasto-plastic, 10 µm/s", color=colour, linestyle=FAST),
            *extra,
        ],
        loc="upper left",
        bbox_to_anchor=(0.06, 1.0),
    )
