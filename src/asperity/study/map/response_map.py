"""A map of the response and its stability over two numbers of the operating point."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.errors import InputError
from asperity.laws import get_law
from asperity.study.map.axis import Axis
from asperity.study.map.boundary import trace_boundary
from asperity.study.map.dataset import as_dataset
from asperity.study.map.grid import BLOCK, interrupted, kept_beside, solve_grid, solve_grid_kept
from asperity.study.map.plane import Plane
from asperity.study.operating_point import (
    Sourced,
    all_quantities,
    numbers_for,
    quantities,
    refuse_foreign,
)

if TYPE_CHECKING:
    import xarray


def response_map(
    law: str,
    numbers: Mapping[str, Any],
    *,
    x: Axis,
    y: Axis,
    progress: Callable[[int, int], None] | None = None,
) -> xarray.Dataset:
    """Response and stability on a grid over two numbers, and the stability boundary between.

    Parameters
    ----------
    law : str
        Name of a registered law.
    numbers : mapping of str to float, str or Sourced
        The other numbers of the operating point by name (`asperity.study.operating_point`), SI or
        texts with units: parameters of the law, ``K, W0, M, eta, V, epsilon, frequency``, and
        ``inertia=1`` where the mass is to count. What the law has no use for is passed over.
    x, y : Axis
        The numbers that vary; any two.
    progress : callable, optional
        Told the number of points done so far and of all points.

    Returns
    -------
    xarray.Dataset
        On the dimensions (y, x): `asperity.study.map.SHOWN`, ``mode``, ``stable``, ``converged``
        and ``result``; a point that failed has NaN and its reason in ``result``. On
        ``boundary_point``: position (``boundary_`` and the axis' name), ``boundary_line``,
        ``boundary_kind``, ``boundary_mode_frequency`` and ``boundary_result``; line -1 holds
        places where stability changes between neighbours without a crossing, and why.
        ``critical_stiffness`` is there if K is on an axis and K_c has a closed form. Every
        variable has `units` and `long_name`; fixed numbers are scalar coordinates.

    Raises
    ------
    InputError
        If a number is missing, unknown, given twice, or breaks its rule.

    Notes
    -----
    The boundary consists of points at which ln|m| = 0 within 1e-6 of the axes; between neighbours
    it deviates from a straight line by less than 1e-4 of them, but for as many chords as the
    attribute ``boundary_loose_chords`` counts: there it bends too much for the grid. Features
    narrower than a cell that leave no trace in its corners are not seen.
    """
    plane, origins = _plane(law, numbers, x, y)
    grid = solve_grid(plane, progress or _silent)
    return as_dataset(plane, grid, trace_boundary(plane, grid), origins)


def write_map(
    out: Path,
    law: str,
    numbers: Mapping[str, Any],
    *,
    x: Axis,
    y: Axis,
    resume: bool = False,
    progress: Callable[[int, int], None] | None = None,
    block: int = BLOCK,
) -> xarray.Dataset:
    """`response_map` to a NetCDF file; an interruption costs no finished block.

    Parameters
    ----------
    out : Path
        Appears when everything is done; finished blocks wait in ``OUT.partial``.
    law, numbers, x, y, progress
        As for `response_map`.
    resume : bool
        Go on after an interruption; without one, start from the first point.
    block : int
        Points solved and kept at a time.

    Raises
    ------
    InputError
        As `response_map`, and if `out` cannot be written.
    MapInterrupted
        On Ctrl-C.
    """
    plane, origins = _plane(law, numbers, x, y)
    target = _checked_target(out)
    kept = kept_beside(target, plane)
    grid = solve_grid_kept(plane, kept, resume, progress or _silent, block)
    try:
        found = as_dataset(plane, grid, trace_boundary(plane, grid), origins)
        _write(found, target)
    except KeyboardInterrupt:
        raise interrupted(kept, len(grid.converged)) from None
    kept.path.unlink(missing_ok=True)
    kept.record.unlink(missing_ok=True)
    return found


def _plane(law: str, numbers: Mapping[str, Any], x: Axis, y: Axis) -> tuple[Plane, dict[str, str]]:
    """Check what was asked."""
    if x.name == y.name:
        raise InputError(
            f"axes must be two numbers, got '{x.name}' on both; choose another one for y"
        )
    refuse_foreign(law, {x.name: "", y.name: ""})
    for axis in (x, y):
        if axis.name in numbers:
            raise InputError(
                f"{axis.name} must be given once, got an axis and a fixed value; leave one out"
            )
    known = all_quantities()
    given = {
        name: value
        if isinstance(value, Sourced)
        else Sourced(float(known[name].check(value)), "given")
        for name, value in numbers.items()
        if name in known
    }
    given |= {axis.name: Sourced(float(axis.low), "axis") for axis in (x, y)}
    own = numbers_for(law, given)
    defaults = {
        name: Sourced(quantity.default, "default")
        for name, quantity in quantities(get_law(law)).items()
        if quantity.default is not None
    }
    fixed = {n: s for n, s in (defaults | own).items() if n not in (x.name, y.name)}
    plane = Plane(get_law(law), {n: s.value for n, s in fixed.items()}, x, y)
    plane.values(plane.nodes()[:1])
    return plane, {n: s.origin for n, s in fixed.items()}


def _checked_target(out: Path) -> Path:
    """Where the file goes, links followed; a folder that cannot hold it is told before solving."""
    target = out.resolve()
    if (target.exists() and not target.is_file()) or not target.parent.is_dir():
        raise InputError(
            f"out must be a file in a folder that exists, got '{out}'; write it like 'map.nc'"
        )
    return target


def _write(found: xarray.Dataset, target: Path) -> None:
    """To a file beside the target first: nobody finds half a map."""
    fresh = target.with_name(target.name + ".new")
    try:
        found.to_netcdf(fresh, engine="h5netcdf")
        fresh.replace(target)
    except OSError as error:
        raise InputError(
            f"out must be a file that can be written, got '{target}' ({error.strerror}); "
            "choose a folder that exists, is writable and has room"
        ) from None
    finally:
        with contextlib.suppress(OSError):
            fresh.unlink(missing_ok=True)


def _silent(done: int, total: int) -> None:
    """Progress that nobody asked for."""
