"""The Map tab: response and stability over any two numbers, on a sequence of finer grids."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, StrictBool, StrictInt

from asperity.app.api import as_code
from asperity.app.api.operating_point import Name, OperatingPoint, Value
from asperity.app.endpoints import Answer, Job, Question
from asperity.errors import require
from asperity.operating_point import SourcedNumber, refuse_foreign
from asperity.parameters.arguments import one_of
from asperity.questions.record import WHOLE
from asperity.study.map import SHOWN, Axis, response_map
from asperity.study.map.dataset import boundary_lines, critical_line

#: Points along each axis of the first grid, which has no boundary; each following grid has twice as
#: many, up to the number in the question.
_COARSE = 8
#: Largest number of points along an axis.
_FINEST = 128


class MapAxis(Question):
    """An axis: the name of a number, its ends, and whether points lie at equal ratios."""

    name: Name
    low: Value
    high: Value
    log: StrictBool = False


class MapQuestion(OperatingPoint):
    """An operating point of which two numbers vary.

    Attributes
    ----------
    x, y : MapAxis
    show : str
        One of `asperity.study.map.SHOWN`.
    count : int
        Points along each axis of the finest grid.
    """

    x: MapAxis
    y: MapAxis
    show: Name = "growth_rate"
    count: Annotated[StrictInt, Field(ge=2, le=_FINEST), WHOLE] = 64

    def axes(self, count: int) -> tuple[Axis, Axis]:
        """Axes with `count` points each."""
        x, y = (Axis(a.name, a.low, a.high, count, a.log) for a in (self.x, self.y))
        return x, y

    def fixed(self) -> dict[str, SourcedNumber]:
        """Numbers that stay the same, with their sources."""
        ends = {a.name: a.low for a in (self.x, self.y)}
        update = {"numbers": {**self.numbers, **ends}}
        numbers = self.model_copy(update=update).sourced()
        return {name: number for name, number in numbers.items() if name not in ends}


def check(question: MapQuestion) -> None:
    """Raise `InputError` for an invalid map, before a process is started."""
    advice, axes = "a map has epsilon on the contacts", "choose another one for y"
    require(question.air is None, "map.air", "be left out", "an air layer", advice)
    one_of(question.show, SHOWN, "show")
    x, y = question.axes(2)
    require(x.name != y.name, "axes", "be two numbers", f"'{x.name}' on both", axes)
    refuse_foreign(question.law, {x.name: "", y.name: ""})
    question.fixed()
    for axis in (x, y):
        for end in axis.values:
            question.check_reach(axis.name, float(end))


def text(question: MapQuestion) -> dict[str, Any]:
    """The same map as Python and as a command."""
    check(question)
    fixed = {name: number.value for name, number in question.fixed().items()}
    x, y = question.axes(question.count)
    return as_code.plane(question, fixed, x, y, question.show)


def grow(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Solve a sequence of finer grids.

    Each message has ``grid``: axes, `MapQuestion.show` on the grid, where it is stable, why a point
    failed, and the boundary with its bifurcations; or ``progress``, a share of all work. The first
    of several grids has None for the boundary: searching for it takes longer than its points.
    """
    question = MapQuestion(**argument)
    counts = [question.count]
    while counts[0] // 2 >= _COARSE:
        counts.insert(0, counts[0] // 2)
    total, before = sum(n * n for n in counts), 0
    fixed = question.fixed()
    for count in counts:
        x, y = question.axes(count)

        def progress(done: int, points: int, before: int = before) -> None:
            report(progress=(before + done) / total)

        first = count < question.count and count == counts[0]
        dataset = response_map(question.law, fixed, x=x, y=y, boundary=not first, progress=progress)
        before += count * count
        grid = _record(dataset, question, x, y) | ({"boundaries": None} if first else {})
        report(grid=grid, progress=before / total)
    return {}


def warm(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Compile the programs of the default map before the tab is opened."""
    sides = {"x": {"name": "epsilon", "low": 0.01, "high": 0.4},
             "y": {"name": "K", "low": 1e5, "high": 4e5}}  # fmt: skip
    numbers = {"V": 1e-6, "frequency": 120.0}
    question = MapQuestion.model_validate({"law": "rice-ruina", "numbers": numbers, **sides})
    x, y = question.axes(_COARSE)
    ongoing = lambda done, points: report()  # noqa: E731
    response_map(question.law, question.fixed(), x=x, y=y, boundary=False, progress=ongoing)
    return {}


def _record(result: Any, question: MapQuestion, x: Axis, y: Axis) -> dict[str, Any]:
    from asperity.figures.map import region_names

    values = result[question.show].values
    lines = [
        {"x": line.pop(x.name), "y": line.pop(y.name), **line} for line in boundary_lines(result)
    ]
    results = result["result"].values.astype(str)
    failed = ~result["converged"].values
    reasons = dict.fromkeys(results[failed].tolist())
    return {
        "count": x.count,
        "x": x.values,
        "y": y.values,
        # Five digits are enough for a colour and a readout: a grid is the longest answer.
        "values": [[_short(v) for v in row] for row in values.tolist()],
        "stable": result["stable"].values.astype(int),
        "regions": region_names(result),
        "unmodulated": critical_line(result),
        "failed": int(failed.sum()),
        "reverses": int(result["reverses"].values.sum()),
        "reasons": list(reasons)[:5],
        "boundaries": lines,
        "not_located": int((result["boundary_line"].values < 0).sum()),
    }


def _short(value: float) -> float | None:
    return float(f"{value:.5g}") if np.isfinite(value) else None


ENDPOINTS = (
    Answer("map/text", MapQuestion, text),
    Job(
        "map", MapQuestion, "asperity.app.api.map:grow", lane="map", check=check, seconds=900,
        warm="asperity.app.api.map:warm",
    ),
)  # fmt: skip
