"""Figures of stick-slip: a recording with its regimes and drops, and a campaign over V and K."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from asperity.figures.plot import NORMAL
from asperity.figures.recording import band, since
from asperity.figures.style import (
    ELASTO_PLASTIC,
    GREY,
    STATED_FILL,
    new_figure,
    room_above,
    three_panels,
)
from asperity.measurement.curves import middle_events
from asperity.measurement.stick_slip.regimes import REPEATED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from asperity.measurement.stick_slip.campaign import StickSlipCampaign
    from asperity.measurement.stick_slip.measure import StickSlipMeasurement

#: Of the series of a campaign, in turn.
_MARKS = "osD^vP"


def draw_stick_slip(measurement: StickSlipMeasurement) -> Figure:
    """The recording with its regimes, some events, and drop against stick time.

    Bars are 95 % intervals, as in the other figures of measurements.

    Parameters
    ----------
    measurement : StickSlipMeasurement
    """
    return three_panels((_draw_whole, _draw_close, _draw_drops), measurement)


def _draw_whole(axis: Axes, measurement: StickSlipMeasurement) -> None:
    start = float(measurement.time[0])
    band(axis, measurement.time - start, measurement.friction, color=GREY)
    names: set[str] = set()
    for k, regime in enumerate(measurement.regimes):
        if regime.sticks and len(measurement.regimes) > 1:
            span = regime.start - start, regime.end - start
            axis.axvspan(*span, color=STATED_FILL, alpha=0.35, zorder=0)
        if regime.kind not in names or len(measurement.regimes) < 6:
            place = (regime.start + regime.end) / 2 - start, 1.01 + 0.07 * (k % 2)
            axis.text(
                *place, regime.kind, transform=axis.get_xaxis_transform(),
                ha="center", va="bottom", fontsize=7,
            )  # fmt: skip
        names.add(regime.kind)
    _label(axis, start)


def _draw_close(axis: Axes, measurement: StickSlipMeasurement) -> None:
    events = measurement.events
    start = float(measurement.time[0])
    if not len(events):
        axis.set_axis_off()
        axis.text(0.5, 0.5, "no events", transform=axis.transAxes, ha="center")
        return
    shown, near = middle_events(measurement)
    band(axis, measurement.time[near] - start, measurement.friction[near], color=GREY)
    times = np.stack([events.onset[shown], events.end[shown]]) - start
    forces = np.stack([events.force_before[shown], events.force_after[shown]])
    axis.plot(times, forces, ".-", color=ELASTO_PLASTIC, linewidth=1.2, markersize=4)
    _label(axis, start)


def _label(axis: Axes, start: float) -> None:
    """Labels of friction over the time after `start`, with room for the letter of the panel."""
    axis.set(xlabel=since(start), ylabel="$F/W$")
    axis.margins(x=0)
    room_above(axis, 0.15)


def _draw_drops(axis: Axes, measurement: StickSlipMeasurement) -> None:
    events = measurement.events
    known = np.isfinite(np.asarray(events.stick_duration, float))
    axis.set(xlabel="stick time (s)", ylabel=r"drop of $F/W$")
    if not known.any():
        return
    waits, drops = events.stick_duration[known], events.drop[known]
    axis.errorbar(
        waits, drops, yerr=NORMAL * events.drop_uncertainty[known], fmt="o",
        color=ELASTO_PLASTIC, markersize=2.5, linewidth=0.7,
    )  # fmt: skip
    axis.axhline(measurement.smallest_drop, color=GREY, linewidth=0.8, linestyle="--")
    axis.text(
        0.985, measurement.smallest_drop, "smallest drop that is seen", fontsize=7,
        va="bottom", ha="right", transform=axis.get_yaxis_transform(),
    )  # fmt: skip
    if np.max(waits) > 10 * np.min(waits):
        axis.set_xscale("log")
    axis.margins(x=0.06, y=0.2)
    axis.set_ylim(bottom=0)


def draw_campaign(campaign: StickSlipCampaign) -> Figure:
    """Drop and recurrence against the velocity, a colour for each stiffness and load.

    Bars are 95 % intervals of means. Open marks are means over growing or dying cycles, or over
    several regimes; crosses are recordings that end in steady sliding.

    Parameters
    ----------
    campaign : StickSlipCampaign
    """
    from matplotlib import colormaps

    figure = new_figure(5.0, 6.2)
    drops, times = figure.subplots(2, 1, sharex=True)
    drops.set(ylabel="drop of $F/W$", xscale="log")
    times.set(xlabel="$V$ (m/s)", ylabel="recurrence (s)", yscale="log")
    # Stiffness has an order, and so have the colours.
    colours = colormaps["viridis"](np.linspace(0, 0.85, len(campaign.series)))
    steady = False
    for k, series in enumerate(campaign.series):
        V, look = series.column("V"), {"color": colours[k], "markersize": 4.5}
        ends = np.array([row["regime"].endswith("steady sliding") for row in series.rows], bool)
        clear = np.array([row["regime"] in REPEATED for row in series.rows], bool)
        for axis, name in ((drops, "drop"), (times, "recurrence")):
            y, uncertainty = series.column(name), series.column(f"{name}_uncertainty")
            for some, face in ((clear, colours[k]), (~clear & ~ends, "white")):
                if some.any():
                    bars = NORMAL * np.nan_to_num(uncertainty[some])
                    axis.errorbar(
                        V[some], y[some], bars, fmt=_MARKS[k % len(_MARKS)], linewidth=0.9,
                        markerfacecolor=face, **look,
                    )  # fmt: skip
        drops.plot(V[ends], np.zeros(int(ends.sum())), "x", zorder=5, **look)
        steady |= bool(ends.any())
        drops.plot([], [], _MARKS[k % len(_MARKS)], label=series.name, **look)
    if campaign.model is not None:
        for row, k in enumerate(campaign.modelled):
            line = {"color": colours[k], "linewidth": 1.2}
            drops.plot(campaign.model.velocity[row], campaign.model.drop[row], **line)
            times.plot(campaign.model.velocity[row], campaign.model.period[row], **line)
        name = campaign.model.slider.law.name
        drops.plot([], [], color=GREY, linewidth=1.2, label=name)
    if steady:
        drops.plot([], [], "x", color=GREY, markersize=4.5, label="steady sliding")
    drops.set_ylim(bottom=-0.03 * drops.get_ylim()[1])
    for axis in (drops, times):
        axis.margins(x=0.06)
    if campaign.series:
        drops.legend(ncols=2, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return figure
