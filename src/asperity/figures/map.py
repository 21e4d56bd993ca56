"""Figure of a map: a quantity in colour, and the stability boundary by kind of bifurcation."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import xarray
from cmcrameri import cm
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import QuadMesh
from matplotlib.colors import CenteredNorm, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from asperity.arrays import Bool, Float
from asperity.figures.style import new_figure, reason_of_gaps
from asperity.parameters.arguments import typed
from asperity.study.map.dataset import critical_line
from asperity.study.points import known_quantities
from asperity.units import display_unit

#: Line of each kind of bifurcation.
KIND_LINES: dict[str, Any] = {
    "Neimark-Sacker": "solid",
    "period doubling": (0, (4.0, 1.6)),
    "fold": (0, (1.0, 1.2)),
}
_KIND_NAMES = {"Neimark-Sacker": "Neimark–Sacker", "": "multiplier lost"}
_LINE = "#111111"
_UNMODULATED: dict[str, Any] = {"color": _LINE, "linewidth": 0.9, "linestyle": (0, (6, 2, 1, 2))}
_FAILED: dict[str, Any] = {
    "facecolor": "#D9D9D9",
    "edgecolor": "#909090",
    "hatch": "xxxx",
    "linewidth": 0,
}

_REVERSES: dict[str, Any] = {
    "facecolor": "none",
    "edgecolor": "#404040",
    "hatch": "...",
    "linewidth": 0,
}

_CYCLIC = ("phase1", "phase2")
_SIGNED = ("log_multiplier", "growth_rate", "floquet_max")
#: Ratio of the largest to the smallest value above which the colour scale is logarithmic.
_DECADES = 50.0
#: Ratio of the ends of a logarithmic axis below which numbers between decades are written.
_FEW_DECADES = 30.0
#: Quantiles at the ends of the colour scale, so that few extreme points do not determine it.
_SPAN = (0.02, 0.98)
#: Characters of a line above the plane.
_CHARACTERS = 76
#: Smallest region, in parts of the shorter side, that has room for its name.
_ROOM = 0.075


def draw_map(dataset: xarray.Dataset, show: str = "growth_rate") -> Figure:
    """A quantity over the plane, with the stability boundary.

    Parameters
    ----------
    dataset : Dataset
        From `asperity.study.map.response_map`.
    show : str
        A key of `asperity.study.map.SHOWN`.
    """
    figure = new_figure(5.0, 4.1)
    axis = figure.subplots()
    mesh = draw_plane(axis, dataset, show)
    bar = figure.colorbar(mesh, ax=axis, pad=0.02, aspect=28, extend=_extend(dataset, show, mesh))
    bar.set_label(label(dataset[show], (1.0, dataset[show].attrs["units"])))
    bar.ax.minorticks_off()
    handles = keys(dataset)
    if handles:
        columns = 2 if len(handles) != 3 else 3
        close = {"handlelength": 2.4, "columnspacing": 1.2}
        figure.legend(handles=handles, loc="outside lower center", ncols=columns, **close)
    failed = ~dataset["converged"].values
    if failed.any():
        text = reason_of_gaps(failed, dataset["result"].values, _CHARACTERS)
        figure.suptitle(text, fontsize="small")
    return figure


@typed
def draw_plane(axis: Axes, dataset: xarray.Dataset, show: str) -> QuadMesh:
    """The plane alone, without colour bar and legend.

    Parameters
    ----------
    axis : Axes
    dataset : Dataset
    show : str
    """
    sides = [dataset[dataset.attrs[side]] for side in "xy"]
    units = [axis_unit(side) for side in sides]
    grid = [side.values / unit[0] for side, unit in zip(sides, units, strict=True)]
    log = [dataset.attrs[f"{side}_scale"] == "log" for side in "xy"]
    axis.set_facecolor(_FAILED["facecolor"])
    mesh = axis.pcolormesh(
        *map(_edges, grid, log),
        np.ma.masked_invalid(dataset[show].values),
        norm=colours(dataset, show),
        cmap=_colour_map(show),
        rasterized=True,
        shading="flat",
    )
    for name, look in (("converged", _FAILED), ("reverses", _REVERSES)):
        region = dataset[name].values.astype(bool)
        _hatch(axis, grid, ~region if name == "converged" else region, look)
    _draw_boundary(axis, dataset, units)
    if (line := critical_line(dataset)) is not None:
        halo = patheffects.withStroke(linewidth=2.2, foreground="white", alpha=0.7)
        pair = (values / unit[0] for values, unit in zip(line, units, strict=True))
        axis.plot(*pair, zorder=3, path_effects=[halo], **_UNMODULATED)
    for name, values, unit, side, is_log in zip("xy", grid, units, sides, log, strict=True):
        axis.set(**{f"{name}label": label(side, unit)})
        if is_log:
            axis.set(**{f"{name}scale": "log"})
            _write_numbers(axis.xaxis if name == "x" else axis.yaxis, values[-1] / values[0])
        axis.set(**{f"{name}lim": values[[0, -1]]})
    axis.tick_params(which="both", color="#333333")
    halo = patheffects.withStroke(linewidth=2.5, foreground="white", alpha=0.8)
    for word, x, y in region_names(dataset):
        axis.text(
            x, y, word, transform=axis.transAxes, ha="center", va="center", zorder=5,
            path_effects=[halo],
        )  # fmt: skip
    return mesh


def colours(dataset: xarray.Dataset, show: str) -> Normalize:
    """The colour scale."""
    values = dataset[show].values
    values = values[np.isfinite(values)]
    if show in _CYCLIC:
        return Normalize(-np.pi, np.pi)
    low, high = np.quantile(values, _SPAN) if values.size else (0.0, 1.0)
    if show in _SIGNED:
        middle = 1.0 if show == "floquet_max" else 0.0
        reach = max(abs(low - middle), abs(high - middle)) or 1.0
        return CenteredNorm(middle, halfrange=reach)
    if low > 0 and high > _DECADES * low:
        # An amplitude that is zero at some points has the colour of the smallest one that is not.
        return LogNorm(values[values > 0].min(), values.max(), clip=True)
    return Normalize(values.min(), values.max()) if values.size else Normalize(0.0, 1.0)


def keys(dataset: xarray.Dataset) -> list[Any]:
    """Entries of the legend: the kinds of bifurcation in the map, and other lines."""
    on_lines = dataset["boundary_line"].values >= 0
    kinds = set(dataset["boundary_kind"].values.astype(str)[on_lines])
    entries: list[Any] = [
        Line2D([], [], color=_LINE, linestyle=line, label=_KIND_NAMES.get(kind, kind))
        for kind, line in KIND_LINES.items()
        if kind in kinds
    ]
    if critical_line(dataset) is not None:
        entries.append(Line2D([], [], label="$K=K_c$ (unmodulated)", **_UNMODULATED))
    if not dataset["converged"].values.all():
        entries.append(Patch(label="no response", **_FAILED))
    if dataset["reverses"].values.any():
        entries.append(Patch(label="slip would reverse", **_REVERSES))
    return entries


def axis_unit(side: xarray.DataArray) -> tuple[float, str]:
    """Factor and name of the unit in which an axis reads best."""
    unit, power = display_unit(float(np.max(side.values)), side.attrs["units"])
    return 10.0**power, "" if unit == "1" else unit


def label(side: xarray.DataArray, unit: tuple[float, str]) -> str:
    """Meaning, symbol and unit of a quantity."""
    known: Any = known_quantities().get(str(side.name))
    # Matplotlib has no names for these bars.
    letters = "" if known is None else re.sub(r"\\[lr]vert ?", "|", known.symbol)
    symbol = f" ${letters}$" if letters else ""
    meaning = re.split(r": | \(|, ", side.attrs.get("long_name", str(side.name)))[0]
    meaning = re.sub(r"\b((?:F/)?[VW])0\b", r"$\1_0$", meaning)
    name = "rad" if getattr(known, "angle", False) else unit[1].replace("*", " ")
    return f"{meaning}{symbol}" + (f" ({name})" if name not in ("", "1") else "")


def _write_numbers(axis: Axis, ratio: float) -> None:
    """Plain numbers on a logarithmic axis, also between decades if there are few decades."""
    few = ratio < _FEW_DECADES

    def text(value: float, position: int | None = None) -> str:
        digit = round(value / 10 ** np.floor(np.log10(value) + 1e-9))
        return f"{value:g}" if digit == 1 or (few and digit in (2, 3, 5)) else ""

    axis.set_major_formatter(FuncFormatter(text))
    axis.set_minor_formatter(FuncFormatter(text))


def _edges(values: Float, log: bool) -> Float:
    """Borders of the cells around the points of the grid."""
    v = np.log(values) if log else values
    half = np.diff(v)[[0, -1]] / 2
    edges = np.concatenate([[v[0] - half[0]], (v[1:] + v[:-1]) / 2, [v[-1] + half[1]]])
    return np.exp(edges) if log else edges


def _colour_map(show: str) -> Any:
    if show in _CYCLIC:
        return cm.romaO
    if show in _SIGNED:
        return cm.vik
    return cm.batlow_r if show == "delta_mu" else cm.batlow


def _hatch(axis: Axes, grid: list[Float], region: Bool, look: dict[str, Any]) -> None:
    if region.any():
        hatched = axis.contourf(
            *grid, region.astype(float), levels=[0.5, 1.5], colors="none", hatches=[look["hatch"]]
        )
        hatched.set_edgecolor(look["edgecolor"])
        hatched.set_linewidth(0.0)


def _draw_boundary(axis: Axes, dataset: xarray.Dataset, units: list[tuple[float, str]]) -> None:
    lines = dataset["boundary_line"].values
    kinds = dataset["boundary_kind"].values.astype(str)
    x, y = (
        dataset[f"boundary_{dataset.attrs[s]}"].values / u[0]
        for s, u in zip("xy", units, strict=True)
    )
    halo = [patheffects.Stroke(linewidth=3.4, foreground="white", alpha=0.8), patheffects.Normal()]
    for number in range(lines.max(initial=-1) + 1):
        (index,) = np.nonzero(lines == number)
        for start, end, kind in _runs(kinds[index]):
            part = index[start:end]
            axis.plot(
                x[part], y[part], color=_LINE, linestyle=KIND_LINES.get(kind, "solid"),
                path_effects=halo, zorder=4, solid_capstyle="butt", dash_capstyle="butt",
            )  # fmt: skip


def _runs(kinds: NDArray[np.str_]) -> list[tuple[int, int, str]]:
    """Stretches of one kind, each up to the first point of the next, so that no gap is left."""
    changes = np.flatnonzero(kinds[1:] != kinds[:-1]) + 1
    starts = [0, *changes.tolist()]
    ends = [min(k + 1, len(kinds)) for k in [*changes.tolist(), len(kinds)]]
    return [(a, b, str(kinds[a])) for a, b in zip(starts, ends, strict=True)]


def region_names(dataset: xarray.Dataset) -> list[tuple[str, float, float]]:
    """The words stable and unstable, each where its region is widest: shares of both axes."""
    solved = dataset["converged"].values.astype(bool)
    stable = dataset["stable"].values.astype(bool)
    room = _ROOM * min(stable.shape)
    places = []
    for word, region in (("stable", solved & stable), ("unstable", solved & ~stable)):
        depth = np.asarray(distance_transform_edt(np.pad(region, 1)))[1:-1, 1:-1]
        if depth.max() < room:
            continue
        row, column = np.unravel_index(np.argmax(depth), depth.shape)
        places.append((word, (column + 0.5) / stable.shape[1], (row + 0.5) / stable.shape[0]))
    return places


def _extend(dataset: xarray.Dataset, show: str, mesh: QuadMesh) -> str:
    """Which ends of the colour bar stand for values beyond it."""
    values = dataset[show].values[np.isfinite(dataset[show].values)]
    if not values.size or mesh.norm.vmin is None or mesh.norm.vmax is None:
        return "neither"
    below, above = values.min() < mesh.norm.vmin, values.max() > mesh.norm.vmax
    return {(1, 1): "both", (1, 0): "min", (0, 1): "max"}.get((int(below), int(above)), "neither")
