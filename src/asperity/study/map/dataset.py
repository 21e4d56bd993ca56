"""A map as a labelled dataset: responses on the grid, the boundary, sources of the numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray

from asperity._version import __version__
from asperity.arrays import Float, between
from asperity.parameters import OUTPUTS, point_parameters
from asperity.study.map.boundary import MapBoundary
from asperity.study.map.plane import SHOWN, MapPlane
from asperity.study.points import Answers
from asperity.study.responses import bifurcation_kinds, is_stable
from asperity.theory import closed_forms as cf

_POINT = "boundary_point"
#: Points of the line K = K_c: chords of K_c ~ 1/D0 leave it by less than a pixel over two decades.
_LINE = 1001
_CONVENTION = "F/W0 = mean + sum mu_n cos(n w t + phase_n), w(t) = 1 + eps cos(w t)"


def as_dataset(
    plane: MapPlane, grid: Answers, boundary: MapBoundary, origins: Mapping[str, str]
) -> xarray.Dataset:
    """The dataset of a map: grid, boundary, fixed numbers.

    Parameters
    ----------
    plane : MapPlane
    grid : Answers
    boundary : MapBoundary
    origins : mapping of str to str
        Source of each fixed number, where known.
    """
    dims = (plane.y.name, plane.x.name)
    data: dict[str, Any] = {
        name: (dims, grid[name].reshape(plane.shape), OUTPUTS[name].attributes) for name in SHOWN
    }
    for name, values in (
        # Strings of fixed width: NetCDF has no Python objects.
        ("mode", bifurcation_kinds(grid).astype(str)),
        ("stable", is_stable(grid)),
        ("reverses", grid.reverses),
        ("converged", grid.converged),
        ("result", grid.result.astype(str)),
    ):
        data[name] = (dims, values.reshape(plane.shape), OUTPUTS[name].attributes)
    data |= _boundary(plane, boundary)
    dataset = xarray.Dataset(
        data, coords=_coordinates(plane, origins), attrs=_global_attributes(plane, boundary)
    )
    if (along := _critical_stiffness(dataset)) is not None:
        side, _, Kc = along
        dataset["critical_stiffness"] = (side, Kc, _described("N/m", "K_c of unmodulated sliding"))
    return dataset


def boundary_lines(dataset: xarray.Dataset) -> list[dict[str, Any]]:
    """The lines of the boundary: positions by the names of both axes, kind and frequency."""
    names = (*(f"boundary_{dataset.attrs[side]}" for side in "xy"), "boundary_kind",
             "boundary_mode_frequency")  # fmt: skip
    number = dataset["boundary_line"].values
    return [
        {n.removeprefix("boundary_"): dataset[n].values[number == k].tolist() for n in names}
        for k in range(number.max(initial=-1) + 1)
    ]


def _boundary(plane: MapPlane, boundary: MapBoundary) -> dict[str, Any]:
    points, values = boundary.points, plane.values(boundary.where)
    kinds = np.where(boundary.line >= 0, bifurcation_kinds(points), "").astype(str)
    named: dict[str, tuple[Any, str, str]] = {
        "line": (boundary.line, "1", "line of the point; -1: not located"),
        "kind": (kinds, "1", "bifurcation on the stability boundary"),
        "result": (boundary.reason.astype(str), "1", "converged, or why not located"),
    }
    for axis in (plane.x, plane.y):
        meaning = f"{axis.name} on the stability boundary"
        named[axis.name] = values[axis.name], axis.unit or "1", meaning
    for name in ("mode_frequency", "log_multiplier"):
        output = OUTPUTS[name]
        named[name] = points[name], output.unit, f"{output.meaning}, on the boundary"
    return {
        f"boundary_{name}": (_POINT, column, _described(unit, meaning))
        for name, (column, unit, meaning) in named.items()
    }


def critical_line(dataset: xarray.Dataset) -> tuple[Float, Float] | None:
    """The line K = K_c of an unmodulated load, x and y in SI, however few points the grid has.

    None where K is on neither axis, or there is no closed form.
    """
    along = _critical_stiffness(dataset, _LINE)
    if along is None:
        return None
    _, at, Kc = along
    # Elsewhere unmodulated sliding is stable, or unstable, at any stiffness.
    known = np.isfinite(Kc) & (Kc > 0)
    pair = at[known], Kc[known]
    return pair[::-1] if dataset.attrs["x"] == "K" else pair


def _critical_stiffness(
    dataset: xarray.Dataset, count: int | None = None
) -> tuple[str, Float, Float] | None:
    """The axis of a map that is not K, `count` points along it, and K_c (N/m) there.

    By default at the points of the grid. None if K is on neither axis, or there is no closed form
    for the law with this inertia and damping.
    """
    sides = {dataset.attrs[side]: side for side in "xy"}
    if "K" not in sides:
        return None
    (other,) = (name for name in sides if name != "K")
    (low, high), log = dataset[other].values[[0, -1]], dataset.attrs[f"{sides[other]}_scale"]
    at = between(low, high, np.linspace(0, 1, count or dataset[other].size), log=log == "log")
    fixed = {str(n): float(c) for n, c in dataset.coords.items() if not c.ndim}
    values: dict[str, Any] = {**fixed, "K": 1.0, other: at}
    elastic = values.get("lambda", 0.0)
    form = cf.critical_stiffness_form(
        dataset.attrs["law"], elastic=bool(np.any(elastic)), inertia=bool(np.any(values["inertia"]))
    )
    if form is None or np.any(values["eta"] > 0):
        return None
    numbers = {n: values[n] for n in ("A", "B", "D0", "K", "W0", "V", "M")}
    numbers |= {"mu": values["mu0"], "omega": 2 * np.pi * values["frequency"]}
    Kc = np.asarray(form(cf.SmallModulation(**numbers, lambda_=elastic)))
    return other, at, np.broadcast_to(Kc, at.shape)


def _coordinates(plane: MapPlane, origins: Mapping[str, str]) -> dict[str, Any]:
    known = point_parameters(plane.law)
    coordinates: dict[str, Any] = {
        axis.name: (axis.name, axis.values, known[axis.name].attributes)
        for axis in (plane.x, plane.y)
    }
    for name, value in plane.fixed.items():
        attributes = dict(known[name].attributes)
        if name in origins:
            attributes["origin"] = origins[name]
        coordinates[name] = ((), value, attributes)
    return coordinates


def _global_attributes(plane: MapPlane, boundary: MapBoundary) -> dict[str, Any]:
    return {
        "asperity_version": __version__,
        "law": plane.law.name,
        "source": plane.law.source,
        "x": plane.x.name,
        "y": plane.y.name,
        "x_scale": "log" if plane.x.log else "linear",
        "y_scale": "log" if plane.y.log else "linear",
        "relative_tolerance": 1e-8,
        "convention": _CONVENTION,
        # Chords whose distance from the boundary may exceed 1e-4 of the axes.
        "boundary_unresolved_chords": boundary.unresolved,
    }


def _described(unit: str, name: str) -> dict[str, str]:
    return {"units": unit, "long_name": name}
