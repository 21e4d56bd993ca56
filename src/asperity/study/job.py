"""The job of a worker: solve chunks of a sweep and write them to the store.

JAX must not be loaded before this module sets its number of threads to one: sums over several
threads differ in their last bits from sums in one thread.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from asperity._version import __version__
from asperity.errors import InputError
from asperity.outputs import differences
from asperity.study.engine import DoneChunk, Report
from asperity.study.workers import ENVIRONMENT

if TYPE_CHECKING:
    from asperity.study.outcome import Answers
    from asperity.study.points import Points
    from asperity.study.store.store import SweepStore

#: Packages whose version may change the last digits of a number.
_PACKAGES = ("jax", "jaxlib", "numpy", "scipy")
#: Rooms of this package that compute no number of a sweep.
_NOT_NUMERICAL = ("app", "cli", "experiment", "figures", "fit_report", "ledger", "recording")


class SupersededError(RuntimeError):
    """Another driver has taken the store; this task must not write to it."""


class WorkerError(InputError):
    """A worker whose numbers would differ from the driver's, or that cannot solve at all."""


@dataclass(frozen=True)
class Job:
    """The `Task` of a sweep: called with numbers of chunks, it solves and writes these chunks.

    Attributes
    ----------
    store : str
        Path of the store.
    digest : str
        SHA-256 of the plan in the store.
    token : str
        Token of the driver's lock; "" to write without checking the lock.
    retry : bool
        Whether chunks with failed points are solved again.
    laws : tuple of str
        Laws in files or modules that the worker must load, like ``path/to/file.py:Name``.
    folder : str
        Folder of the files that the plan names.
    numerics : dict of str to str, optional
        Return value of `numerics` in the driver.
    """

    store: str
    digest: str
    token: str
    retry: bool = False
    laws: tuple[str, ...] = ()
    folder: str = ""
    numerics: Mapping[str, str] | None = None

    def __call__(self, chunks: tuple[int, ...], budget: float, give_up: bool = False) -> Report:
        """Solve and write at least one chunk, and further chunks until `budget` seconds are over.

        Raises
        ------
        OSError
            If the store cannot be written.
        SupersededError
            If another driver has taken the store.
        WorkerError
            If this process has several threads, other versions than the driver, or lacks a law.
        """
        _require_one_thread()
        self._require_same_numerics()
        from asperity._jax import spare_mappings

        self._require_laws()
        report = Report()
        begin = time.perf_counter()
        for i, chunk in enumerate(chunks):
            if i and time.perf_counter() - begin > budget:
                report.left = chunks[i:]
                break
            self._complete(chunk, give_up, report)
            spare_mappings()
        report.memory = _largest_memory()
        return report

    @property
    def _store(self) -> SweepStore:
        return _opened(self.store, self.digest, self.token)

    def _require_same_numerics(self) -> None:
        here = numerics()
        if self.numerics is not None and self.numerics != here:
            raise WorkerError(
                "workers must have the versions of the driver, got "
                f"{differences(self.numerics, here)} ({platform.node()}); start them from the same "
                "environment"
            )

    def _require_laws(self) -> None:
        """Register the laws of the plan that are not part of the package."""
        from asperity.laws import get_law, known_law

        for place in self.laws:
            known_law(place)
        for name in self._store.record["laws"]:
            try:
                get_law(name)
            except InputError:
                raise WorkerError(
                    f"law must be known to the workers, got '{name}', which only the program that "
                    "started them has registered; name its file, like law = 'my_law.py:MyLaw'"
                ) from None

    def _complete(self, chunk: int, give_up: bool, report: Report) -> None:
        """Solve and write a chunk, unless the store has it and its files are undamaged."""
        store = self._store
        size, failed = store.grid.size(chunk), store.failed_in(chunk)
        if failed >= 0 and not (self.retry and failed):
            if store.is_sound(chunk):
                report.done.append(DoneChunk(chunk, size, failed, None))
                return
            report.messages.append(f"chunk {chunk} was damaged and is solved again")
        begin = compiler_free_clock()
        points = store.grid.at(chunk)
        answers = self._worker_lost(points) if give_up else self._solved(points, report)
        self._write(chunk, answers)
        seconds = compiler_free_clock() - begin
        report.done.append(DoneChunk(chunk, size, answers.failed, seconds))

    def _worker_lost(self, points: Points) -> Answers:
        """Outcomes of points whose process died at every attempt."""
        from asperity.study.outcome import Answers, SweepOutcome

        answers = Answers.empty(self._store.record["outputs"], len(points))
        answers.fail(slice(None), SweepOutcome.WORKER_LOST)
        return answers

    def _solved(self, points: Points, report: Report) -> Answers:
        """Solve points; after an error of the solver, find the failing points by bisection."""
        from asperity.study.outcome import Answers, SweepOutcome
        from asperity.study.solve import SOLVES

        record = self._store.record
        try:
            # The folder is not part of the record, because store and data may be moved.
            return SOLVES[record["solve"]].solve(points, {**record, "folder": self.folder})
        except (MemoryError, OSError):
            raise
        except Exception as error:
            answers = Answers.empty(record["outputs"], len(points))
            if len(points) == 1:
                refused = isinstance(error, InputError)
                answers.fail(0, SweepOutcome.REFUSED if refused else SweepOutcome.SOLVER_ERROR)
                values = ", ".join(f"{n} = {v[0]:.9g}" for n, v in points.values.items())
                report.messages.append(f"{type(error).__name__}: {error} ({values})")
                return answers
            half = len(points) // 2
            for part in (slice(None, half), slice(half, None)):
                answers.put(part, self._solved(points.take(part), report))
            return answers

    def _write(self, chunk: int, answers: Answers) -> None:
        from asperity.study.store.lock import current_token

        store = self._store
        if self.token and current_token(store.path) != self.token:
            raise SupersededError(f"{store.path} belongs to another driver now")
        store.write(chunk, answers)


@lru_cache(maxsize=1)
def _opened(path: str, digest: str, token: str) -> SweepStore:
    """The open store; opened again for each `token`, as the next driver may have repaired it."""
    from asperity.study.store.store import SweepStore

    store = SweepStore(Path(path))
    if store.grid.digest != digest:
        raise SupersededError(f"{store.path} has another plan now")
    return store


def _require_one_thread() -> None:
    if "jax" not in sys.modules:
        os.environ.update(ENVIRONMENT)
    elif os.environ.get("NPROC") != "1":
        raise WorkerError(
            "workers must have one thread of JAX, got a process that loaded it with more; start "
            "the workers with the environment variable NPROC=1"
        )


def compiler_free_clock() -> float:
    """A clock that stops during compilation, which is not part of the time of a chunk (s)."""
    from asperity._jax import seconds_compiling

    return time.perf_counter() - seconds_compiling()


def _largest_memory() -> float:
    """Largest resident memory of this process so far (bytes); 0 where it is unknown."""
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


def package_version(package: str) -> str:
    """Version of a package; "" if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


@cache
def numerics() -> dict[str, str]:
    """Versions, type of processor and digest of the solver's code.

    Two runs with equal `numerics` give bit for bit the same numbers.
    """
    return {
        "asperity": __version__,
        **{name: package_version(name) for name in _PACKAGES},
        "processor": platform.machine(),
        "solver": _digest_of_sources(),
    }


def _digest_of_sources() -> str:
    """Digest of the numerical modules: under development they change without a new version."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        place = file.relative_to(root)
        if place.parts[0] not in _NOT_NUMERICAL:
            digest.update(place.as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
