"""Figures of a recording: the signals, the fit, and its residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import ScalarFormatter

from asperity.arrays import Float
from asperity.figures.plot import NORMAL
from asperity.figures.style import (
    ELASTO_PLASTIC,
    GREY,
    LINKER_DIETERICH,
    STATED_FILL,
    letter_panels,
    new_figure,
    room_above,
    three_panels,
)
from asperity.measurement.curves import mean_cycle, residual_spectrum
from asperity.recording.defects.sampling import gap_rows
from asperity.recording.extremes import extremes

if TYPE_CHECKING:
    from asperity.measurement.measure import Measurement
    from asperity.measurement.sliding.measure import SlidingMeasurement


#: Number of blocks of a long curve, about the number of pixels.
_COLUMNS = 1200
_POINTS = 20_000
#: Share of a curve's length that a gap must have to be seen.
_SEEN = 0.003
_MEASURED, _FITTED, _LOAD = GREY, ELASTO_PLASTIC, "#9DB7D5"


def draw_modulated(measurement: Measurement) -> Figure:
    """Recording with its window, mean cycle with the fit, and spectrum of the residual.

    Parameters
    ----------
    measurement : Measurement
    """
    return three_panels((_draw_recording, _draw_cycle, _draw_residual), measurement)


def draw_amplitudes(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Mean friction and harmonics against the amplitude of the load, with bars of 95 %.

    Parameters
    ----------
    rows : sequence of mapping
        From `asperity.measurement.campaign.modulated_rows`; those without numbers are left out.
    """
    figure = new_figure(5.0, 5.6)
    mean, harmonics = figure.subplots(2, 1, sharex=True)
    kept = [row for row in rows if not row["reason"]]
    epsilon = [row["epsilon"] for row in kept]
    for axis, name, colour, label in (
        (mean, "mean_friction", _MEASURED, None),
        (harmonics, "mu1", _FITTED, r"$\mu_1$"),
        (harmonics, "mu2", LINKER_DIETERICH, r"$\mu_2$"),
    ):
        values = [row[name] for row in kept]
        bars = [NORMAL * row[f"{name}_uncertainty"] for row in kept]
        axis.errorbar(epsilon, values, bars, fmt="o", capsize=2.5, color=colour, label=label)
    # Friction without modulation, from the pauses next to a stretch.
    still = [row["static_friction"] for row in kept if "static_friction" in row]
    mean.plot(np.zeros(len(still)), still, "o", mfc="none", color=_MEASURED)
    mean.set_ylabel(r"mean friction $\bar{\mu}$")
    harmonics.set(xlabel=r"modulation amplitude $\epsilon$", ylabel="amplitude of $F/W_0$")
    largest = max(epsilon, default=1.0)
    harmonics.set_xlim(-0.04 * largest, 1.08 * largest)
    harmonics.set_ylim(bottom=0)
    harmonics.legend(loc="upper left")
    letter_panels((mean, harmonics))
    return figure


def draw_sliding(measurement: SlidingMeasurement) -> Figure:
    """Friction over time with the steady part of each segment, its steps and holds.

    Parameters
    ----------
    measurement : SlidingMeasurement
    """
    figure = new_figure(5.0, 3.5)
    axis = figure.subplots()
    start = measurement.time[0]
    band(axis, measurement.time - start, measurement.values, color=_MEASURED)
    low, high = np.quantile(measurement.values, [0.002, 0.998])
    low = min(low, *(s.lowest for s in measurement.segments))
    high = max(high, *(s.highest for s in measurement.segments))
    room = 0.22 * (high - low)
    axis.set_ylim(low - 0.3 * room, high + 1.9 * room)
    length = float(measurement.time[-1] - start)
    line = None
    for k, s in enumerate(measurement.segments):
        middle = (s.start + s.end) / 2 - start
        if k:
            axis.axvline(s.start - start, color="#333333", linewidth=0.5, linestyle="dashed")
        if s.hold:
            axis.axvspan(s.start - start, s.end - start, color=STATED_FILL, alpha=0.3, linewidth=0)
            continue
        span = np.array([s.steady.start, s.end])
        level = s.steady.value + s.slope * (span - span.mean())
        (line,) = axis.plot(span - start, level, color=LINKER_DIETERICH)
        # A label that would overlap its neighbours is left out.
        if np.isfinite(s.velocity) and s.end - s.start > 0.15 * length:
            axis.text(
                middle, high + 0.75 * room, f"{1e6 * s.velocity:.3g} µm/s", va="top", ha="center"
            )
    if line is not None:
        line.set_label("steady level and drift")
    if measurement.holds:
        peaks = np.array([(h.peak_time - start, h.peak) for h in measurement.holds]).T
        axis.plot(*peaks, "v", markersize=4, color=_FITTED, label="peak after a hold")
    axis.set(xlabel=since(start), ylabel="friction $F/W$")
    axis.legend(loc="upper right", ncols=2, handlelength=1.4)
    return figure


