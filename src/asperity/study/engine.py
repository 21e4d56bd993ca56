"""The engine of tables, maps and sweeps: workers solve and write chunks, the engine counts them.

A task is a call with several chunks. The worker solves the chunks, writes the results and returns a
`Report`. The engine keeps no results, so that its memory does not grow with the number of chunks.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Protocol

from asperity.study.workers import ThisProcess, Workers

#: Target duration of a task (s).
_TASK_SECONDS = 2.0
#: Tasks submitted for each worker: a worker that ends one task starts the next without waiting.
_TASKS_PER_WORKER = 2
#: Largest number of chunks in a task.
_MOST_CHUNKS = 64
#: A chunk whose worker process died so often is not solved. Before the last attempt the chunk runs
#: alone, which shows whether this chunk or another of the task kills the process.
_MOST_DEATHS = 3
#: Weight of the newest duration in the exponential moving average.
_NEWEST = 0.3


class WorkersGoneError(RuntimeError):
    """The workers have ended and cannot be restarted."""


@dataclass(frozen=True)
class DoneChunk:
    """A chunk that is solved and written.

    Attributes
    ----------
    chunk, points, failed : int
        Number of the chunk, number of its points, and of those without a converged answer.
    seconds : float, optional
        Time to solve and write without compilation; None if an earlier run solved the chunk.
    """

    chunk: int
    points: int
    failed: int
    seconds: float | None


@dataclass
class Report:
    """Result of a task.

    Attributes
    ----------
    done : list of DoneChunk
    left : tuple of int
        Chunks not solved within the time budget of the task.
    messages : list of str
        Errors of the solver.
    memory : float
        Largest resident memory of the worker so far (bytes).
    """

    done: list[DoneChunk] = field(default_factory=list)
    left: tuple[int, ...] = ()
    messages: list[str] = field(default_factory=list)
    memory: float = 0.0


class Task(Protocol):
    """A callable that solves and writes chunks."""

    def __call__(self, chunks: tuple[int, ...], budget: float, give_up: bool = False, /) -> Report:
        """Solve at least one chunk, and further chunks until `budget` seconds have passed.

        With `give_up` all points of the chunks are marked as failed without being solved.
        """
        ...


@dataclass
class SweepProgress:
    """Progress of a study.

    Attributes
    ----------
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
    def rate(self) -> float:
        """Points solved per second in this run."""
        return (self.points - self.kept) / self.seconds if self.seconds > 0 else 0.0

    def add(self, report: Report) -> None:
        """Add the counts of a task."""
        self.memory = max(self.memory, report.memory)
        for done in report.done:
            self.chunks += 1
            self.points += done.points
            self.failed += done.failed
            if done.seconds is None:
                self.kept += done.points
            else:
                self.spent += done.seconds

    def estimate(self, seconds: float, workers: int) -> None:
        """Set the time since the beginning (s), and the estimate of the remaining time."""
        self.seconds = seconds
        # Checking a chunk that an earlier run solved takes next to no time.
        points_left = self.total - self.points - max(0, self.stored - self.kept)
        solved = self.points - self.kept
        if points_left <= 0:
            self.left = 0.0
        elif solved:
            self.left = points_left * self.spent / solved / workers


