"""What a sweep would take, from its plan and a sample of its points."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.sweep.grid import SweepGrid
from asperity.sweep.load import load_plan
from asperity.sweep.plan.model import SweepPlan
from asperity.sweep.plan.points import Points
from asperity.sweep.solve import SOLVES, SolveKind

#: Points of the sample, and seconds that each of its stages may take.
_SAMPLE, _SECONDS = 2000, 20.0
#: Chunks on which the first stage is timed: as they are run, each with the laws that share it.
_TIMED = 6


@dataclass(frozen=True)
class SweepEstimate:
    """What a sweep would take.

    Attributes
    ----------
    shape, chunk_shape : tuple of int
        Rows of each axis, and of a chunk.
    points, chunks : int
    bytes : float
        In the store, uncompressed.
    sample : int
        Points that were solved for the estimate.
    second_stage : float
        Share of the points that the fast method leaves.
    failed : float
        Share of the points of the sample without an answer; of those of the second stage that
        there was time for.
    seconds : float
        Processor time for all points; to be divided by the workers.
    """

    shape: tuple[int, ...]
    chunk_shape: tuple[int, ...]
    points: int
    chunks: int
    bytes: float
    sample: int
    second_stage: float
    failed: float
    seconds: float


def dry_run(plan: SweepPlan | str | os.PathLike[str]) -> SweepEstimate:
    """Count the points of a plan, and solve some of them for an estimate of the time.

    Raises
    ------
    InputError
        If the plan has mistakes.
    """
    if not isinstance(plan, SweepPlan):
        plan = load_plan(plan)
    grid = SweepGrid.of(plan)
    solve = SOLVES[plan.solve]
    record = {**grid.record, "folder": str(plan.folder.resolve())}
    count = min(_SAMPLE, grid.points, max(1, solve.chunk_points(grid.points, grid.record)))
    numbers = np.random.default_rng(0).choice(grid.points, count, replace=False) if (
        grid.points < 10**7
    ) else np.unique(np.random.default_rng(0).integers(0, grid.points, count))  # fmt: skip
    points = grid.numbered(np.sort(numbers))
    found = solve.first(points, record)
    failed = int(np.count_nonzero(found.outcome > 0))
    seen, share = len(points) - len(found.left), len(found.left) / len(points)
    first, batches = _first_stage(grid, solve, record)
    # Batches of whole chunks: those of the sample, of each law a few points, would cost more each.
    batches = batches or [points.take(rows) for rows in solve.batches(points, found.left)]
    if batches:
        solve.second(batches[0], record)  # for the compiler
    # Any of them stands for the rest.
    np.random.default_rng(0).shuffle(batches)
    second, solved = 0.0, 0
    start = time.perf_counter()
    for batch in batches:
        begin = time.process_time()
        part = solve.second(batch, record)
        second, solved = second + time.process_time() - begin, solved + len(batch)
        failed, seen = failed + part.failed, seen + len(batch)
        if time.perf_counter() - start > _SECONDS:
            break
    each = first + (share * second / solved if solved else 0.0)
    return SweepEstimate(
        shape=grid.shape,
        chunk_shape=grid.chunks,
        points=grid.points,
        chunks=grid.chunk_count,
        bytes=float(grid.points) * (8 * (len(grid.record["outputs"]) + 1) + 2),
        sample=len(points),
        second_stage=share,
        failed=failed / max(seen, 1),
        seconds=each * grid.points,
    )


def _first_stage(
    grid: SweepGrid, solve: SolveKind, record: Mapping[str, Any]
) -> tuple[float, list[Points]]:
    """Processor time of the first stage for a point, from whole chunks, and batches they leave.

    The sample would not do: it has points of all laws, each of which takes calls of its own.
    """
    count = min(_TIMED, grid.chunk_count)
    spent, points = 0.0, 0
    batches: list[Points] = []
    start = time.perf_counter()
    # Evenly over the plan, whose outer axes have the laws.
    for k in range(count):
        chunk = grid.at((2 * k + 1) * grid.chunk_count // (2 * count))
        solve.first(chunk, record)  # for the compiler
        begin = time.process_time()
        found = solve.first(chunk, record)
        spent, points = spent + time.process_time() - begin, points + len(chunk)
        batches += [chunk.take(rows) for rows in solve.batches(chunk, found.left)]
        if time.perf_counter() - start > _SECONDS:
            break
    return spent / points, batches
