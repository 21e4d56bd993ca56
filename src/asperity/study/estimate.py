"""Estimate of the time, memory and failures of a sweep, from a sample of its chunks."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

import numpy as np

from asperity.study.grid import SweepGrid
from asperity.study.plan import SweepPlan, load_plan
from asperity.study.solve import SOLVES

#: Chunks of the sample, and target time for the sample (s).
_CHUNKS, _SECONDS = 8, 20.0
#: Points of a chunk that are solved first; the whole chunk follows if its time allows.
_FIRST_POINTS = 32


@dataclass(frozen=True)
class SweepEstimate:
    """Size of a sweep, and estimates of its time and of its share of failures.

    Attributes
    ----------
    shape, chunk_shape : tuple of int
        Rows along each axis, of the sweep and of a chunk.
    points, chunks : int
    bytes : float
        Size of the answers in the store, uncompressed.
    sample : int
        Points that were solved for the estimate.
    failed : float
        Share of the points of the sample without a converged answer.
    seconds : float
        Processor time for all points (s); divide by the number of workers.
    """

    shape: tuple[int, ...]
    chunk_shape: tuple[int, ...]
    points: int
    chunks: int
    bytes: float
    sample: int
    failed: float
    seconds: float


def dry_run(plan: SweepPlan | str | os.PathLike[str]) -> SweepEstimate:
    """Count the points of a plan, and solve a sample of them to estimate the time.

    Raises
    ------
    InputError
        If the plan has mistakes.
    """
    if not isinstance(plan, SweepPlan):
        plan = load_plan(plan)
    grid = SweepGrid.of(plan)
    record = {**grid.record, "folder": str(plan.folder.resolve())}
    draw = np.random.default_rng(0)
    count = min(_CHUNKS, grid.chunk_count)
    sample, failed, seconds = 0, 0, 0.0
    begin = time.perf_counter()
    # Chunks at equal distances, so that the sample has all laws of an outer axis of laws.
    for k in range(count):
        chunk = grid.at((2 * k + 1) * grid.chunk_count // (2 * count))
        drawn = np.sort(draw.permutation(len(chunk))[:_FIRST_POINTS])
        for points in (chunk.take(drawn), chunk):
            # The first call compiles and is not timed.
            SOLVES[plan.solve].solve(points, record)
            start = time.process_time()
            answers = SOLVES[plan.solve].solve(points, record)
            spent = time.process_time() - start
            if 2 * spent * len(chunk) / len(points) > _SECONDS / count:
                break
        sample, failed = sample + len(points), failed + answers.failed
        seconds += spent * len(chunk) / len(points)
        if time.perf_counter() - begin > _SECONDS:
            break
    return SweepEstimate(
        shape=grid.shape,
        chunk_shape=grid.chunks,
        points=grid.points,
        chunks=grid.chunk_count,
        bytes=grid.bytes,
        sample=sample,
        failed=failed / sample,
        seconds=seconds / (k + 1) * grid.chunk_count,
    )
