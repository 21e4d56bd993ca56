"""The virtual experiment in a process of its own, while other figures are computed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from asperity.orbit.search import available_cores
from asperity.papers.bureau2000.virtual.recordings import SimulatedPoints, experiment

#: One thread each for XLA and for NumPy's linear algebra: the other core is taken.
_ONE_THREAD = {"NPROC": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


@contextmanager
def experiment_beside() -> Iterator[Callable[[], SimulatedPoints]]:
    """Begin `experiment`, and hand out what waits for it; the same numbers on any machine.

    On a single core it is done when it is asked for. Left early, by Ctrl-C or an error, the
    process ends.
    """
    if available_cores() < 2:
        yield experiment
        return
    from loky import ProcessPoolExecutor

    executor = ProcessPoolExecutor(max_workers=1, env=_ONE_THREAD)
    try:
        yield executor.submit(experiment).result
    finally:
        executor.shutdown(wait=False, kill_workers=True)
