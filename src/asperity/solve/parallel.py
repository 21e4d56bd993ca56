"""The search on several cores: one process each, since XLA's programs do not share one well.

Worker processes are started once and kept; each loads the compiled programs from the cache.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from asperity.solve.batch import take
from asperity.solve.found import Found
from asperity.solve.kernels import Problem
from asperity.solve.search import find_orbits

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
    methods: tuple[str, ...],
) -> Found:
    """`find_orbits` with the points dealt out to `workers` processes; same results, same order."""
    from loky import get_reusable_executor

    found = Found.empty(problem.system.size, points, harmonics, phases)
    options = {"harmonics": harmonics, "phases": phases, "methods": methods}
    # One thread of XLA in each process, or they fight for the cores.
    executor = get_reusable_executor(max_workers=workers, env={"NPROC": "1"})
    waiting: list[tuple[np.ndarray, Any]] = []
    try:
        for start in range(0, points, _SLICE):
            index = np.arange(start, min(start + _SLICE, points))
            waiting.append((index, executor.submit(_search, take(problem, index), options)))
            if len(waiting) > 2 * workers:  # bounds what lies between the processes
                _collect(found, *waiting.pop(0), progress)
        while waiting:
            _collect(found, *waiting.pop(0), progress)
    except BaseException:  # Ctrl-C included: the processes must not work on
        executor.shutdown(wait=False, kill_workers=True)
        raise
    return found


def _collect(found: Found, index: np.ndarray, job: Any, progress: Callable[[int], None]) -> None:
    for target, values in zip(found, job.result(), strict=True):
        target[..., index] = values
    progress(len(index))


def _search(problem: Problem, options: dict[str, Any]) -> Found:
    points = len(np.asarray(problem.system.V))
    return find_orbits(problem, points, progress=lambda _: None, **options)
