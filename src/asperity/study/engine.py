"""The engine of sweeps: it hands out chunks of points, and counts them.

A worker solves a chunk, writes it and returns a `DoneChunk`; the engine keeps no results, so that
its memory does not grow with the number of chunks. Tables and maps are solved in this process.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path

from asperity.study.workers import Workers

#: Chunks submitted for each worker: a worker that ends one starts the next without waiting.
_CHUNKS_PER_WORKER = 2
#: A chunk whose worker process died so often is given up. Before the last attempt the chunk runs
#: alone, which shows whether this chunk or another one kills the process or takes the memory.
_MOST_DEATHS = 3


class WorkersGoneError(RuntimeError):
    """The workers have ended and cannot be restarted."""


@dataclass(frozen=True)
class DoneChunk:
    """Report of a worker on a chunk that is solved and written.

    Attributes
    ----------
    points, failed : int
        Number of its points, and of those without a converged answer.
    seconds : float, optional
        Time to solve and write without compilation; None if an earlier run solved the chunk.
    messages : tuple of str
        Errors of the solver.
    memory : float
        Largest resident memory of the worker so far (bytes).
    """

    points: int
    failed: int
    seconds: float | None
    messages: tuple[str, ...] = ()
    memory: float = 0.0


@dataclass
class SweepProgress:
    """Progress of a sweep; at its end, its summary.

    Attributes
    ----------
    out : Path
        Folder of the store.
    points, total : int
        Points processed by this run and earlier runs, and all points.
    failed : int
        Processed points without a converged answer.
    stored : int
        Points of chunks that were done when this run began.
    kept : int
        Points of `stored` that this run has checked and kept so far.
    chunks, chunk_total : int
        Chunks that are done, and all chunks.
    seconds : float
        Time since the beginning of this run (s).
    spent : float
        Time that all workers spent on the points of this run, without compilation (s).
    memory : float
        Largest resident memory of a worker so far (bytes).
    lost : int
        Number of worker processes that died.
    left : float
        Estimate of the remaining time (s); NaN before a point is solved.
    """

    out: Path
    points: int = 0
    total: int = 0
    failed: int = 0
    stored: int = 0
    kept: int = 0
    chunks: int = 0
    chunk_total: int = 0
    seconds: float = 0.0
    spent: float = 0.0
    memory: float = 0.0
    lost: int = 0
    left: float = float("nan")

    @property
    def solved(self) -> int:
        """Points solved in this run."""
        return self.points - self.kept

    @property
    def rate(self) -> float:
        """Points solved per second in this run."""
        return self.solved / self.seconds if self.seconds > 0 else 0.0

    def add(self, done: DoneChunk) -> None:
        """Add the counts of a chunk."""
        self.chunks += 1
        self.points += done.points
        self.failed += done.failed
        self.memory = max(self.memory, done.memory)
        if done.seconds is None:
            self.kept += done.points
        else:
            self.spent += done.seconds

    def estimate(self, seconds: float, workers: int) -> None:
        """Set the time since the beginning (s), and the estimate of the remaining time."""
        self.seconds = seconds
        # Checking a chunk that an earlier run solved takes next to no time.
        points_left = self.total - self.points - max(0, self.stored - self.kept)
        if points_left <= 0:
            self.left = 0.0
        elif self.solved:
            self.left = points_left * self.spent / self.solved / workers


def solve_chunks(
    task: Callable[[int, bool], DoneChunk],
    chunks: Iterable[int],
    workers: Workers,
    progress: SweepProgress,
    tick: Callable[[SweepProgress], None],
    log: Callable[[str], None],
) -> None:
    """Solve and write every chunk.

    Parameters
    ----------
    task : callable
        Solves and writes the chunk of a number; with True as second argument it marks the points as
        failed without solving. Pickled where the workers are other processes.
    chunks : iterable of int
        Numbers of the chunks, in the order in which they are submitted.
    workers : Workers
    progress : SweepProgress
        With the totals set; the other counts are updated.
    tick : callable
        Called with `progress` at least once a second.
    log : callable
        Called with a line of text for every error.

    Raises
    ------
    OSError
        If a chunk could not be written.
    WorkersGoneError
        If the workers have ended and cannot be restarted.
    """
    begin = time.perf_counter()
    fresh, again, alone = iter(chunks), deque[int](), deque[int]()
    deaths: Counter[int] = Counter()
    running: dict[Future[DoneChunk], int] = {}

    def following() -> int | None:
        """The next chunk, if the workers have room for it; a suspect chunk runs alone."""
        if alone:
            return None if running else alone.popleft()
        if len(running) >= _CHUNKS_PER_WORKER * workers.count:
            return None
        return again.popleft() if again else next(fresh, None)

    while True:
        died = []
        try:
            while (chunk := following()) is not None:
                give_up = deaths[chunk] >= _MOST_DEATHS
                running[workers.submit(task, chunk, give_up)] = chunk
            if not running:
                return
            for future in wait(running, timeout=0.5, return_when=FIRST_COMPLETED).done:
                chunk = running.pop(future)
                try:
                    done = future.result()
                except workers.lost:
                    died.append(chunk)
                else:
                    progress.add(done)
                    for message in done.messages:
                        log(message)
        except workers.gone:
            raise WorkersGoneError from None
        if died:
            progress.lost += 1
            log(f"a worker process died with {len(died)} chunks at work; they are done again")
            workers.restart()
        for chunk in died:
            deaths[chunk] += 1
            (alone if deaths[chunk] >= _MOST_DEATHS - 1 else again).append(chunk)
            if deaths[chunk] == _MOST_DEATHS:
                log(f"chunk {chunk} kills its process each time; its points are given up")
        progress.estimate(time.perf_counter() - begin, workers.count)
        tick(progress)
