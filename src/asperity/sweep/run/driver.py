"""The driver: it hands out tasks in a rolling window and keeps count.

It holds no results: workers write chunks themselves and report counts. Its memory is that of the
window and of the batches of a bounded number of open chunks, whatever the size of the plan.
"""

from __future__ import annotations

import errno
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Any

from asperity.sweep.run.executors import Workers
from asperity.sweep.run.tasks import Job, Report, Unit, work

#: Seconds that a task is to take, about.
_TASK = 2.0
#: Tasks in the hands of a worker at a time: the next one is there when it ends one.
_WINDOW = 2
#: Chunks with points in the second stage at a time, for each worker.
_OPEN = 8
#: Units in a task.
_MOST_UNITS = 64
#: Times that a unit's process may die before the unit is given up; the last time it runs alone.
_LIVES = 3
#: Weight of the newest duration in the running mean.
_NEWEST = 0.3


class WorkersGoneError(RuntimeError):
    """The workers have ended, and nothing starts others."""


@dataclass
class SweepProgress:
    """How far a sweep is.

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
        Chunks in the store, and all.
    seconds : float
        Since the beginning of this run.
    memory : float
        Largest resident memory of a worker so far (bytes).
    lost : int
        Times that a worker process died.
    left : float
        Seconds left, about; NaN where nothing tells.
    spent, solved : dict of str to float
        Processor seconds of both stages, without the compiler's, and their points.
    """

    points: int = 0
    total: int = 0
    failed: int = 0
    stored: int = 0
    kept: int = 0
    chunks: int = 0
    chunk_total: int = 0
    seconds: float = 0.0
    memory: float = 0.0
    lost: int = 0
    left: float = float("nan")
    spent: dict[str, float] = field(default_factory=lambda: {"first": 0.0, "second": 0.0})
    solved: dict[str, float] = field(default_factory=lambda: {"first": 0.0, "second": 0.0})

    @property
    def rate(self) -> float:
        """Points solved per second in this run."""
        return (self.points - self.kept) / self.seconds if self.seconds > 0 else 0.0


@dataclass
class _Pace:
    """Durations seen so far.

    Attributes
    ----------
    unit : dict of str to float
        Running mean of the seconds of a unit, by stage.
    spent, points : dict of str to float
        Sums by stage.
    left : float
        Points that these first stages have left for second ones.
    """

    spent: dict[str, float]
    points: dict[str, float]
    unit: dict[str, float] = field(default_factory=dict)
    left: float = 0.0

    def note(self, unit: Unit, seconds: float) -> None:
        """Learn from a unit that was solved."""
        old = self.unit.get(unit.stage, seconds)
        self.unit[unit.stage] = old + _NEWEST * (seconds - old)
        if unit.stage in self.spent:
            self.spent[unit.stage] += seconds
            self.points[unit.stage] += unit.points

    def together(self, stage: str) -> int:
        """Units of a stage that make a task of the wanted duration."""
        seconds = self.unit.get(stage)
        if seconds is None:
            return 1
        return max(1, min(_MOST_UNITS, round(_TASK / max(seconds, 1e-3))))

    def seconds_left(self, first: float, second: float) -> float:
        """Processor time for points of both stages that are left; NaN before any was solved."""
        seen = self.points["first"] + self.left
        if (first and not seen) or ((second or self.left) and not self.points["second"]):
            return float("nan")
        hard = self.spent["second"] / self.points["second"] if self.points["second"] else 0.0
        if not first:
            return second * hard
        each = self.spent["first"] / seen + self.left / seen * hard
        return first * each + second * hard


