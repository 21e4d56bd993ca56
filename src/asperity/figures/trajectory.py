"""Figure of a run: load, force, velocity and age over time, with its events."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.arrays import Float
from asperity.figures.style import (
    ELASTO_PLASTIC,
    GREY,
    LINKER_DIETERICH,
    RICE_RUINA,
    letter_panels,
    new_figure,
)

if TYPE_CHECKING:
    from asperity.protocol import RunOutline
    from asperity.transients import Trajectory

#: Quantity, colour, scale and label of each panel.
_PANELS = (
    ("load", RICE_RUINA, 1.0, "$W$ (N)"),
    ("force", ELASTO_PLASTIC, 1.0, "$F$ (N)"),
    ("velocity", ELASTO_PLASTIC, 1e6, "velocity (µm/s)"),
    ("age", RICE_RUINA, 1.0, r"age $\Phi$ (s)"),
)
#: Colours of the kinds of events that are marked, and the largest number of one kind.
_MARKED = {"slip start": LINKER_DIETERICH, "steady": GREY}
_MOST_MARKS = 60
#: Number of intervals of a trajectory whose extremes are drawn; more than a figure has pixels.
_STRETCHES = 2000


def draw_run(run: RunOutline) -> Figure:
    """Load, spring force, velocity of the slider and age of the contacts over time.

    Where a curve turns faster than the figure can show, the band between its extremes is filled.

    Parameters
    ----------
    run : RunOutline
    """
    aged = "age" in run.low
    figure = new_figure(5.0, 8.0 if aged else 6.2)
    panels = figure.subplots(4 if aged else 3, 1, sharex=True)
    for panel, (name, color, scale, label) in zip(panels, _PANELS, strict=False):
        _draw_band(panel, run, name, color, scale)
        panel.set_ylabel(label)
    load, force, velocity = panels[:3]
    _scale_velocity(velocity, run)
    if aged:
        # Logarithmic where it spans decades, as from slip to a hold.
        _spans_decades(panels[3], run.low["age"], run.high["age"])
    panels[-1].set_xlabel("time (s)")
    _mark_events(force, run)
    if run.title:
        load.set_title(run.title)
    letter_panels(panels)
    velocity.set_xlim(run.time[0], run.time[-1])
    return figure


def draw_trajectory(trajectory: Trajectory) -> Figure:
    """Load, spring force, velocity of the slider and age of the contacts over time.

    Parameters
    ----------
    trajectory : Trajectory
    """
    from asperity.protocol import RunOutline

    starts = np.unique(np.linspace(0, trajectory.time.size, _STRETCHES, endpoint=False, dtype=int))
    columns = {name: getattr(trajectory, name) for name in ("load", "force", "velocity")}
    if (age := trajectory.age) is not None:
        columns["age"] = age
    outline = RunOutline(
        time=trajectory.time[starts],
        low={name: np.minimum.reduceat(values, starts) for name, values in columns.items()},
        high={name: np.maximum.reduceat(values, starts) for name, values in columns.items()},
        events=[(event.time, event.kind) for event in trajectory.events],
        title="",
        law=trajectory.motion.slider.law.name,
    )
    return draw_run(outline)


def _draw_band(axis: Axes, run: RunOutline, name: str, color: str, scale: float) -> None:
    low, high = scale * run.low[name], scale * run.high[name]
    axis.fill_between(run.time, low, high, color=color, alpha=0.45, linewidth=0)
    # The edges of the band, which are one line where it has no width.
    for edge in (low, high):
        axis.plot(run.time, edge, color=color, linewidth=0.7)
    least, most = float(np.min(low)), float(np.max(high))
    span = most - least
    if span <= 1e-9 * abs(most):
        room = 0.1 * abs(most) + 1e-12
        axis.set_ylim(most - room, most + room)
    else:
        axis.set_ylim(least - 0.06 * span, most + 0.22 * span)


def _scale_velocity(axis: Axes, run: RunOutline) -> None:
    """Pulses and holds are decades apart: logarithmic where the velocity stays positive."""
    low, high = 1e6 * run.low["velocity"], 1e6 * run.high["velocity"]
    if not _spans_decades(axis, low, high):
        size = max(float(np.max(np.abs([low, high]))), 1e-300)
        if size > 30 * np.median(np.maximum(np.abs(low), np.abs(high))):
            # Linear up to a power of ten, which then is the first of the marks.
            axis.set_yscale("symlog", linthresh=10.0 ** (np.floor(np.log10(size)) - 1))
            axis.autoscale(axis="y")


def _spans_decades(axis: Axes, low: Float, high: Float) -> bool:
    """Whether values span decades; their axis is then logarithmic."""
    least, most = float(np.min(low)), float(np.max(high))
    if not 0 < 30 * least < most:
        return False
    axis.set_yscale("log")
    axis.set_ylim(max(least, 1e-9 * most) / 2, 8 * most)
    return True


def _mark_events(axis: Axes, run: RunOutline) -> None:
    for kind, color in _MARKED.items():
        times = [t for t, k in run.events if k == kind]
        if 0 < len(times) <= _MOST_MARKS:
            for t in times:
                line = axis.axvline(t, color=color, linewidth=0.7, linestyle="dotted")
            line.set_label(kind)
    if axis.get_legend_handles_labels()[0]:
        axis.legend(loc="upper right", ncols=2, frameon=True, framealpha=1.0, edgecolor="none")
