"""The rows of the other integrators."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import cache

from benchmarks import diffrax_marching, heyoka_shooting, scipy_marching, scipy_shooting
from benchmarks.cases import Batch, batch, stable_batch
from benchmarks.clock import timed
from benchmarks.equations import Answer
from benchmarks.table import Row

#: Points of each batch whose error is measured.
REFERENCES = 32


@cache
def reference(make: Callable[[str, int], Batch], law: str, points: int) -> Answer:
    """The first points of the batch by SciPy's DOP853 at the smallest useful tolerance."""
    part = make(law, points).part(slice(REFERENCES))
    return scipy_shooting.solve(part, scipy_shooting.REFERENCE)


def _row(
    what: str,
    solve: Callable[[Batch], Answer],
    points: Batch,
    true: Answer,
    repeats: int = 1,
    warm_up: bool = False,
) -> Row:
    seconds, answer = timed(lambda: solve(points), repeats, warm_up)
    return Row(f"{what}, {points.law}", len(points), seconds).with_errors(answer, true)


def heyoka_row(law: str, points: int, repeats: int) -> Row | None:
    """Shooting with heyoka; None if it is not installed."""
    if importlib.util.find_spec("heyoka") is None:
        return None
    solve = heyoka_shooting.Shooting().solve
    true = reference(batch, law, points)
    return _row("heyoka shooting", solve, batch(law, points), true, repeats, warm_up=True)


def scipy_shooting_row(law: str, points: int) -> Row:
    """Shooting with SciPy."""
    true = reference(batch, law, points)
    return _row("SciPy shooting", scipy_shooting.solve, batch(law, points), true)


def scipy_marching_row(law: str, points: int) -> Row:
    """Marching with SciPy; stable points only."""
    true = reference(stable_batch, law, points)
    return _row("SciPy LSODA marching", scipy_marching.solve, stable_batch(law, points), true)


def diffrax_marching_row(law: str, points: int) -> Row | None:
    """Marching with diffrax, stable points only; None if it is not installed."""
    if importlib.util.find_spec("diffrax") is None:
        return None
    solve = diffrax_marching.Marching().solve
    stable, true = stable_batch(law, points), reference(stable_batch, law, points)
    solve(stable, most_periods=1)  # compiles
    return _row("diffrax marching", solve, stable, true)
