"""Figures of a recording: what was read, what was found, and what was left."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import ScalarFormatter

from asperity.figures.style import ELASTO_PLASTIC, GREY, LINKER_DIETERICH, STATED_FILL, new_figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from asperity.instrument.measure import Measurement
    from asperity.instrument.measure_static import StaticMeasurement

    Array = NDArray[np.float64]

#: Columns of a long curve: more than pixels show nothing.
_COLUMNS = 1200
_POINTS = 20_000
_BINS = 90
_MEASURED, _FITTED, _LOAD = GREY, ELASTO_PLASTIC, "#9DB7D5"
_LABELLED: dict[str, Any] = {"va": "top", "ha": "left", "fontsize": 10}


def draw_modulated(found: Measurement) -> Figure:
    """Recording with its window, mean cycle with the fit, and what is left of it.

    Parameters
    ----------
    found : Measurement
    """
    figure = new_figure(5.0, 7.2)
    whole, cycle, left = figure.subplots(3, 1)
    _draw_recording(whole, found)
    _draw_cycle(cycle, found)
    _draw_residual(left, found)
    for axis, letter in zip((whole, cycle, left), "abc", strict=True):
        axis.text(0.015, 0.96, f"({letter})", transform=axis.transAxes, **_LABELLED)
    return figure


def draw_static(found: StaticMeasurement) -> Figure:
    """Friction over time with the steady level of each segment, and its drift.

    Parameters
    ----------
    found : StaticMeasurement
    """
    figure = new_figure(5.0, 3.5)
    axis = figure.subplots()
    start = found.time[0]
    _band(axis, found.time - start, found.values, color=_MEASURED)
    speed = [s.velocity for s in found.segments]
    low, high = np.quantile(found.values, [0.002, 0.998])
    low = min(low, *(s.lowest for s in found.segments))
    high = max(high, *(s.highest for s in found.segments))
    room = 0.22 * (high - low)
    axis.set_ylim(low - 0.3 * room, high + room)
    for k, s in enumerate(found.segments):
        span = np.array([s.steady.start, s.end])
        middle = (s.steady.start + s.end) / 2
        axis.plot(
            span - start,
            s.steady.value + s.slope * (span - middle),
            color=LINKER_DIETERICH,
            label="steady level and drift" if k == 0 else None,
        )
        if k:
            axis.axvline(s.start - start, color="#333333", linewidth=0.7, linestyle="dashed")
        if np.isfinite(speed[k]):
            axis.text(
                (s.start + s.end) / 2 - start,
                high + 0.85 * room,
                f"{1e6 * speed[k]:.3g} µm/s",
                va="top",
                ha="center",
            )
    axis.set(xlabel=_since(start), ylabel="friction $F/W$")
    axis.legend(loc="upper right", bbox_to_anchor=(1.0, 0.88), handlelength=1.4)
    return figure


def _draw_recording(axis: Axes, found: Measurement) -> None:
    samples, reading = found.samples, found.reading
    start = samples.time[0]
    _band(axis, samples.time - start, samples.load / reading.W0, color=_LOAD)
    _band(axis, samples.time - start, samples.force / reading.W0, color=_FITTED)
    axis.axvspan(
        reading.start - start,
        reading.end - start,
        color=STATED_FILL,
        alpha=0.35,
        linewidth=0,
        zorder=0,
    )
    top = max(1.0 + abs(reading.epsilon), float(samples.load.max() / reading.W0))
    bottom = min(0.0, float(samples.force.min() / reading.W0))
    axis.set_ylim(bottom, top + 0.3 * (top - bottom))
    axis.set(xlabel=_since(start), ylabel="$W/W_0$,  $F/W_0$")
    keys = [
        Patch(color=_LOAD, label="load"),
        Patch(color=_FITTED, label="force"),
        Patch(color=STATED_FILL, alpha=0.35, label="what is read"),
    ]
    axis.legend(handles=keys, loc="upper right", ncols=3, handlelength=1.2)


def _draw_cycle(axis: Axes, found: Measurement) -> None:
    """The mean cycle of the force against the phase of the load."""
    reading, cut = found.reading, slice(*found.window)
    time, force = found.samples.time[cut], found.samples.force[cut]
    middle, length = (reading.start + reading.end) / 2, reading.end - reading.start
    trend = reading.drift[1, 0] * (time - middle) / length if reading.drift.shape[1] else 0.0
    phase = reading.frequency * (time - middle) + reading.phase / (2 * np.pi)
    where = ((phase % 1.0) * _BINS).astype(int) % _BINS
    count = np.maximum(np.bincount(where, minlength=_BINS), 1)
    mean = np.bincount(where, force - trend, minlength=_BINS) / count / reading.W0
    middle_of = (np.arange(_BINS) + 0.5) / _BINS
    scale = 1e3
    filled = np.bincount(where, minlength=_BINS) > 0
    axis.plot(
        middle_of[filled],
        scale * (mean - reading.mean_friction)[filled],
        "o",
        markersize=2.6,
        color=_MEASURED,
        label="measured, mean cycle",
    )
    fine = np.linspace(0, 1, 400)
    order = np.arange(1, reading.harmonics.size + 1)[:, None]
    fit = (reading.harmonics[:, None] * np.exp(2j * np.pi * order * fine)).real.sum(0)
    axis.plot(fine, scale * fit, color=_FITTED, label=f"{order.size} harmonics")
    low, high = axis.get_ylim()
    axis.set_ylim(low, high + 0.35 * (high - low))
    axis.set(xlabel=r"phase of the load $\phi/2\pi$", ylabel=r"$10^3\,(F/W_0-\bar\mu)$")
    axis.legend(loc="upper right", ncols=2)


def _draw_residual(axis: Axes, found: Measurement) -> None:
    """Amplitudes of what the fit leaves, with what it has found beside them."""
    reading, cut = found.reading, slice(*found.window)
    most = 1 << 18
    time, force = found.samples.time[cut][:most], found.samples.force[cut][:most] / reading.W0
    middle = (reading.start + reading.end) / 2
    cycles = reading.frequency * (time - middle) + reading.phase / (2 * np.pi)
    order = np.arange(1, reading.harmonics.size + 1)
    for n, c in zip(order, reading.harmonics, strict=True):
        force = force - (c * np.exp(2j * np.pi * n * cycles)).real
    grid = np.linspace(time[0], time[-1], time.size)
    level = np.interp(grid, time, force)
    u = np.linspace(-1, 1, grid.size)
    level = level - np.polynomial.legendre.legval(u, np.polynomial.legendre.legfit(u, level, 1))
    hann = np.cos(np.pi / 2 * u) ** 2
    amplitude = 2 * np.abs(np.fft.rfft(hann * level)) / hann.sum()
    frequency = np.fft.rfftfreq(grid.size, grid[1] - grid[0])
    top = min(frequency[-1], (order.size + 1) * reading.frequency)
    shown = (frequency > frequency[1]) & (frequency <= top)
    _band(axis, frequency[shown], np.maximum(amplitude[shown], 1e-300), color=_MEASURED, lines=True)
    axis.plot(
        order * reading.frequency,
        np.abs(reading.harmonics),
        "o",
        color=_FITTED,
        markersize=5,
        label="harmonics",
    )
    floor = float(np.quantile(amplitude[shown], 0.1))
    ceiling = max(float(np.abs(reading.harmonics).max()), float(amplitude[shown].max()))
    axis.set(
        yscale="log",
        xlim=(0, top),
        ylim=(max(floor, 1e-12) / 3, 20 * ceiling),
        xlabel="frequency (Hz)",
        ylabel="amplitude of $F/W_0$",
    )
    axis.plot([], [], color=_MEASURED, label="what is left")
    axis.legend(loc="upper right", ncols=2)


def _since(start: float) -> str:
    return f"time $-$ {start:.10g} s (s)" if start else "time (s)"


def _band(axis: Axes, x: Array, y: Array, *, color: str, lines: bool = False) -> None:
    """A curve, or the band between its extremes where it has more points than can be seen."""
    if y.size <= _POINTS:
        axis.plot(x, y, color=color, linewidth=0.6)
    else:
        edges = np.linspace(0, y.size, _COLUMNS + 1).astype(int)[:-1]
        low, high = np.minimum.reduceat(y, edges), np.maximum.reduceat(y, edges)
        axis.fill_between(x[edges], low, high, color=color, linewidth=0.5 if lines else 0.3)
    formatter = ScalarFormatter(useOffset=False)
    axis.yaxis.set_major_formatter(formatter)