class Driver:
    """One run over the chunks of a store.

    Parameters
    ----------
    job : Job
    chunks : iterator of Unit
        First stages of all chunks, in order.
    workers : Workers
    progress : SweepProgress
        With the totals; counted up here.
    tick : callable
        Called with `progress` at least once a second.
    log : callable
        Called with a line about what went wrong.
    """

    def __init__(
        self,
        job: Job,
        chunks: Iterator[Unit],
        workers: Workers,
        progress: SweepProgress,
        tick: Callable[[SweepProgress], None],
        log: Callable[[str], None],
    ) -> None:
        self.job, self.workers, self.progress = job, workers, progress
        self.tick, self.log = tick, log
        self._chunks = chunks
        self._again: deque[Unit] = deque()
        self._second: deque[Unit] = deque()
        self._finish: deque[Unit] = deque()
        self._suspects: deque[Unit] = deque()
        self._open: dict[int, int] = {}
        self._deaths: dict[Unit, int] = {}
        self._running: dict[Future[Report], tuple[Unit, ...]] = {}
        self._pace = _Pace(spent=progress.spent, points=progress.solved)
        self._looked_at = 0
        self._begin = time.perf_counter()

    def run(self) -> None:
        """Solve everything.

        Raises
        ------
        OSError
            If a worker could not write.
        WorkersGoneError
            If the cluster has ended.
        """
        while True:
            self._fill()
            if not self._running:
                return
            done, _ = wait(self._running, timeout=0.5, return_when=FIRST_COMPLETED)
            dead: list[Unit] = []
            for future in done:
                units = self._running.pop(future)
                try:
                    report = future.result()
                except self.workers.lost:
                    dead += units
                except self.workers.gone:
                    raise WorkersGoneError from None
                else:
                    self._take(report)
            if dead:
                self._bury(dead)
            self._estimate()
            self.tick(self.progress)

    def _fill(self) -> None:
        """Keep the window full."""
        if self._suspects:
            # A unit whose process has died before runs alone, so that it is known who is to blame.
            if not self._running:
                self._submit((self._suspects.popleft(),))
            return
        window = _WINDOW * self.workers.count
        while len(self._running) < window:
            units = self._next(window)
            if not units:
                return
            self._submit(units)

    def _submit(self, units: tuple[Unit, ...]) -> None:
        try:
            self._running[self.workers.submit(work, self.job, units, _TASK)] = units
        except self.workers.gone:
            raise WorkersGoneError from None

    def _next(self, window: int) -> tuple[Unit, ...]:
        """The units of the next task; none where nothing can be handed out now."""
        if self._finish:
            return self._several(self._finish, "finish")
        hard = sum(units[0].stage == "second" for units in self._running.values())
        # Hard points get half of the window while there are others: neither kind waits for the
        # other, and the hard ones, which take longest, begin early.
        if self._second and hard < max(1, window // 2):
            return self._several(self._second, "second")
        if len(self._open) < _OPEN * self.workers.count:
            units = self._chunks_together()
            if units:
                return units
        return self._several(self._second, "second") if self._second else ()

    def _several(self, queue: deque[Unit], stage: str) -> tuple[Unit, ...]:
        share = -(-len(queue) // self.workers.count)
        count = min(self._pace.together(stage), share)
        return tuple(queue.popleft() for _ in range(min(count, len(queue))))

    def _chunks_together(self) -> tuple[Unit, ...]:
        """First stages for a task: those given back before new ones."""
        left = self.progress.chunk_total - self.progress.chunks
        share = -(-left // (2 * self.workers.count))
        wanted = max(1, min(self._pace.together("first"), share))
        units: list[Unit] = []
        while len(units) < wanted:
            unit = self._again.popleft() if self._again else next(self._chunks, None)
            if unit is None:
                break
            units.append(unit)
        return tuple(units)

    def _take(self, report: Report) -> None:
        progress = self.progress
        progress.memory = max(progress.memory, report.memory)
        for message in report.messages:
            self.log(message)
        found = {
            unit.chunk for unit, seconds, _ in report.done if unit.stage == "first" and seconds < 0
        }
        stored = found & {chunk for chunk, _, _ in report.finished}
        for unit in report.opened:
            self._second.append(unit)
            self._open[unit.chunk] = self._open.get(unit.chunk, 0) + 1
            # What an earlier run left half done is mostly hard, and says nothing of the rest.
            if unit.chunk not in found:
                self._pace.left += unit.points
        for unit, seconds, failed in report.done:
            kept = seconds < 0
            if not kept:
                self._pace.note(unit, seconds)
            if unit.stage == "first" and unit.chunk in stored:
                continue  # counted below
            if unit.stage in ("first", "second"):
                progress.points += unit.points
                progress.failed += failed
                progress.kept += unit.points if kept else 0
            if unit.stage == "give up":
                progress.points += failed
                progress.failed += failed
            if unit.batch >= 0:
                self._open[unit.chunk] -= 1
                if not self._open[unit.chunk]:
                    self._finish.append(Unit("finish", unit.chunk))
        for chunk, points, failed in report.finished:
            progress.chunks += 1
            self._open.pop(chunk, None)
            if chunk in stored:
                progress.points += points
                progress.kept += points
                progress.failed += failed
                self._looked_at += points
        for unit in reversed(report.rest):
            queue = {"first": self._again, "second": self._second, "finish": self._finish}
            queue[unit.stage].appendleft(unit)

    def _bury(self, units: list[Unit]) -> None:
        """Hand out again what died with its process; give up what kills its process each time."""
        self.progress.lost += 1
        self.log(f"a worker process died with {len(units)} units at work; they are done again")
        self.workers.restart()
        for unit in units:
            deaths = self._deaths[unit] = self._deaths.get(unit, 0) + 1
            if deaths >= _LIVES and unit.stage in ("first", "second"):
                self._suspects.append(Unit("give up", unit.chunk, unit.batch, unit.points))
                self.log(f"chunk {unit.chunk} kills its process each time; its points are given up")
            elif deaths == _LIVES - 1:
                self._suspects.append(unit)
            else:
                queue = {"first": self._again, "second": self._second, "finish": self._finish}
                queue.get(unit.stage, self._suspects).append(unit)

    def _estimate(self) -> None:
        progress = self.progress
        progress.seconds = time.perf_counter() - self._begin
        second = sum(u.points for u in self._second)
        second += sum(u.points for units in self._running.values() for u in units
                      if u.stage == "second")  # fmt: skip
        # Chunks that were done when this run began cost it nothing, looked at already or not.
        stored = max(0, progress.stored - self._looked_at)
        first = max(0, progress.total - progress.points - second - stored)
        work_left = self._pace.seconds_left(first, second)
        progress.left = work_left / self.workers.count


def is_full(error: OSError) -> bool:
    """Whether an error says that there is no room."""
    return error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def units_of(count: int, size: Callable[[int], int], some: Any = None) -> Iterator[Unit]:
    """First stages of the chunks `some`, or of all `count`."""
    for chunk in range(count) if some is None else some:
        yield Unit("first", chunk, -1, size(chunk))
