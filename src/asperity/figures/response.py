"""Figures of responses, periodic and of stick-slip: a cycle of one point, or curves over points."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rcParams
from matplotlib.figure import Figure

from asperity.errors import require
from asperity.figures.map import axis_unit, label
from asperity.figures.style import (
    ELASTO_PLASTIC,
    GREY,
    RICE_RUINA,
    new_figure,
    reason_of_gaps,
)
from asperity.units import format_si

if TYPE_CHECKING:
    import xarray

    from asperity.experiment.stick_slip import StickSlip
    from asperity.orbit import PeriodicResponse
    from asperity.transients.limit_cycle import LimitCycle

#: Largest number of characters of a line above the panels.
_LINE = 100
#: Largest number of curves in a panel.
_MOST_CURVES = 8
#: Name, label and unit of the quantity of each panel.
_PERIODIC = (
    ("mean_friction", "mean of $F/W_0$", 1.0),
    ("mu1", r"$\mu_1$", 1.0),
    ("mu2", r"$\mu_2$", 1.0),
)
_STICK_SLIP = (
    ("drop", "drop of $F/W_0$", 1.0),
    ("period", "period (s)", 1.0),
    ("peak_velocity", "largest velocity (mm/s)", 1e-3),
)


def draw_response(response: PeriodicResponse) -> Figure:
    """One cycle of a single point; mean and harmonics over the last axis of several.

    Parameters
    ----------
    response : PeriodicResponse
        Response of one point, or with one or two axes. A point that failed leaves a gap, of
        which the title has the reason; an unstable orbit has an open mark.

    Raises
    ------
    InputError
        If there are more than two axes, or too many curves.
    """
    if response.mean_friction.size == 1:
        return _cycle(response)
    data = response.to_dataset().squeeze()
    _require_rows(data.mean_friction.shape, "one point, a row of points", "asperity.map")
    unstable = data.converged.values & ~data.stable.values
    return _curves(data, response.slider.law.name, _PERIODIC, unstable)


def draw_stick_slip_response(response: StickSlip) -> Figure:
    """The cycle of a single point; drop, period and largest velocity over the last axis of several.

    Parameters
    ----------
    response : StickSlip
        Response of one point, or with one or two axes. A point without stick-slip leaves a gap,
        of which the title has the reason.

    Raises
    ------
    InputError
        If a single point has no stick-slip, or there are more than two axes, or too many curves.
    """
    if response.cycle is not None:
        return _stick_slip_cycle(response, response.cycle)
    data = response.to_dataset().squeeze()
    _require_rows(data.period.shape, "one point, a row of points", "xarray, from its to_dataset()")
    return _curves(data, response.slider.law.name, _STICK_SLIP)


def _stick_slip_cycle(response: StickSlip, cycle: LimitCycle) -> Figure:
    """Force and displacement of the slider: over a period, and enlarged about its slip."""
    require(cycle.slips, "plot", "show a cycle", cycle.result, "choose another velocity or spring")
    slider = response.slider
    V, K, W0 = (float(np.asarray(a).item()) for a in (response.velocity, slider.K, slider.W0))
    slip, period = cycle.slip_duration, cycle.period
    figure = new_figure(6.4, 4.2)
    panels = figure.subplots(2, 2, sharey="row")
    near = np.linspace(-slip, min(2 * slip, period / 2), 600)
    whole = np.union1d(np.linspace(-period / 2, period / 2, 600), near)
    for (above, below), time in zip(panels.T, (whole, near), strict=True):
        force, drive = cycle.force(time), V * time
        above.plot(time, force, color=ELASTO_PLASTIC)
        moved = drive - (force - cycle.peak) * W0 / K
        below.plot(time, moved * 1e6, color=RICE_RUINA)
        below.plot(time, drive * 1e6, color=GREY, linestyle="dotted")
        below.set_xlabel("time from the peak (s)")
        for panel in (above, below):
            panel.margins(x=0)
    panels[0, 0].set_ylabel("$F/W_0$")
    panels[1, 0].set_ylabel("slider (µm); drive dotted")
    figure.suptitle(
        f"{slider.law.name}: V {format_si(V, 'velocity')}, K {format_si(K, 'stiffness')}; "
        f"drop {cycle.drop:.4g}, period {period:.4g} s, slip {slip:.4g} s",
        fontsize="small",
    )
    return figure


def _require_rows(shape: tuple[int, ...], rows: str, other: str) -> None:
    rule, got = f"have {rows} or up to {_MOST_CURVES} rows", f"{'x'.join(map(str, shape))} points"
    advice = f"draw grids with {other}"
    require(len(shape) <= 2 and int(np.prod(shape[:-1])) <= _MOST_CURVES, "plot", rule, got, advice)


def _cycle(response: PeriodicResponse) -> Figure:
    """Load and force over a period, and the harmonics of the force."""
    figure = new_figure(6.4, 2.9)
    time, spectrum = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    theta = np.linspace(0.0, 2 * np.pi, 513)
    harmonics, mean = response.harmonics.reshape(-1), float(response.mean_friction.item())
    order = np.arange(1, harmonics.size + 1)
    force = mean + (harmonics * np.exp(1j * theta[:, None] * order)).real.sum(axis=1)
    if response.waveform.shape[-1]:
        theta = np.append(response.theta, 2 * np.pi)
        force = response.waveform[0].reshape(-1)
        force = np.append(force, force[0])
    time.plot(theta / (2 * np.pi), force, color=ELASTO_PLASTIC)
    steady = float(np.asarray(response.mu_ss).item())
    time.axhline(mean, color=ELASTO_PLASTIC, linewidth=0.7, linestyle="dashed")
    time.text(0.5, mean, "mean", va="bottom", ha="center", fontsize="small", color=ELASTO_PLASTIC)
    time.set(xlabel="time (periods of the load)", ylabel="$F/W_0$")
    time.margins(y=0.2)
    load = time.twinx()
    w = np.ravel(response.load.at(theta).w)
    load.plot(theta / (2 * np.pi), w, color=GREY, linestyle="dotted")
    load.set_ylabel("$W/W_0$ (dotted)", color=GREY)
    spectrum.bar(order, np.abs(harmonics), width=0.6, color=RICE_RUINA)
    spectrum.set(xlabel="harmonic", ylabel="amplitude of $F/W_0$", xticks=order)
    if harmonics.any():  # none without modulation
        spectrum.set_yscale("log")
    spectrum.minorticks_off()
    point = ", ".join(
        f"{name} {format_si(float(np.asarray(value).item()), kind)}"
        for name, value, kind in (
            ("V", response.velocity, "velocity"),
            ("ε", response.epsilon, "dimensionless"),
            ("f", response.frequency, "frequency"),
        )
        if name != "ε" or response.has_epsilon
    )
    state = "stable" if response.stable.item() else "unstable"
    state += f", mean {mean:.4g}, without modulation {steady:.4g}"
    if not response.converged.item():
        state = fill(str(response.result.item()), _LINE)
    separator = "; " if response.converged.item() else "\n"
    figure.suptitle(f"{response.slider.law.name}: {point}{separator}{state}", fontsize="small")
    return figure


def _curves(
    data: xarray.Dataset,
    law: str,
    shown: tuple[tuple[str, str, float], ...],
    unstable: Any = None,
) -> Figure:
    """Quantities over the last axis, a panel each, and a curve for each row of the first."""
    figure = new_figure(6.4, 2.7)
    panels = figure.subplots(1, len(shown))
    rows = data if data[shown[0][0]].ndim == 2 else data.expand_dims("row")
    across, along = map(str, rows[shown[0][0]].dims)
    side = data[along] if along in data.coords else None
    unit = (1.0, "") if side is None else axis_unit(side)
    x = np.arange(data.sizes[along]) if side is None else side.values / unit[0]
    order = np.argsort(x, kind="stable")
    x, rows = x[order], rows.isel({along: order})
    shape = rows[shown[0][0]].shape
    opened = np.zeros(shape, bool) if unstable is None else unstable.reshape(shape)[:, order]
    for panel, (name, text, scale) in zip(panels, shown, strict=True):
        for i in range(rows.sizes[across]):
            row = rows.isel({across: i})
            y = row[name].values / scale
            (line,) = panel.plot(x, y, label=_row_label(row, across))
            look = {"color": line.get_color(), "fillstyle": "none", "markersize": 3}
            panel.plot(x[opened[i]], y[opened[i]], "o", **look)
        panel.set_ylabel(text)
        if x.min() > 0 and x.max() > 30 * x.min():
            panel.set_xscale("log")
        if unstable is None and np.nanmax(rows[name]) > 30 * np.nanmin(rows[name]):
            panel.set_yscale("log")
        panel.margins(y=0.08)
    if rows.sizes[across] > 1:
        panels[0].legend(fontsize="small")
    if opened.any():
        panels[2].plot([], [], "o", color=GREY, fillstyle="none", markersize=3, label="unstable")
        panels[2].legend(handles=panels[2].get_lines()[-1:], fontsize="small")
    gaps = reason_of_gaps(~np.isfinite(rows[shown[0][0]].values), rows["result"].values, _LINE)
    figure.suptitle(f"{law}\n{gaps}".rstrip(), fontsize="small")
    # A label below each panel is wider than the panel.
    name = along if side is None else label(side, unit)
    figure.supxlabel(name, fontsize=rcParams["axes.labelsize"])
    return figure


def _row_label(row: xarray.Dataset, across: str) -> str:
    if across not in row.coords:
        return ""
    scale, unit = axis_unit(row[across])
    return f"{across} {float(row[across]) / scale:.4g} {unit}".rstrip()
