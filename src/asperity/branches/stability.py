"""Stability boundaries of the periodic response in the plane of two parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from jax.typing import ArrayLike
from numpy.typing import NDArray

from asperity._version import __version__
from asperity.branches.bifurcation import bifurcations_between
from asperity.branches.boundary import BoundaryPoint, ParameterPlane, TracedBoundary, trace_boundary
from asperity.branches.operating_point import (
    held_parameters,
    one_problem,
    start_of,
    starting_orbit,
)
from asperity.branches.parameters import fixed_as_text, moving_parameter
from asperity.branches.recorder import INTERVALS
from asperity.branches.steps import BranchOrbit, follow_branch
from asperity.errors import InputError
from asperity.loads import Modulation
from asperity.parameters.arguments import counted, function, whole_number
from asperity.parameters.display import Displayed, SummaryLine, count_text, number_line
from asperity.slider import Motion, Slider
from asperity.slider.problem import checked_slider

if TYPE_CHECKING:
    import xarray

Float = NDArray[np.float64]

#: A bifurcation this close to a boundary, in parts of the span, belongs to it.
_SAME = 2e-3
_SCAN_STEPS = 400


@dataclass(frozen=True)
class BoundaryCurve:
    """One curve of bifurcations.

    Attributes
    ----------
    kind : str
        "fold", "period doubling" or "Neimark-Sacker".
    x, y : array, shape (points,)
        Values of the two parameters along the curve, SI.
    frequency : array, shape (points,)
        Frequency of the critical mode (Hz), see `Bifurcation`; 0 at folds.
    log_multipliers : complex array, shape (points, states)
        ln|m| + i arg m of the critical orbits.
    bounds_stability : bool array, shape (points,)
        Whether all other multipliers are inside the unit circle: one side is stable.
    result : tuple of str
        Why the curve ends, at its first and at its last point.
    """

    kind: str
    x: Float
    y: Float
    frequency: Float
    log_multipliers: NDArray[np.complex128]
    bounds_stability: NDArray[np.bool_]
    result: tuple[str, str]


@dataclass(frozen=True, repr=False)
class StabilityBoundary(Displayed):
    """Curves of bifurcations in the plane of two parameters.

    Attributes
    ----------
    names, units : tuple of two str
    curves : tuple of BoundaryCurve
    motion : Motion
    fixed : dict
        Parameters that were kept fixed, SI.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    curves: tuple[BoundaryCurve, ...]
    motion: Motion
    fixed: dict[str, float]

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """The plane, and a line for each curve."""
        law = self.motion.slider.law.name
        lines = []
        for curve in self.curves:
            spans = zip(self.names, (curve.x, curve.y), strict=True)
            where = ", ".join(f"{name} {number_line(name, v).value}" for name, v in spans)
            lines.append(SummaryLine(curve.kind, where, count_text(len(curve.x), "point")))
        return f"StabilityBoundary, {law}, {' and '.join(self.names)}", lines

    def to_dataset(self) -> xarray.Dataset:
        """All curves along one dimension, with the number and kind of the curve of each point."""
        import xarray

        counts = [len(c.x) for c in self.curves]

        def joined(values: list, units: str, name: str) -> tuple:
            flat = np.concatenate(values) if values else np.zeros(0)
            return "point", flat, {"units": units, "long_name": name}

        curves = self.curves
        units = [u or "1" for u in self.units]
        data = {
            "x": joined([c.x for c in curves], units[0], self.names[0]),
            "y": joined([c.y for c in curves], units[1], self.names[1]),
            "frequency": joined([c.frequency for c in curves], "Hz", "critical mode"),
            "bounds_stability": joined(
                [c.bounds_stability for c in curves], "1", "one side is stable"
            ),
            "curve": joined(
                [np.full(n, i) for i, n in enumerate(counts)], "1", "number of the curve"
            ),
            "kind": joined(
                [np.full(n, c.kind) for c, n in zip(curves, counts, strict=True)],
                "1",
                "kind of the bifurcation",
            ),
        }
        law = type(self.motion.slider.law)
        fixed = fixed_as_text(law, self.fixed)
        attributes = {
            "asperity_version": __version__,
            "law": law.name,
            "source": law.source,
            "equation_of_motion": self.motion.name,
            "parameters": fixed,
        }
        return xarray.Dataset(data, attrs=attributes)


