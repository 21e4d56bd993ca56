"""What a worker does: it solves chunks and batches and writes them itself.

JAX must not be loaded when this module is imported: the number of its threads is set here, because
sums over several threads differ in their last bits from sums in one.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.errors import InputError
from asperity.outputs import differences
from asperity.sweep.run.numerics import numerics

if TYPE_CHECKING:
    from asperity.sweep.plan.points import Points
    from asperity.sweep.solve import Findings
    from asperity.sweep.store.store import SweepStore

#: Environment of a worker: one thread of XLA and of the linear algebra of NumPy, as Dask has it.
ENVIRONMENT = {
    "NPROC": "1",
    **dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
}


@dataclass(frozen=True)
class Job:
    """What all tasks of one run share.

    Attributes
    ----------
    store : str
        Path of the store.
    digest : str
        Of the plan in it.
    token : str
        Of the driver's lock; "" to write whoever has the lock.
    retry : bool
        Whether chunks with failed points are solved again.
    laws : tuple of str
        Places of laws that are neither of the package nor installed, ``path/to/file.py:Name``.
    folder : str
        Where files that the plan names lie.
    numerics : dict of str to str, optional
        `asperity.sweep.run.numerics.numerics` of the driver.
    """

    store: str
    digest: str
    token: str
    retry: bool = False
    laws: tuple[str, ...] = ()
    folder: str = ""
    numerics: Mapping[str, str] | None = None


@dataclass(frozen=True)
class Unit:
    """The smallest piece of work.

    Attributes
    ----------
    stage : {"first", "second", "finish", "give up"}
    chunk : int
    batch : int
        Number of the batch in the second stage; -1 otherwise.
    points : int
    """

    stage: str
    chunk: int
    batch: int = -1
    points: int = 0


@dataclass
class Report:
    """What a task has done.

    Attributes
    ----------
    done : list of tuple
        Units with the seconds they took and their failed points; -1 s where an earlier run had
        solved them.
    opened : list of Unit
        Batches of chunks whose first stage left points.
    finished : list of tuple
        Chunks that are in the store now, with their points and failed points.
    rest : list of Unit
        Units that there was no time for.
    messages : list of str
        Errors of the solver.
    memory : float
        Largest resident memory of the worker so far (bytes).
    worker : str
        Host and process.
    """

    done: list[tuple[Unit, float, int]] = field(default_factory=list)
    opened: list[Unit] = field(default_factory=list)
    finished: list[tuple[int, int, int]] = field(default_factory=list)
    rest: list[Unit] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    memory: float = 0.0
    worker: str = ""


class SupersededError(RuntimeError):
    """Another driver has the store: what this worker was asked for is no longer wanted."""


class WorkerError(InputError):
    """A worker that would give other numbers than the driver, or none."""


def work(job: Job, units: tuple[Unit, ...], budget: float) -> Report:
    """Do units one after the other until `budget` seconds are over, at least one.

    Raises
    ------
    OSError
        If the store cannot be written.
    SupersededError
        If another driver has taken the store.
    WorkerError
        If this process has several threads, other versions than the driver, or lacks a law.
    """
    _single_thread()
    _check_numerics(job)
    from asperity._jax import spare_mappings

    _register(job)
    worker = _worker(job.store, job.digest, job.folder, job.token)
    report = Report(worker=f"{platform.node()}:{os.getpid()}")
    begin = time.perf_counter()
    for i, unit in enumerate(units):
        if i and time.perf_counter() - begin > budget:
            report.rest = list(units[i:])
            break
        worker.do(job, unit, report)
        spare_mappings()
    report.memory = _largest_memory()
    return report


def _largest_memory() -> float:
    """Largest resident memory of this process so far (bytes); 0 where the system does not tell."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return 1024.0 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))
    except (OSError, ValueError, StopIteration):
        pass
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    # Bytes on macOS, kilobytes elsewhere.
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _clock() -> float:
    """Time for what a unit costs, which the compiler's, spent once, is not part of (s)."""
    from asperity._jax import seconds_compiling

    return time.perf_counter() - seconds_compiling()


