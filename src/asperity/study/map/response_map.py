"""A map of the response and its stability over two numbers of the operating point."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from asperity.errors import InputError, require, symbol
from asperity.laws import get_law
from asperity.operating_point import SourcedNumber, numbers_for, refuse_foreign, sourced_numbers
from asperity.outputs import UnfinishedText, output_file, require_memory, written_file
from asperity.parameters import MODULATION, point_parameters
from asperity.parameters.arguments import FilePath, counted, typed
from asperity.study.map.boundary import MapBoundary, trace_boundary
from asperity.study.map.dataset import as_dataset
from asperity.study.map.plane import OUTPUTS, Axis, MapPlane
from asperity.study.points import Answers
from asperity.units import KINDS

if TYPE_CHECKING:
    import xarray

#: Points of a chunk, the most that an interruption loses: five batches of the fast method.
_CHUNK = 4800
#: Memory of a point with its share of the boundary and of the file (bytes); without these measured
#: 250 to 300 (largest resident memory, 250,000 to 2,250,000 points).
_POINT_BYTES = 500.0


@typed
def response_map(
    law: str,
    numbers: Mapping[str, Any],
    *,
    x: Axis,
    y: Axis,
    boundary: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> xarray.Dataset:
    """Response and stability on a grid over two numbers, and the stability boundary.

    Parameters
    ----------
    law : str
        Name of a registered law.
    numbers : mapping of str to float, str or SourcedNumber
        The other numbers of the operating point by name (`asperity.parameters`), SI or
        texts with units: parameters of the law, ``K, W0, M, eta, V, epsilon, frequency``,
        ``inertia=1`` to include the mass, and `asperity.parameters.MODULATION`. Parameters of other
        laws only are ignored.
    x, y : Axis
        The two numbers that vary.
    boundary : bool
        Whether to search for the stability boundary, which takes longer than a coarse grid.
        Without it the dimension ``boundary_point`` has length 0.
    progress : callable, optional
        Called with the number of points done so far and of all points.

    Returns
    -------
    xarray.Dataset
        On the dimensions (y, x): `asperity.study.map.SHOWN`, ``mode``, ``stable``, ``converged``
        and ``result``; a point that failed has NaN and its reason in ``result``. On
        ``boundary_point``: position (``boundary_`` and the axis' name), ``boundary_line``,
        ``boundary_kind``, ``boundary_mode_frequency`` and ``boundary_result``. Points of line -1
        are places where stability changes between neighbours of the grid but no crossing was
        located; their ``boundary_result`` is the reason. ``critical_stiffness`` is present if K is
        on an axis and K_c has a closed form. Every variable has `units` and `long_name`; fixed
        numbers are scalar coordinates.

    Raises
    ------
    InputError
        If a number is missing, unknown, given twice, or breaks its rule.

    Examples
    --------
    >>> import asperity as asp
    >>> from asperity.study.map import Axis
    >>> pmma = asp.materials.load("bureau2000")
    >>> numbers = {n: pmma[n].si for n in ("mu0", "A", "B", "D0", "V0", "W0")}
    >>> numbers |= {"V": "1 um/s", "epsilon": 0.2}
    >>> x, y = Axis("frequency", "1 Hz", "50 Hz", 12), Axis("K", "0.1 N/um", "0.6 N/um", 10)
    >>> print(asp.map("rice-ruina", numbers, x=x, y=y).stable)

    Notes
    -----
    The position of a boundary point, ln|m| = 0, is accurate to 1e-6 of the axes. Between
    neighbouring points the boundary deviates from a straight line by less than 1e-4 of the axes;
    the attribute ``boundary_unresolved_chords`` counts the exceptions, where the boundary bends too
    much for the grid. A feature inside a cell whose corners have the same stability is not
    detected.
    """
    plane, origins = _plane(law, numbers, x, y)
    grid = _solved(plane, None, progress, _CHUNK)
    traced = trace_boundary(plane, grid) if boundary else MapBoundary.empty()
    return as_dataset(plane, grid, traced, origins)


@typed
def write_map(
    out: FilePath,
    law: str,
    numbers: Mapping[str, Any],
    *,
    x: Axis,
    y: Axis,
    resume: bool = False,
    progress: Callable[[int, int], None] | None = None,
    block: int = _CHUNK,
) -> xarray.Dataset:
    """`response_map` to a NetCDF file; an interruption keeps the finished chunks.

    Parameters
    ----------
    out : Path
        Written when all points are solved; until then finished chunks are in ``OUT.partial``.
    law, numbers, x, y, progress
        As for `response_map`.
    resume : bool
        Whether to continue an interrupted map, if there is one.
    block : int
        Number of points of a chunk.

    Raises
    ------
    InputError
        As for `response_map`, and if `out` cannot be written.
    Interrupted
        On Ctrl-C.
    """
    plane, origins = _plane(law, numbers, x, y)
    target = output_file(out, example="map.nc")
    axes = {name: dataclasses.asdict(getattr(plane, name)) for name in ("x", "y")}
    inputs = {"law": plane.law.name, "numbers": dict(plane.fixed), **axes}
    unfinished = UnfinishedText(target, inputs)
    unfinished.start(resume)
    count = x.count * y.count
    with unfinished.interruptible(lambda: f"{unfinished.rows} of {count} points"):
        grid = _solved(plane, unfinished, progress, block)
        dataset = as_dataset(plane, grid, trace_boundary(plane, grid), origins)
        with written_file(target) as file:
            dataset.to_netcdf(file, engine="h5netcdf")
    unfinished.discard()
    return dataset


def _solved(
    plane: MapPlane,
    unfinished: UnfinishedText | None,
    progress: Callable[[int, int], None] | None,
    chunk: int,
) -> Answers:
    """Responses at the points of the grid; `unfinished` has a line for each point solved before."""
    nodes = plane.nodes()
    grid = Answers.empty(OUTPUTS, len(nodes))
    if unfinished is not None:
        for i, row in enumerate(csv.reader(unfinished.text().splitlines())):
            *numbers, outcome, detail = row
            for name, cell in zip(OUTPUTS, numbers, strict=True):
                grid.numbers[name][i] = float(cell)
            grid.outcome[i], grid.detail[i] = int(outcome), float(detail)

    done = 0 if unfinished is None else unfinished.rows
    advance = counted(progress, len(nodes), done)
    advance(0)
    for start in range(done, len(nodes), chunk):
        part = plane.solve(nodes[start : start + chunk], advance)
        grid.put(slice(start, start + chunk), part)
        if unfinished is not None:
            columns: list[Any] = [*part.numbers.values(), part.outcome, part.detail]
            unfinished.append_rows(list(zip(*(c.tolist() for c in columns), strict=True)))
    return grid


def _plane(
    law: str, numbers: Mapping[str, Any], x: Axis, y: Axis
) -> tuple[MapPlane, dict[str, str]]:
    """The checked plane, and the origin of each fixed number."""
    rule = "be two numbers"
    require(
        x.name != y.name, "axes", rule, f"'{symbol(x.name)}' on both", "choose another one for y"
    )
    refuse_foreign(law, {x.name: "", y.name: ""})
    known = point_parameters(get_law(law))
    known_numbers = sourced_numbers(numbers, None, law=law)
    for axis in (x, y):
        if axis.kind != known[axis.name].kind:
            rule = f"be {KINDS[known[axis.name].kind].noun} for {law}"
            advice = "another registered law has a parameter of that name"
            raise InputError(f"axis of {symbol(axis.name)}", rule, KINDS[axis.kind].noun, advice)
        rule, got = "be given once", "an axis and a fixed value"
        require(axis.name not in known_numbers, symbol(axis.name), rule, got, "leave one out")
    known_numbers |= {axis.name: SourcedNumber(float(axis.low), "axis") for axis in (x, y)}
    of_law = numbers_for(law, known_numbers)
    defaults = {
        name: SourcedNumber(parameter.default, "default")
        for name, parameter in known.items()
        # The default of a modulation is none, which needs no coordinate.
        if parameter.default is not None and name not in MODULATION
    }
    require_memory(
        x.count * y.count * _POINT_BYTES, "axes", f"{x.count:,} x {y.count:,} points",
        "take fewer, or asperity sweep, which keeps none in memory",
    )  # fmt: skip
    fixed = {n: s for n, s in (defaults | of_law).items() if n not in (x.name, y.name)}
    plane = MapPlane(get_law(law), {n: s.value for n, s in fixed.items()}, x, y)
    plane.values(plane.nodes()[:1])
    return plane, {n: s.origin for n, s in fixed.items()}