class _Engine:
    """A run over chunks; the arguments are those of `solve_chunks`."""

    def __init__(
        self, task: Task, chunks: Iterable[int], workers: Workers, progress: SweepProgress,
        log: Callable[[str], None],
    ) -> None:  # fmt: skip
        self.task, self.workers, self.progress, self.log = task, workers, progress, log
        self._fresh = iter(chunks)
        self._again: deque[int] = deque()
        self._suspects: deque[int] = deque()
        self._deaths: Counter[int] = Counter()
        self._running: dict[Future[Report], tuple[int, ...]] = {}
        self._seconds: float | None = None

    def run(self, tick: Callable[[SweepProgress], None]) -> None:
        begin = time.perf_counter()
        while True:
            self._fill()
            if not self._running:
                return
            done, _ = wait(self._running, timeout=0.5, return_when=FIRST_COMPLETED)
            dead: list[int] = []
            for future in done:
                chunks = self._running.pop(future)
                try:
                    self._take(future.result())
                except self.workers.lost:
                    dead += chunks
                except self.workers.gone:
                    raise WorkersGoneError from None
            if dead:
                self._repeat(dead)
            self.progress.estimate(time.perf_counter() - begin, self.workers.count)
            tick(self.progress)

    def _fill(self) -> None:
        """Submit tasks until each worker has `_TASKS_PER_WORKER`; a suspect chunk runs alone."""
        if self._suspects:
            if not self._running:
                chunk = self._suspects.popleft()
                self._submit((chunk,), give_up=self._deaths[chunk] >= _MOST_DEATHS)
            return
        while len(self._running) < _TASKS_PER_WORKER * self.workers.count:
            chunks = self._next()
            if not chunks:
                return
            self._submit(chunks)

    def _submit(self, chunks: tuple[int, ...], give_up: bool = False) -> None:
        try:
            self._running[self.workers.submit(self.task, chunks, _TASK_SECONDS, give_up)] = chunks
        except self.workers.gone:
            raise WorkersGoneError from None

    def _next(self) -> tuple[int, ...]:
        """Chunks of the next task; chunks that a task left come before new ones."""
        left = self.progress.chunk_total - self.progress.chunks
        share = -(-left // (2 * self.workers.count))
        in_time = 1 if self._seconds is None else round(_TASK_SECONDS / max(self._seconds, 1e-3))
        chunks: list[int] = []
        while len(chunks) < max(1, min(in_time, share, _MOST_CHUNKS)):
            chunk = self._again.popleft() if self._again else next(self._fresh, None)
            if chunk is None:
                break
            chunks.append(chunk)
        return tuple(chunks)

    def _take(self, report: Report) -> None:
        self.progress.add(report)
        for message in report.messages:
            self.log(message)
        for done in report.done:
            if done.seconds is not None:
                mean = done.seconds if self._seconds is None else self._seconds
                self._seconds = mean + _NEWEST * (done.seconds - mean)
        self._again.extendleft(reversed(report.left))

    def _repeat(self, chunks: list[int]) -> None:
        """Queue again the chunks whose worker process died."""
        self.progress.lost += 1
        self.log(f"a worker process died with {len(chunks)} chunks at work; they are done again")
        self.workers.restart()
        for chunk in chunks:
            self._deaths[chunk] += 1
            alone = self._deaths[chunk] >= _MOST_DEATHS - 1
            (self._suspects if alone else self._again).append(chunk)
            if self._deaths[chunk] == _MOST_DEATHS:
                self.log(f"chunk {chunk} kills its process each time; its points are given up")


def solve_chunks(
    task: Task,
    chunks: Iterable[int],
    workers: Workers,
    progress: SweepProgress,
    tick: Callable[[SweepProgress], None],
    log: Callable[[str], None],
) -> None:
    """Solve and write every chunk.

    Parameters
    ----------
    task : Task
        Pickled and sent to the workers where these are other processes.
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
    _Engine(task, chunks, workers, progress, log).run(tick)


def solve_here(
    total: int,
    size: int,
    solve: Callable[[int, int, Callable[[int], None]], None],
    progress: Callable[[int, int], None],
    done: int = 0,
) -> None:
    """Solve chunks of at most `size` points in this process, in order.

    Parameters
    ----------
    total, done : int
        Number of points; the first `done` of them are solved already.
    size : int
    solve : callable
        ``solve(start, stop, advance)`` solves and keeps the points from `start` to before `stop`,
        and calls ``advance`` with the number of points finished since its last call.
    progress : callable
        Called with the number of points done so far and of all points.
    """
    first, count = done, -(-(total - done) // size)
    progress(done, total)

    def advance(points: int) -> None:
        nonlocal done
        done += points
        progress(done, total)

    def task(chunks: tuple[int, ...], budget: float, give_up: bool = False, /) -> Report:
        report = Report()
        # The budget is ignored: chunks that are lines of one file must be written in order.
        for chunk in chunks:
            start = first + chunk * size
            stop = min(start + size, total)
            begin = time.perf_counter()
            solve(start, stop, advance)
            report.done.append(DoneChunk(chunk, stop - start, 0, time.perf_counter() - begin))
        return report

    counts = SweepProgress(total=total - first, chunk_total=count)
    solve_chunks(task, range(count), ThisProcess(), counts, lambda now: None, lambda line: None)
