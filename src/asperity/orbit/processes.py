"""The search on several cores: one process each, since XLA's programs do not share one well.

Worker processes are started once and kept; each loads the compiled programs from the cache.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from asperity.orbit.batches import take
from asperity.orbit.methods.method import Method
from asperity.orbit.search import find_orbits
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem

#: Points handed to a process at a time: a fraction of a second of work.
_SLICE = 20_000

#: Below this many points the start of the processes, a second or two, is not worth it.
WORTHWHILE = 200_000


def available_cores() -> int:
    """Cores this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def find_orbits_on_cores(
    problem: Problem,
    points: int,
    workers: int,
    *,
    harmonics: int,
    phases: int,
    progress: Callable[[int], None],
    methods: tuple[Method, ...],
) -> Solution:
    """`find_orbits` with the points dealt out to `workers` processes; same results, same order."""
    from loky import get_reusable_executor

    solution = Solution.unsolved(problem, points, SearchOptions(harmonics, phases, progress))
    options = {"harmonics": harmonics, "phases": phases, "methods": methods}
    # One thread of XLA in each process, or they fight for the cores.
    executor = get_reusable_executor(max_workers=workers, env={"NPROC": "1"})
    waiting: list[tuple[np.ndarray, Any]] = []
    try:
        for start in range(0, points, _SLICE):
            index = np.arange(start, min(start + _SLICE, points))
            waiting.append((index, executor.submit(_search, take(problem, index), options)))
            if len(waiting) > 2 * workers:  # bounds the results that wait in memory
                _collect(solution, *waiting.pop(0), progress)
        while waiting:
            _collect(solution, *waiting.pop(0), progress)
    except BaseException:  # Ctrl-C included: the processes must be stopped
        executor.shutdown(wait=False, kill_workers=True)
        raise
    return solution


def _collect(
    solution: Solution, index: np.ndarray, job: Any, progress: Callable[[int], None]
) -> None:
    # Orbits, of which none are asked for, stay behind.
    for target, values in zip(solution[:-1], job.result()[:-1], strict=True):
        target[..., index] = values
    progress(len(index))


def _search(problem: Problem, options: dict[str, Any]) -> Solution:
    points = len(np.asarray(problem.system.V))
    return find_orbits(problem, points, progress=lambda _: None, **options)