def _single_thread() -> None:
    if "jax" not in sys.modules:
        os.environ.update(ENVIRONMENT)
    elif os.environ.get("NPROC") != "1":
        raise WorkerError(
            "workers must have one thread of JAX, got a process that loaded it with more; start "
            "the workers with the environment variable NPROC=1"
        )


def _check_numerics(job: Job) -> None:
    own = numerics()
    if job.numerics is not None and job.numerics != own:
        raise WorkerError(
            "workers must have the versions of the driver, got "
            f"{differences(job.numerics, own)} ({platform.node()}); start them from the same "
            "environment"
        )


def _register(job: Job) -> None:
    """Make laws known that the package does not bring."""
    from asperity.laws import get_law, known_law

    for place in job.laws:
        known_law(place)
    for name in _worker(job.store, job.digest, job.folder, job.token).grid.record["laws"]:
        try:
            get_law(name)
        except InputError:
            raise WorkerError(
                f"law must be known to the workers, got '{name}', which only the program has "
                "that started them; name it by its place, like law = 'my_law.py:MyLaw'"
            ) from None


@lru_cache(maxsize=1)
def _worker(store: str, digest: str, folder: str, driver: str) -> _Worker:
    """The store as the driver has opened it: the next one may have repaired or replaced it."""
    from asperity.sweep.store.store import SweepStore

    return _Worker(SweepStore(Path(store)), digest, folder)