def stability_boundary(
    slider: Slider,
    *,
    x: str,
    y: str,
    x_span: tuple[Any, Any],
    y_span: tuple[Any, Any],
    velocity: ArrayLike | str | None = None,
    epsilon: ArrayLike | str | None = None,
    frequency: ArrayLike | str | None = None,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
    lines: int = 5,
    progress: Callable[[int, int], None] | None = None,
) -> StabilityBoundary:
    """Curves on which the periodic response changes its stability, in two parameters.

    Branches are followed along `lines` lines in each parameter, edges of the rectangle
    included; every bifurcation found there that lies on no curve yet is continued in both.

    Parameters
    ----------
    slider : Slider
        Numbers, no arrays.
    x, y : str
        Names of two parameters, as in `continuation`.
    x_span, y_span : pair of float or str
        Sides of the rectangle.
    velocity, epsilon, frequency, modulation, inertia, radiation_damping
        As in `continuation`.
    lines : int
        Number of lines in each direction, at least 2: a closed curve between them is missed.
    progress : callable, optional
        Called with the number of lines searched so far and of all lines, and again with the same
        numbers after each point of a boundary.

    Returns
    -------
    StabilityBoundary
        Points are accurate to 1e-8 of the span.

    Raises
    ------
    InputError
        As `continuation`; if x and y are the same; if `lines` is below 2.

    Notes
    -----
    Without modulation the curves end at the closed forms of linear stability: K = Kc for a
    slider without inertia, critical frequency (V/D0) sqrt((B - A)/A) for the ageing law.
    """
    lines = whole_number(lines, "lines", least=2)
    progress = function(progress, "progress")
    checked_slider(slider)
    problem = one_problem(
        slider,
        start_of(slider, x, x_span, "x_span") | start_of(slider, y, y_span, "y_span"),
        velocity=velocity,
        epsilon=epsilon,
        frequency=frequency,
        modulation=modulation,
        inertia=inertia,
        radiation_damping=radiation_damping,
    )
    parameters = (
        moving_parameter(problem, x, x_span, "x_span"),
        moving_parameter(problem, y, y_span, "y_span"),
    )
    if parameters[0].name == parameters[1].name:
        raise InputError(f"y must differ from x, got '{y}' for both; choose another parameter")
    plane = ParameterPlane(problem, parameters, 1)
    report = counted(progress, 2 * lines)
    curves: list[TracedBoundary] = []
    for at, direction in _scan_lines(lines):
        for kind, crossing in _crossings(plane, at, direction):
            if not any(_lies_on(curve, kind, crossing) for curve in curves):
                curves.append(trace_boundary(plane, kind, crossing, partial(report, 0)))
        report(1)
    return StabilityBoundary(
        (parameters[0].name, parameters[1].name),
        (parameters[0].unit, parameters[1].unit),
        tuple(_in_units(plane, curve) for curve in curves),
        problem.system,
        held_parameters(problem, *(p.name for p in parameters)),
    )


def _scan_lines(lines: int) -> list[tuple[Float, Float]]:
    """Starts and directions: along y at several x, then along x at several y; edges first."""
    ticks = np.linspace(0, 1, lines)
    ticks = np.concatenate([ticks[[0, -1]], ticks[1:-1]])
    along_y = [(np.array([t, 0.0]), np.array([0.0, 1.0])) for t in ticks]
    along_x = [(np.array([0.0, t]), np.array([1.0, 0.0])) for t in ticks]
    return along_y + along_x


def _crossings(
    plane: ParameterPlane, at: Float, direction: Float
) -> list[tuple[Any, BoundaryPoint]]:
    """Bifurcations on a line; none where no orbit is found at its start."""
    follower = plane.follower(at, direction)
    orbit = starting_orbit(follower.line.at(np.zeros(1)), INTERVALS)
    start = None if orbit is None else follower.begin(orbit, 0.0, INTERVALS)
    if start is None:
        return []
    found = []

    def visit(here: BranchOrbit, length: float, there: BranchOrbit) -> None:
        for bifurcation in bifurcations_between(follower, here, length, there):
            branch_orbit = bifurcation.branch_orbit
            if bifurcation.kind != "branch point" and 0 <= branch_orbit.t <= 1:
                found.append(
                    (bifurcation.kind, BoundaryPoint(at + branch_orbit.t * direction, branch_orbit))
                )

    follow_branch(
        follower,
        start,
        most_steps=_SCAN_STEPS,
        first_step=1e-3,
        ended=lambda branch_orbit: not 0 <= branch_orbit.t <= 1,
        visit=visit,
    )
    return found


def _lies_on(curve: TracedBoundary, kind: str, crossing: BoundaryPoint) -> bool:
    """Whether a bifurcation is one of a curve already traced, by its distance from the chords."""
    if curve.kind != kind:
        return False
    points = np.array([p.at for p in curve.points])
    if len(points) < 2:
        return bool(np.linalg.norm(points[0] - crossing.at) < _SAME)
    start, chord = points[:-1], np.diff(points, axis=0)
    length = np.maximum((chord**2).sum(1), 1e-300)
    share = np.clip(((crossing.at - start) * chord).sum(1) / length, 0, 1)
    foot = start + share[:, None] * chord
    return bool(np.linalg.norm(foot - crossing.at, axis=1).min() < _SAME)


def _in_units(plane: ParameterPlane, curve: TracedBoundary) -> BoundaryCurve:
    at = np.array([p.at for p in curve.points])
    x, y = (p.value(at[:, i]) for i, p in enumerate(plane.parameters))
    logs = np.stack([p.branch_orbit.logs for p in curve.points])
    critical = np.argmin(np.abs(logs.real), axis=1)
    angle = np.abs(np.angle(np.exp(1j * logs.imag[np.arange(len(logs)), critical])))
    omega = [
        float(np.asarray(plane.follower(a, (0.0, 0.0)).line.at(np.zeros(1)).system.omega)[0])
        for a in at
    ]
    mode = 0.0 if curve.kind == "fold" else angle / (2 * np.pi) * np.array(omega) / (2 * np.pi)
    width = 2 if curve.kind == "Neimark-Sacker" else 1
    distance = np.sort(np.where(np.abs(logs.real) > 0, logs.real, 0.0), axis=1)
    others = [np.delete(row, np.argsort(np.abs(row))[:width]) for row in distance]
    stable = np.array([bool(np.all(row < 0)) for row in others])
    return BoundaryCurve(curve.kind, x, y, mode * np.ones(len(x)), logs, stable, curve.result)