def _draw_recording(axis: Axes, measurement: Measurement) -> None:
    samples, reading = measurement.samples, measurement.reading
    start = samples.time[0]
    band(axis, samples.time - start, samples.load / reading.W0, color=_LOAD)
    band(axis, samples.time - start, samples.force / reading.W0, color=_FITTED)
    window = reading.start - start, reading.end - start
    axis.axvspan(*window, color=STATED_FILL, alpha=0.35, linewidth=0, zorder=0)
    top = max(1.0 + abs(reading.epsilon), float(samples.load.max() / reading.W0))
    bottom = min(0.0, float(samples.force.min() / reading.W0))
    axis.set_ylim(bottom, top + 0.3 * (top - bottom))
    axis.set(xlabel=since(start), ylabel="$W/W_0$,  $F/W_0$")
    keys = [
        Patch(color=_LOAD, label="load"),
        Patch(color=_FITTED, label="force"),
        Patch(color=STATED_FILL, alpha=0.35, label="part that is measured"),
    ]
    axis.legend(handles=keys, loc="upper right", ncols=3, handlelength=1.2)


def _draw_cycle(axis: Axes, measurement: Measurement) -> None:
    """The mean cycle of the force against the phase of the load."""
    cycle, scale = mean_cycle(measurement), 1e3
    look: dict[str, Any] = {"markersize": 2.6, "color": _MEASURED, "label": "measured, mean cycle"}
    axis.plot(cycle.phase, scale * cycle.measured, "o", **look)
    harmonics = measurement.reading.harmonics.size
    axis.plot(cycle.fine_phase, scale * cycle.fitted, color=_FITTED, label=f"{harmonics} harmonics")
    room_above(axis, 0.35)
    axis.set(xlabel=r"phase of the load $\phi/2\pi$", ylabel=r"$10^3\,(F/W_0-\bar\mu)$")
    axis.legend(loc="upper right", ncols=2)


def _draw_residual(axis: Axes, measurement: Measurement) -> None:
    """Spectrum of the residual of the fit, with the fitted harmonics."""
    reading = measurement.reading
    frequency, amplitude = residual_spectrum(measurement)
    order = np.arange(1, reading.harmonics.size + 1)
    band(axis, frequency, np.maximum(amplitude, 1e-300), color=_MEASURED, lines=True)
    harmonics = np.abs(reading.harmonics)
    axis.plot(
        order * reading.frequency, harmonics, "o", color=_FITTED, markersize=5, label="harmonics"
    )
    floor, ceiling = np.quantile(amplitude, 0.1), max(harmonics.max(), amplitude.max())
    limits = max(floor, 1e-12) / 3, 20 * ceiling
    axis.set(yscale="log", xlim=(0, frequency[-1]), ylim=limits)
    axis.set(xlabel="frequency (Hz)", ylabel="amplitude of $F/W_0$")
    axis.plot([], [], color=_MEASURED, label="residual")
    axis.legend(loc="upper right", ncols=2)


def since(start: float) -> str:
    """Label of an axis of times after the start of a recording (s)."""
    return f"time $-$ {start:.10g} s (s)" if start else "time (s)"


def band(axis: Axes, x: Float, y: Float, *, color: str, lines: bool = False) -> None:
    """A curve; a long curve is reduced to the extremes of blocks of its samples.

    Nothing is drawn between samples that are far apart.
    """
    breaks = gap_rows(x) if not lines and x.size > 3 else np.empty(0, dtype=np.intp)
    wide = np.diff(x)[breaks - 1] > _SEEN * (x[-1] - x[0])
    for first, stop in pairwise([0, *breaks[wide][:_COLUMNS].tolist(), x.size]):
        part_x, part_y = x[first:stop], y[first:stop]
        if y.size > _POINTS:
            kept = extremes(part_y, max(_COLUMNS * part_y.size // y.size, 1))
            part_x, part_y = part_x[kept], part_y[kept]
        marker = "." if part_x.size == 1 else None
        axis.plot(part_x, part_y, color=color, linewidth=0.6, marker=marker, markersize=1)
    axis.yaxis.set_major_formatter(ScalarFormatter(useOffset=False))