class _Worker:
    """A store that is open for writing, and the solve of its plan."""

    def __init__(self, store: SweepStore, digest: str, folder: str) -> None:
        from asperity.sweep.solve import SOLVES
        from asperity.sweep.store.pieces import Pieces

        self.store, self.grid = store, store.grid
        if self.grid.digest != digest:
            raise SupersededError(f"{store.path} has another plan now")
        self.solve = SOLVES[store.record["solve"]]
        self.pieces = Pieces(store.path, digest)
        # The record names no folder: a store may move, and its data with it.
        self.record = {**store.record, "folder": folder}

    def do(self, job: Job, unit: Unit, report: Report) -> None:
        """Do one unit and report it."""
        stage = {
            "first": self._first,
            "second": self._second,
            "finish": self._finish,
            "give up": self._give_up,
        }[unit.stage]
        stage(job, unit, report)

    def _first(self, job: Job, unit: Unit, report: Report) -> None:
        from asperity.sweep.store.pieces import first_name

        begin = _clock()
        failed = self.store.failed_in(unit.chunk)
        again = job.retry and failed > 0
        if failed >= 0 and not again:
            if self.store.is_sound(unit.chunk):
                size = self.grid.size(unit.chunk)
                report.done.append((unit, -1.0, failed))
                report.finished.append((unit.chunk, size, failed))
                return
            report.messages.append(f"chunk {unit.chunk} was damaged and is solved again")
        if again:
            self.pieces.drop(unit.chunk)
        points = self.grid.at(unit.chunk)
        findings = self.pieces.load(first_name(unit.chunk))
        fresh = findings is None
        if findings is None:
            findings = self._guarded(self.solve.first, points, report)
        left = findings.left
        if not len(left):
            self._write(job, unit.chunk, findings, report)
        else:
            if not self.pieces.has(first_name(unit.chunk)):
                self.pieces.save(first_name(unit.chunk), findings)
            batches = self.solve.batches(points, left)
            report.opened += [
                Unit("second", unit.chunk, k, len(batch)) for k, batch in enumerate(batches)
            ]
        known = len(findings) - len(left)
        lost = findings.failed - len(left)
        solved = Unit("first", unit.chunk, -1, known)
        report.done.append((solved, _clock() - begin if fresh else -1.0, lost))

    def _second(self, job: Job, unit: Unit, report: Report) -> None:
        begin = _clock()
        points, _, batches = self._opened(unit.chunk, report)
        found, fresh = self._batch(unit.chunk, unit.batch, points, batches, report)
        seconds = _clock() - begin if fresh else -1.0
        report.done.append((unit, seconds, found.failed))

    def _finish(self, job: Job, unit: Unit, report: Report) -> None:
        begin = _clock()
        points, findings, batches = self._opened(unit.chunk, report)
        for k, index in enumerate(batches):
            findings.put(index, self._batch(unit.chunk, k, points, batches, report)[0])
        self._write(job, unit.chunk, findings, report)
        self.pieces.drop(unit.chunk)
        report.done.append((unit, _clock() - begin, 0))

    def _give_up(self, job: Job, unit: Unit, report: Report) -> None:
        """Record that the process which solved these points died each time."""
        from asperity.sweep.solve import Findings
        from asperity.sweep.solve.outcome import SweepOutcome
        from asperity.sweep.store.pieces import batch_name

        count = unit.points if unit.batch >= 0 else self.grid.size(unit.chunk)
        lost = Findings.empty(self.store.record["outputs"], count)
        lost.fail(lost.left, SweepOutcome.WORKER_LOST)
        if unit.batch >= 0:
            self.pieces.save(batch_name(unit.chunk, unit.batch), lost)
        else:
            self._write(job, unit.chunk, lost, report)
        report.done.append((unit, 0.0, count))

    def _opened(self, chunk: int, report: Report) -> tuple[Points, Findings, list[Any]]:
        """Points of a chunk, what its first stage found, and the batches it left."""
        from asperity.sweep.store.pieces import first_name

        points = self.grid.at(chunk)
        findings = self.pieces.load(first_name(chunk))
        if findings is None:
            findings = self._guarded(self.solve.first, points, report)
            self.pieces.save(first_name(chunk), findings)
        return points, findings, self.solve.batches(points, findings.left)

    def _batch(
        self, chunk: int, batch: int, points: Points, batches: list[Any], report: Report
    ) -> tuple[Findings, bool]:
        """What was found in a batch, and whether it was solved just now."""
        from asperity.sweep.store.pieces import batch_name

        kept = self.pieces.load(batch_name(chunk, batch))
        if kept is not None and len(kept) == len(batches[batch]):
            return kept, False
        found = self._guarded(self.solve.second, points.take(batches[batch]), report)
        self.pieces.save(batch_name(chunk, batch), found)
        return found, True

    def _guarded(
        self,
        solve: Callable[[Points, Any], Findings],
        points: Points,
        report: Report,
    ) -> Findings:
        """Solve; where the solver stops with an error, find the points that it stops at."""
        from asperity.sweep.solve import Findings
        from asperity.sweep.solve.outcome import SweepOutcome

        try:
            return solve(points, self.record)
        except (MemoryError, OSError):
            raise
        except Exception as error:
            found = Findings.empty(self.store.record["outputs"], len(points))
            if len(points) == 1:
                refused = isinstance(error, InputError)
                found.fail(
                    found.left,
                    SweepOutcome.REFUSED if refused else SweepOutcome.SOLVER_ERROR,
                )
                values = ", ".join(f"{n} = {v[0]:.9g}" for n, v in points.values.items())
                report.messages.append(f"{type(error).__name__}: {error} ({values})")
                return found
            half = len(points) // 2
            rows = found.left
            for part in (rows[:half], rows[half:]):
                found.put(part, self._guarded(solve, points.take(part), report))
            return found

    def _write(self, job: Job, chunk: int, findings: Findings, report: Report) -> None:
        from asperity.sweep.store.lock import current_token

        if job.token and current_token(self.store.path) != job.token:
            raise SupersededError(f"{self.store.path} belongs to another driver now")
        self.store.write(chunk, findings)
        report.finished.append((chunk, len(findings), findings.failed))
