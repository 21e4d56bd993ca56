"""Figure of a slice of a sweep's store."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from cmcrameri import cm
from matplotlib.figure import Figure

from asperity.errors import Argument, InputError, closest, require, require_known
from asperity.figures.map import axis_unit, label
from asperity.figures.style import new_figure, reason_of_gaps
from asperity.parameters import MODULATION
from asperity.parameters.arguments import file_path, number
from asperity.study.points import SweepOutcome, reasons
from asperity.study.results import dataset_of
from asperity.study.store.store import SweepStore
from asperity.units import KINDS, to_radians

#: Characters of a line above the picture.
_CHARACTERS = 66


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
    at : mapping of str to float, int or str, optional
        Positions on the other axes: the nearest value of an axis with labels, in SI or a text with
        its unit, or the number of the row of another axis; the first row by default.

    Raises
    ------
    InputError
        If the store has no such output or axis, an axis of the picture has one row only, or a chunk
        of the slice is damaged.
    """
    opened = SweepStore(file_path(store, "store"), mode="r")
    require_known(show, list(opened.arrays), "show", "be an output")
    part = dataset_of(opened)[show]
    dims = [str(d) for d in part.dims]
    for name, side in (("x", x), ("y", y)):
        if side is not None:
            require_known(side, dims, name, "be an axis of the store")
    require(x != y, "y", "be another axis than x", f"'{y}' for both", "leave it out for a curve")
    chosen = dict(at or {})
    others = [dim for dim in dims if dim not in (x, y)]
    for name in chosen:
        advice = closest(name, others) if others else "leave it out"
        require(name in others, "at", "name another axis than x and y", f"'{name}'", advice)
    numbered = {d: d in part.indexes and part[d].dtype.kind in "if" for d in dims}
    rows = {}
    for i, dim in enumerate(dims):
        if dim in chosen and numbered[dim]:
            position = _in_si(chosen[dim], part[dim].attrs.get("units", "1"), dim)
            rows[i] = int(np.nanargmin(np.abs(part[dim].values - position)))
        elif dim not in (x, y):
            row, count = _in_si(chosen.get(dim, 0), "1", dim), part.sizes[dim]
            whole, advice = row in range(count), "give the number of a row"
            require(whole, "at", f"be a row from 0 to {count - 1} of {dim}", f"{row:g}", advice)
            rows[i] = int(row)
    values, outcome, detail = (opened.part(name, rows) for name in (show, "outcome", "detail"))
    codes = np.nan_to_num(outcome, nan=SweepOutcome.NOT_COMPUTED).astype(int)
    failed = codes != SweepOutcome.CONVERGED
    part = part.isel({dims[i]: row for i, row in rows.items()}).copy(data=values)
    for side in filter(None, (x, y)):
        if numbered[side]:
            # In rising order, without the rows that have no number, which are sorted to the end.
            order = np.argsort(part[side].values, kind="stable")
            part = part.isel({side: order[: int(part[side].notnull().sum())]})
        else:
            part = part.assign_coords({side: (side, range(part.sizes[side]))})
            part[side].attrs |= {"long_name": f"row of {side}", "units": "1"}
        rule, advice = "be an axis of several rows", "draw over another axis"
        require(part.sizes[side] > 1, "x" if side == x else "y", rule, f"'{side}' of one", advice)
    # Titles name the position on the other axes; a pure number needs no unit.
    part = part.drop_vars([n for n, c in part.coords.items() if c.ndim == 0 and n not in dims])
    units = {side: axis_unit(part[side]) for side in (x, y) if side is not None}
    labels = {side: label(part[side], unit) for side, unit in units.items()}
    shown = label(part, (1.0, part.attrs["units"]))
    part = part.assign_coords({side: part[side] / unit[0] for side, unit in units.items()})
    options: dict[str, Any] = {"xscale": _scale(part[x].values)}
    figure = new_figure(4.4, 3.4)
    axis = figure.subplots()
    if y is None:
        part.plot.line(x=x, ax=axis, **options)
        axis.set_ylabel(shown)
    else:
        options |= {"yscale": _scale(part[y].values), "rasterized": True, "cmap": cm.batlow}
        if part.min() < 0 < part.max():
            options |= {"cmap": cm.vik, "center": 0.0}
        part.plot.pcolormesh(x=x, y=y, ax=axis, cbar_kwargs={"label": shown}, **options)
        axis.set_ylabel(labels[y])
    axis.set_xlabel(labels[x])
    if failed.any():
        text = reason_of_gaps(failed, reasons(codes, detail), _CHARACTERS)
        figure.suptitle(text, fontsize="small")
    return figure


def _in_si(value: Any, unit: str, dim: str) -> float:
    """A position in SI; a text has its unit, or is a number in SI (an angle in rad)."""
    kind = next(name for name, kind in KINDS.items() if (kind.si or "1") == unit)
    with suppress(ValueError):
        value = float(value)
    try:
        if dim in MODULATION and MODULATION[dim].angle:
            value = to_radians(value, "")
        return number(value, "", kind)
    except InputError as error:
        raise error.about(Argument("at", key=dim)) from None


def _scale(values: np.ndarray) -> str:
    """Logarithmic where the labels lie at equal ratios."""
    if len(values) > 2 and (values > 0).all():
        steps, ratios = np.diff(values), np.diff(np.log(values))
        if np.ptp(ratios) < 1e-6 * abs(ratios).max() and np.ptp(steps) > 1e-6 * abs(steps).max():
            return "log"
    return "linear"
