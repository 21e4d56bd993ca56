"""A map as a labelled dataset: responses on the grid, the boundary, and where numbers are from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray

from asperity._version import __version__
from asperity.study.map.boundary import Boundary
from asperity.study.map.critical import critical_stiffness_along
from asperity.study.map.plane import Plane, Points
from asperity.study.operating_point import quantities

#: Quantities on the grid, and what they are.
SHOWN = {
    "mean_friction": ("1", "mean of F/W0"),
    "delta_mu": ("1", "change of the mean by the modulation"),
    "mu1": ("1", "first harmonic of F/W0, peak"),
    "mu2": ("1", "second harmonic of F/W0, peak"),
    "phase1": ("rad", "phase of the first harmonic"),
    "phase2": ("rad", "phase of the second harmonic"),
    "floquet_max": ("1", "largest modulus of the multipliers"),
    "log_multiplier": ("1", "logarithm of the largest modulus of the multipliers"),
    "mode_frequency": ("Hz", "frequency of the leading mode, modulo f"),
    "growth_rate": ("1/s", "growth rate of the leading mode"),
}

_POINT = "boundary_point"
_CONVENTION = "F/W0 = mean + sum mu_n cos(n w t + phase_n), w(t) = 1 + eps cos(w t)"


def as_dataset(
    plane: Plane, grid: Points, boundary: Boundary, origins: Mapping[str, str]
) -> xarray.Dataset:
    """Everything that a map found.

    Parameters
    ----------
    plane : Plane
    grid : Points
    boundary : Boundary
    origins : mapping of str to str
        Where each fixed number comes from, as far as it is known.
    """
    dims = (plane.y.name, plane.x.name)
    nodes = plane.nodes()
    frequency = plane.values(nodes)["frequency"]
    derived = _derived(grid, frequency)
    data: dict[str, Any] = {
        name: (dims, derived[name].reshape(plane.shape), _told(*SHOWN[name])) for name in SHOWN
    }
    data["mode"] = _texts(dims, grid.mode.reshape(plane.shape), "bifurcation of the leading mode")
    for name, flags, meaning in (
        ("stable", grid.stable, "all multipliers inside the unit circle"),
        ("converged", grid.converged, "whether the point was solved"),
    ):
        data[name] = (dims, flags.reshape(plane.shape), _told("1", meaning))
    data["result"] = _texts(dims, grid.result.reshape(plane.shape), "converged, or why not")
    data |= _boundary(plane, boundary)
    for side, values in critical_stiffness_along(plane).items():
        data["critical_stiffness"] = (side, values, _told("N/m", "K_c of unmodulated sliding"))
    return xarray.Dataset(
        data, coords=_coordinates(plane, origins), attrs=_attributes(plane, boundary)
    )


def _boundary(plane: Plane, boundary: Boundary) -> dict[str, Any]:
    where, points = boundary.where, boundary.points
    values = plane.values(where)
    derived = _derived(points, values["frequency"])
    found = boundary.line >= 0
    kinds = np.where(found, points.mode, "")
    named: dict[str, Any] = {
        "boundary_line": (_POINT, boundary.line, _told("1", "line of the point; -1: not found")),
        "boundary_kind": _texts((_POINT,), kinds, "bifurcation on the stability boundary"),
        "boundary_result": _texts((_POINT,), boundary.reason, "converged, or why not found"),
    }
    for axis in (plane.x, plane.y):
        told = _told(axis.unit or "1", f"{axis.name} on the stability boundary")
        named[f"boundary_{axis.name}"] = (_POINT, values[axis.name], told)
    for name in ("mode_frequency", "log_multiplier"):
        unit, meaning = SHOWN[name]
        told = _told(unit, f"{meaning}, on the boundary")
        named[f"boundary_{name}"] = (_POINT, derived[name], told)
    return named


def _derived(points: Points, frequency: np.ndarray) -> dict[str, np.ndarray]:
    log = points["log_multiplier"]
    found = {name: points[name] for name in SHOWN if name not in _DERIVED}
    with np.errstate(over="ignore"):
        found["floquet_max"] = np.exp(log)
    found["mode_frequency"] = np.abs(points["multiplier_argument"]) / (2 * np.pi) * frequency
    found["growth_rate"] = log * frequency
    return found


_DERIVED = ("floquet_max", "mode_frequency", "growth_rate")


def _coordinates(plane: Plane, origins: Mapping[str, str]) -> dict[str, Any]:
    units = {name: q.unit or "1" for name, q in quantities(plane.law).items()}
    found: dict[str, Any] = {
        axis.name: (axis.name, axis.values, _told(units[axis.name], axis.name))
        for axis in (plane.x, plane.y)
    }
    for name, value in plane.fixed.items():
        told = _told(units[name], name)
        if name in origins:
            told["origin"] = origins[name]
        found[name] = ((), value, told)
    return found


def _attributes(plane: Plane, boundary: Boundary) -> dict[str, Any]:
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
        # Of these chords of the boundary it is not known that they lie within 1e-4 of it.
        "boundary_loose_chords": boundary.loose,
    }


def _told(unit: str, name: str) -> dict[str, str]:
    return {"units": unit, "long_name": name}


def _texts(dims: tuple[str, ...], values: np.ndarray, name: str) -> tuple:
    # NumPy's own strings of one width: NetCDF has no objects.
    return dims, values.astype(str), _told("1", name)
