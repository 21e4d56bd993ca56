"""A map as a labelled dataset: responses on the grid, the boundary, sources of the numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray

from asperity._version import __version__
from asperity.parameters import OUTPUTS, point_parameters
from asperity.sweep.map.boundary import MapBoundary
from asperity.sweep.map.critical import critical_stiffness_along
from asperity.sweep.map.plane import MapPlane, PointResponses

#: Names of the numbers on the grid, which a picture can show.
SHOWN = (
    "mean_friction",
    "delta_mu",
    "mu1",
    "mu2",
    "phase1",
    "phase2",
    "floquet_max",
    "log_multiplier",
    "mode_frequency",
    "growth_rate",
)

_POINT = "boundary_point"
_CONVENTION = "F/W0 = mean + sum mu_n cos(n w t + phase_n), w(t) = 1 + eps cos(w t)"


def as_dataset(
    plane: MapPlane, grid: PointResponses, boundary: MapBoundary, origins: Mapping[str, str]
) -> xarray.Dataset:
    """The dataset of a map: grid, boundary, fixed numbers.

    Parameters
    ----------
    plane : MapPlane
    grid : PointResponses
    boundary : MapBoundary
    origins : mapping of str to str
        Source of each fixed number, where known.
    """
    dims = (plane.y.name, plane.x.name)
    nodes = plane.nodes()
    frequency = plane.values(nodes)["frequency"]
    derived = _derived(grid, frequency)
    data: dict[str, Any] = {
        name: (dims, derived[name].reshape(plane.shape), OUTPUTS[name].attributes) for name in SHOWN
    }
    for name, values in (
        # Strings of fixed width: NetCDF has no Python objects.
        ("mode", grid.mode.astype(str)),
        ("stable", grid.stable),
        ("converged", grid.converged),
        ("result", grid.result.astype(str)),
    ):
        data[name] = (dims, values.reshape(plane.shape), OUTPUTS[name].attributes)
    data |= _boundary(plane, boundary)
    for side, values in critical_stiffness_along(plane).items():
        data["critical_stiffness"] = (
            side,
            values,
            _described("N/m", "K_c of unmodulated sliding"),
        )
    return xarray.Dataset(
        data, coords=_coordinates(plane, origins), attrs=_global_attributes(plane, boundary)
    )


def _boundary(plane: MapPlane, boundary: MapBoundary) -> dict[str, Any]:
    where, points = boundary.where, boundary.points
    values = plane.values(where)
    derived = _derived(points, values["frequency"])
    found = boundary.line >= 0
    kinds = np.where(found, points.mode, "")
    named: dict[str, Any] = {
        "boundary_line": (
            _POINT,
            boundary.line,
            _described("1", "line of the point; -1: not found"),
        ),
        "boundary_kind": _texts((_POINT,), kinds, "bifurcation on the stability boundary"),
        "boundary_result": _texts((_POINT,), boundary.reason, "converged, or why not found"),
    }
    for axis in (plane.x, plane.y):
        attributes = _described(axis.unit or "1", f"{axis.name} on the stability boundary")
        named[f"boundary_{axis.name}"] = (_POINT, values[axis.name], attributes)
    for name in ("mode_frequency", "log_multiplier"):
        attributes = _described(OUTPUTS[name].unit, f"{OUTPUTS[name].meaning}, on the boundary")
        named[f"boundary_{name}"] = (_POINT, derived[name], attributes)
    return named


def _derived(points: PointResponses, frequency: np.ndarray) -> dict[str, np.ndarray]:
    log = points["log_multiplier"]
    found = {name: points[name] for name in SHOWN if name not in _DERIVED}
    with np.errstate(over="ignore"):
        found["floquet_max"] = np.exp(log)
    found["mode_frequency"] = np.abs(points["multiplier_argument"]) / (2 * np.pi) * frequency
    found["growth_rate"] = log * frequency
    return found


_DERIVED = ("floquet_max", "mode_frequency", "growth_rate")


def _coordinates(plane: MapPlane, origins: Mapping[str, str]) -> dict[str, Any]:
    known = point_parameters(plane.law)
    found: dict[str, Any] = {
        axis.name: (axis.name, axis.values, known[axis.name].attributes)
        for axis in (plane.x, plane.y)
    }
    for name, value in plane.fixed.items():
        attributes = dict(known[name].attributes)
        if name in origins:
            attributes["origin"] = origins[name]
        found[name] = ((), value, attributes)
    return found


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
        # Chords of the boundary that may deviate from it by more than 1e-4 of the axes.
        "boundary_unresolved_chords": boundary.unresolved,
    }


def _described(unit: str, name: str) -> dict[str, str]:
    return {"units": unit, "long_name": name}


def _texts(dims: tuple[str, ...], values: np.ndarray, name: str) -> tuple:
    return dims, values.astype(str), _described("1", name)
