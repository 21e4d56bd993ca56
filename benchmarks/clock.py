"""Measuring times on a machine that others may be using."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from typing import Any


def pin_to_one_core() -> bool:
    """Keep this process on one core, where the system can; before any library starts threads."""
    if not hasattr(os, "sched_setaffinity"):
        return False
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    return True


def timed(run: Callable[[], Any], repeats: int, warm_up: bool = True) -> tuple[float, Any]:
    """Median processor time of `run` and its last result, for what runs on one core.

    On an idle machine that is the wall time; on a busy one the wall time tells of the others.
    A first call that compiles and fills caches does not count, if `warm_up`.
    """
    if warm_up:
        run()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        times.append(time.process_time() - start)
    return statistics.median(times), result
