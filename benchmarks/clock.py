"""Measuring times on a machine that may be busy with other work."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from typing import Any


def pin_to_one_core() -> bool:
    """Keep this process on one core if the system can; call it before a library starts threads."""
    if not hasattr(os, "sched_setaffinity"):
        return False
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    return True


def timed(run: Callable[[], Any], repeats: int, warm_up: bool = True) -> tuple[float, Any]:
    """Median processor time of `run`, which uses one core, and its last result.

    On an idle machine this is the wall time; on a busy one it excludes the time of other processes.
    With `warm_up` a first call that compiles and fills caches does not count.
    """
    if warm_up:
        run()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        times.append(time.process_time() - start)
    return statistics.median(times), result
