"""Map: response and stability over any two numbers, coarse at once and then finer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from asperity.app.api import recipes
from asperity.app.api.operating_point import Name, OperatingPoint, Value
from asperity.app.endpoints import Answer, Job, Question
from asperity.errors import InputError
from asperity.operating_point import SourcedNumber, refuse_foreign
from asperity.parameters.arguments import one_of
from asperity.study.map import SHOWN, Axis, response_map

#: Points along each axis: at once and without a boundary, then finer while one looks, up to what is
#: asked.
_COARSE = 8
#: Largest number of points along an axis.
_FINEST = 128


class AxisAsked(Question):
    """An axis: the name of a number, its ends, and whether points lie at equal ratios."""

    name: Name
    low: Value
    high: Value
    log: bool = False


class MapAsked(OperatingPoint):
    """An operating point of which two numbers vary.

    Attributes
    ----------
    x, y : AxisAsked
    show : str
        One of `asperity.study.map.SHOWN`.
    count : int
        Points along each axis of the finest grid.
    """

    x: AxisAsked
    y: AxisAsked
    show: Name = "growth_rate"
    count: Annotated[int, Field(ge=2, le=_FINEST)] = 64

    def axes(self, count: int) -> tuple[Axis, Axis]:
        """Axes with so many points."""
        x, y = (Axis(a.name, a.low, a.high, count, a.log) for a in (self.x, self.y))
        return x, y

    def fixed(self) -> dict[str, SourcedNumber]:
        """Numbers that stay the same, with their sources."""
        ends = {a.name: a.low for a in (self.x, self.y)}
        update = {"numbers": {**self.numbers, **ends}}
        numbers = self.model_copy(update=update).sourced()
        return {name: number for name, number in numbers.items() if name not in ends}


def check(asked: MapAsked) -> None:
    """Refuse what cannot be mapped, before a process is asked."""
    if asked.air is not None:
        raise InputError(
            "map.air must be left out, got an air layer; a map has epsilon on the contacts"
        )
    one_of(asked.show, SHOWN, "map.show")
    x, y = asked.axes(2)
    if x.name == y.name:
        raise InputError(
            f"axes must be two numbers, got '{x.name}' on both; choose another one for y"
        )
    refuse_foreign(asked.law, {x.name: "", y.name: ""})
    asked.fixed()
    for axis in (x, y):
        for end in axis.values:
            asked.check_reach(axis.name, float(end))


def text(asked: MapAsked) -> dict[str, Any]:
    """The same map as Python and as a command."""
    check(asked)
    fixed = {name: number.value for name, number in asked.fixed().items()}
    x, y = asked.axes(asked.count)
    return recipes.plane(asked, fixed, x, y, asked.show)


def grow(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Solve ever finer grids.

    Each message has ``grid``: axes, `MapAsked.show` on the grid, where it is stable, why a point
    failed, and the boundary with its bifurcations; or ``progress``, a share of all work. The first
    of several grids has None for the boundary: searching for it takes longer than its points.
    """
    asked = MapAsked.model_validate(argument)
    counts = [asked.count]
    while counts[0] // 2 >= _COARSE:
        counts.insert(0, counts[0] // 2)
    total, before = sum(n * n for n in counts), 0
    fixed = asked.fixed()
    for count in counts:
        x, y = asked.axes(count)

        def progress(done: int, points: int, before: int = before) -> None:
            report(progress=(before + done) / total)

        first = count < asked.count and count == counts[0]
        found = response_map(asked.law, fixed, x=x, y=y, boundary=not first, progress=progress)
        before += count * count
        grid = _record(found, asked, x, y) | ({"boundaries": None} if first else {})
        report(grid=grid, progress=before / total)
    return {}


def warm(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Compile what the map that the tab begins with needs, before it is asked for."""
    sides = {"x": {"name": "epsilon", "low": 0.01, "high": 0.4},
             "y": {"name": "K", "low": 1e5, "high": 4e5}}  # fmt: skip
    numbers = {"V": 1e-6, "frequency": 120.0}
    asked = MapAsked.model_validate({"law": "rice-ruina", "numbers": numbers, **sides})
    x, y = asked.axes(_COARSE)

    def on_progress(done: int, points: int) -> None:
        report()

    response_map(asked.law, asked.fixed(), x=x, y=y, boundary=False, progress=on_progress)
    return {}


def _record(found: Any, asked: MapAsked, x: Axis, y: Axis) -> dict[str, Any]:
    values = found[asked.show].values
    line = found["boundary_line"].values
    kinds = found["boundary_kind"].values.astype(str)
    lines = []
    for number in range(line.max(initial=-1) + 1):
        on = line == number
        lines.append(
            {
                "x": found[f"boundary_{x.name}"].values[on],
                "y": found[f"boundary_{y.name}"].values[on],
                "kind": kinds[on].tolist(),
                "mode_frequency": found["boundary_mode_frequency"].values[on],
            }
        )
    results = found["result"].values.astype(str)
    failed = ~found["converged"].values
    reasons = dict.fromkeys(results[failed].tolist())
    return {
        "count": x.count,
        "x": x.values,
        "y": y.values,
        # As many digits as a colour and a readout need: a grid is the longest answer of all.
        "values": [[_short(v) for v in row] for row in values.tolist()],
        "stable": found["stable"].values.astype(int),
        "failed": int(failed.sum()),
        "reasons": list(reasons)[:5],
        "boundaries": lines,
        "not_located": int((line < 0).sum()),
    }


def _short(value: float) -> float | None:
    return float(f"{value:.5g}") if np.isfinite(value) else None


ENDPOINTS = (
    Answer("map/text", MapAsked, text),
    Job(
        "map", MapAsked, "asperity.app.api.map:grow", lane="map", check=check, seconds=900,
        warm="asperity.app.api.map:warm",
    ),
)  # fmt: skip
