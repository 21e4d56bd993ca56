"""Figures that are not in the paper: one period of the motion, the phases, and the resonance."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from asperity.figures.style import (
    ELASTO_PLASTIC,
    FAST,
    GREY,
    INERTIA,
    LINKER_DIETERICH,
    RICE_RUINA,
    STATED,
    STATED_FILL,
    new_figure,
)
from asperity.papers.bureau2000.figures.elements import (
    BORNE,
    DROP,
    EFFECTIVE,
    SPEEDS,
    key,
    mark_panels,
    stacked,
    thousandths,
)
from asperity.papers.bureau2000.numbers import FigureNumbers, paper
from asperity.papers.bureau2000.numbers.period import CASES
from asperity.papers.bureau2000.numbers.resonance import (
    DAMPED,
    FREQUENCY,
    LENGTH,
    QUALITY,
    QUASI_STATIC,
    UNDAMPED,
)

#: Dark orange: the variant of the age law, in this figure alone.
_VARIANT = "#C05A00"
_PERIOD_LINES: tuple[dict[str, Any], ...] = (
    {"color": ELASTO_PLASTIC, "linewidth": 1.8},
    {"color": _VARIANT, "linewidth": 1.4, "linestyle": (0, (4, 2))},
    {"color": INERTIA, "linewidth": 0.9},
)
_PERIOD_PANELS = (
    ("load", "$W/W_0$"),
    ("velocity", r"$\dot{x}/V$"),
    ("plastic_velocity", r"$\dot{x}_{\mathrm{pl}}/V$"),
    ("force", "$F/W_0$"),
    ("age", r"$V\Phi/D_0$"),
)


def draw_period(numbers: FigureNumbers) -> Figure:
    """Load, velocities, force and age over one period."""
    figure, axes = stacked(len(_PERIOD_PANELS), 8.8, "LLlLL")
    for name, line in zip(CASES, _PERIOD_LINES, strict=True):
        rows = numbers.curve(name)
        for axis, (column, _) in zip(axes, _PERIOD_PANELS, strict=True):
            if column != "load":
                axis.plot(rows["phase"], rows[column], **line)
    rows = numbers.curve(next(iter(CASES)))
    axes[0].plot(rows["phase"], rows["load"], color=GREY)
    for axis, (_, label) in zip(axes, _PERIOD_PANELS, strict=True):
        axis.set_ylabel(label)
        axis.margins(y=0.12)
    axes[1].axhline(0, color=GREY, linewidth=0.6)
    axes[-1].set(xlim=(0, 1), xlabel="time over the period, from the largest load on")
    labels = ("age on slider's velocity (printed)", "age on plastic velocity", "with inertia")
    handles = [key(label, **line) for label, line in zip(labels, _PERIOD_LINES, strict=True)]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, columnspacing=1.2)
    return figure


_PHASE_LINES: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("RR", "Rice–Ruina", {"color": RICE_RUINA}),
    ("LD", r"Linker–Dieterich, $\alpha=0.2$", {"color": LINKER_DIETERICH}),
    ("EXT", "elasto-plastic", {"color": ELASTO_PLASTIC}),
    ("EXT, inertia", "elasto-plastic with inertia", {"color": INERTIA, "linewidth": 1.0}),
)


def draw_phases(numbers: FigureNumbers) -> Figure:
    """Phases of the first two harmonics against eps_eff."""
    figure, axes = stacked(2, 6.4, "Ll")
    for case, _, line in _PHASE_LINES:
        for speed, _, dashes in SPEEDS:
            rows = numbers.curve(f"{case}, {speed}")
            rows = rows[rows[BORNE] > 0]
            for axis, column in zip(axes, ("phase1", "phase2"), strict=True):
                degrees = np.degrees(np.unwrap(rows[column]))
                axis.plot(rows[BORNE], degrees, linestyle=dashes, **line)
    for axis, n in zip(axes, (1, 2), strict=True):
        axis.set(ylabel=rf"phase of $\mu_{n}$ (degrees)")
        axis.yaxis.set_major_locator(MultipleLocator(45))
    axes[0].set(xlim=(0, 0.3), ylim=(-128, 62))
    axes[1].set(ylim=(36, 195), xlabel=EFFECTIVE)
    handles = [key(label, **line) for _, label, line in _PHASE_LINES]
    handles += [
        key(text, color=GREY, linestyle=dashes, linewidth=1.2) for _, text, dashes in SPEEDS
    ]
    axes[0].legend(handles=handles, loc="upper center", ncols=2, columnspacing=1.0)
    return figure


_RESONANCE_LINES: tuple[tuple[str, str, dict[str, Any]], ...] = (
    (QUASI_STATIC, "no inertia", {"color": ELASTO_PLASTIC}),
    (UNDAMPED, "inertia", {"color": INERTIA, "linewidth": 1.3}),
    (
        DAMPED,
        f"inertia, $Q={QUALITY:g}$",
        {"color": _VARIANT, "linewidth": 1.1, "linestyle": FAST},
    ),
)
_ROWS = (("delta_mu", DROP, 1.0), ("mu1", r"\mu_1", 1e3), ("mu2", r"\mu_2", 1e3))


def draw_resonance(numbers: FigureNumbers) -> Figure:
    """Drop and harmonics against the elastic length, and against frequency."""
    figure = new_figure(6.4, 6.6)
    grid = figure.subplots(3, 2, sharex="col", sharey="row")
    mark_panels(list(grid.ravel()), "llllll")
    cuts = ((LENGTH, "lambda", 1e6), (FREQUENCY, "frequency", 1.0))
    for row, (column, label, scale) in zip(grid, _ROWS, strict=True):
        for axis, (cut, x, unit) in zip(row, cuts, strict=True):
            for case, _, line in _RESONANCE_LINES:
                rows = numbers.curve(f"{cut}, {case}")
                axis.plot(unit * rows[x], scale * rows[column], **line)
        if scale == 1:
            row[0].set_ylabel(label)
        else:
            thousandths(row[0], label)
    _mark_lengths(list(grid[:, 0]))
    _mark_frequencies(list(grid[:, 1]))
    grid[2, 0].set_xlabel(r"elastic length $\lambda$ (µm)")
    grid[2, 1].set_xlabel("frequency $f$ (Hz)")
    handles = [key(label, **line) for _, label, line in _RESONANCE_LINES]
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def _mark_lengths(axes: list[Axes]) -> None:
    """What the paper measured of lambda, and what it fitted."""
    measured = paper()["lambda_quasi_static"]
    low, high = (1e6 * (measured.si + sign * (measured.si_uncertainty or 0)) for sign in (-1, 1))
    for axis in axes:
        axis.axvspan(low, high, facecolor=STATED_FILL, alpha=0.35, linewidth=0)
        axis.axvline(1e6 * paper().lambda_, color=STATED, linewidth=0.8)


def _mark_frequencies(axes: list[Axes]) -> None:
    """The two frequencies of the experiments."""
    for axis in axes:
        axis.set_xscale("log")
        axis.set_xticks([100, 200, 400, 800], ["100", "200", "400", "800"])
        axis.tick_params(which="minor", labelbottom=False)
        for f in (paper().frequency, paper().frequency_vacuum):
            axis.axvline(f, color=STATED, linewidth=0.8)
