"""The engine: chunks of points are handed out, solved, written and counted.

Tables, maps and sweeps all run here. A task is some chunks; whoever does it solves them, writes
each where it belongs and reports counts. The engine holds no results: its memory is that of the
window of tasks at work, whatever the number of chunks.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Protocol

from asperity.study.workers import ThisProcess, Workers

#: Seconds that a task is to take, about.
_TASK = 2.0
#: Tasks in the hands of a worker at a time: the next one is there when it ends one.
_WINDOW = 2
#: Chunks in a task.
_MOST_CHUNKS = 64
#: Times that the process of a chunk may die before the chunk is given up; the last time it runs
#: alone, so that it is known which chunk is to blame.
_LIVES = 3
#: Weight of the newest duration in the running mean.
_NEWEST = 0.3


class WorkersGoneError(RuntimeError):
    """The workers have ended, and nothing starts others."""


@dataclass(frozen=True)
class DoneChunk:
    """A chunk that is in its place.

    Attributes
    ----------
    chunk, points, failed : int
    seconds : float, optional
        That it took, without those of the compiler; None where an earlier run had solved it.
    """

    chunk: int
    points: int
    failed: int
    seconds: float | None


@dataclass
class Report:
    """What a task has done.

    Attributes
    ----------
    done : list of DoneChunk
    left : tuple of int
        Chunks that there was no time for.
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
    """Solves and writes chunks."""

    def __call__(self, chunks: tuple[int, ...], budget: float, give_up: bool = False, /) -> Report:
        """Do at least one chunk, and others while less than `budget` seconds have passed.

        With `give_up` the chunks are not solved: their points fail.
        """
        ...


@dataclass
class SweepProgress:
    """How far a study is.

    Attributes
    ----------
    points, total : int
        Points that have an answer, of earlier runs too, and all.
    failed : int
        Points without a converged answer among them.
    stored : int
        Points of chunks that were done when this run began.
    kept : int
        Points with an answer that this run did not solve, of those counted so far.
    chunks, chunk_total : int
        Chunks that are done, and all.
    seconds : float
        Since the beginning of this run.
    spent : float
        Seconds of all workers for the points solved in this run, without those of the compiler.
    memory : float
        Largest resident memory of a worker so far (bytes).
    lost : int
        Times that a worker process died.
    left : float
        Seconds left, about; NaN where nothing tells.
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
        """Count what a task has done."""
        self.memory = max(self.memory, report.memory)
        for one in report.done:
            self.chunks += 1
            self.points += one.points
            self.failed += one.failed
            if one.seconds is None:
                self.kept += one.points
            else:
                self.spent += one.seconds

    def estimate(self, seconds: float, workers: int) -> None:
        """Note the time since the beginning, and from it the time that is left."""
        self.seconds = seconds
        # Chunks that were done when this run began cost it nothing, looked at already or not.
        points_left = self.total - self.points - max(0, self.stored - self.kept)
        solved = self.points - self.kept
        if points_left <= 0:
            self.left = 0.0
        elif solved:
            self.left = points_left * self.spent / solved / workers


class _Engine:
    """One run over some chunks; the arguments are those of `solve_chunks`."""

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
        """Keep the window full."""
        if self._suspects:
            if not self._running:
                chunk = self._suspects.popleft()
                self._submit((chunk,), give_up=self._deaths[chunk] >= _LIVES)
            return
        while len(self._running) < _WINDOW * self.workers.count:
            chunks = self._next()
            if not chunks:
                return
            self._submit(chunks)

    def _submit(self, chunks: tuple[int, ...], give_up: bool = False) -> None:
        try:
            self._running[self.workers.submit(self.task, chunks, _TASK, give_up)] = chunks
        except self.workers.gone:
            raise WorkersGoneError from None

    def _next(self) -> tuple[int, ...]:
        """Chunks of the next task, those handed back before new ones."""
        left = self.progress.chunk_total - self.progress.chunks
        share = -(-left // (2 * self.workers.count))
        pace = 1 if self._seconds is None else round(_TASK / max(self._seconds, 1e-3))
        chunks: list[int] = []
        while len(chunks) < max(1, min(pace, share, _MOST_CHUNKS)):
            chunk = self._again.popleft() if self._again else next(self._fresh, None)
            if chunk is None:
                break
            chunks.append(chunk)
        return tuple(chunks)

    def _take(self, report: Report) -> None:
        self.progress.add(report)
        for message in report.messages:
            self.log(message)
        for one in report.done:
            if one.seconds is not None:
                mean = one.seconds if self._seconds is None else self._seconds
                self._seconds = mean + _NEWEST * (one.seconds - mean)
        self._again.extendleft(reversed(report.left))

    def _repeat(self, chunks: list[int]) -> None:
        """Hand out again what died with its process."""
        self.progress.lost += 1
        self.log(f"a worker process died with {len(chunks)} chunks at work; they are done again")
        self.workers.restart()
        for chunk in chunks:
            self._deaths[chunk] += 1
            alone = self._deaths[chunk] >= _LIVES - 1
            (self._suspects if alone else self._again).append(chunk)
            if self._deaths[chunk] == _LIVES:
                self.log(f"chunk {chunk} kills its process each time; its points are given up")


def solve_chunks(
    task: Task,
    chunks: Iterable[int],
    workers: Workers,
    progress: SweepProgress,
    tick: Callable[[SweepProgress], None],
    log: Callable[[str], None],
) -> None:
    """Have every chunk solved and written, and count.

    Parameters
    ----------
    task : Task
        Goes to another process where the workers are processes.
    chunks : iterable of int
        Numbers of the chunks, in the order in which they are handed out.
    workers : Workers
    progress : SweepProgress
        With the totals; counted up here.
    tick : callable
        Called with `progress` at least once a second.
    log : callable
        Called with a line about what went wrong.

    Raises
    ------
    OSError
        If a chunk could not be written.
    WorkersGoneError
        If the workers have ended for good.
    """
    _Engine(task, chunks, workers, progress, log).run(tick)


def solve_here(
    total: int,
    size: int,
    solve: Callable[[int, int, Callable[[int], None]], None],
    progress: Callable[[int, int], None],
    done: int = 0,
) -> None:
    """Chunks of at most `size` points, one after the other in this process.

    Parameters
    ----------
    total, done : int
        All points, and those that are done already: the first ones.
    size : int
    solve : callable
        Solves and keeps the points from its first to before its second argument; the third is to
        be called with the number of points finished since the last call.
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
        # All of them, whatever the budget: the order counts where chunks are lines of one file.
        for chunk in chunks:
            start = first + chunk * size
            stop = min(start + size, total)
            begin = time.perf_counter()
            solve(start, stop, advance)
            report.done.append(DoneChunk(chunk, stop - start, 0, time.perf_counter() - begin))
        return report

    counts = SweepProgress(total=total - first, chunk_total=count)
    solve_chunks(task, range(count), ThisProcess(), counts, lambda now: None, lambda line: None)
