"""Figure of a slice of a sweep's store."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from cmcrameri import cm
from matplotlib.colors import CenteredNorm
from matplotlib.figure import Figure

from asperity.errors import InputError, closest
from asperity.figures.style import new_figure
from asperity.study import open_store


def plot_slice(
    store: str | os.PathLike[str],
    show: str,
    *,
    x: str,
    y: str | None = None,
    at: Mapping[str, Any] | None = None,
) -> Figure:
    """Draw an output of a sweep over one or two of its axes.

    Parameters
    ----------
    store : path
    show : str
        An output of the store.
    x, y : str
        Axes of the picture; a curve without `y`.
    at : mapping of str to float or int, optional
        Positions on the other axes: the nearest value of an axis with labels, the number of the row
        of another; the first row by default.

    Raises
    ------
    InputError
        If the store has no such output or axis.
    """
    result = open_store(store)
    outputs = [str(n) for n, v in result.data_vars.items() if x in v.dims or len(v.dims) > 0]
    if show not in outputs:
        raise InputError(f"show must be an output, got '{show}'; {closest(show, outputs)}")
    part = result[show]
    dims = [str(d) for d in part.dims]
    for name, side in (("x", x), ("y", y)):
        if side is not None and side not in dims:
            raise InputError(f"{name} must be an axis of the store, got '{side}'; "
                             f"{closest(side, dims)}")  # fmt: skip
    chosen = dict(at or {})
    for name in chosen:
        if name not in dims or name in (x, y):
            raise InputError(f"at must name other axes, got '{name}'; {closest(name, dims)}")
    for dim in dims:
        if dim in (x, y):
            continue
        labelled = dim in part.indexes and np.issubdtype(part[dim].dtype, np.number)
        if labelled and dim in chosen:
            part = part.sel({dim: float(chosen[dim])}, method="nearest")
        else:
            part = part.isel({dim: int(chosen.get(dim, 0))})
    figure = new_figure(4.4, 3.4)
    axis = figure.subplots()
    label = f"{part.attrs.get('long_name', show)} ({part.attrs.get('units', '1')})"
    across = _values(part, x)
    if y is None:
        axis.plot(across, part.values)
        axis.set_ylabel(label)
    else:
        values = part.transpose(y, x).values
        signed = np.nanmin(values) < 0 < np.nanmax(values)
        mesh = axis.pcolormesh(
            across,
            _values(part, y),
            values,
            cmap=cm.vik if signed else cm.batlow,
            norm=CenteredNorm() if signed else None,
            shading="nearest",
            rasterized=True,
        )
        figure.colorbar(mesh, ax=axis, pad=0.02).set_label(label)
        axis.set_ylabel(_label(part, y))
        _scale(axis.set_yscale, _values(part, y))
    axis.set_xlabel(_label(part, x))
    _scale(axis.set_xscale, across)
    fixed = {str(n): part[n] for n in part.coords if n not in (x, y) and part[n].ndim == 0}
    shown = [n for n in dims if n in fixed]
    if shown:
        axis.set_title(", ".join(f"{n} = {fixed[n].values:.4g}" for n in shown), fontsize="small")
    return figure


def _values(part: Any, dim: str) -> np.ndarray:
    """Labels of an axis, or the numbers of its rows."""
    labelled = dim in part.indexes and np.issubdtype(part[dim].dtype, np.number)
    return np.asarray(part[dim].values if labelled else np.arange(part.sizes[dim]))


def _label(part: Any, dim: str) -> str:
    if dim not in part.indexes:
        return f"row of {dim}"
    about = part[dim].attrs
    unit = about.get("units", "1")
    return f"{about.get('long_name', dim)}" + ("" if unit == "1" else f" ({unit})")


def _scale(set_scale: Any, values: np.ndarray) -> None:
    """Logarithmic where the labels lie at equal ratios."""
    if len(values) > 2 and (values > 0).all():
        steps, ratios = np.diff(values), np.diff(np.log(values))
        if np.ptp(ratios) < 1e-6 * abs(ratios).max() and np.ptp(steps) > 1e-6 * abs(steps).max():
            set_scale("log")
