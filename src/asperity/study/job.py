"""What a worker does: it solves chunks of a store and writes them itself.

JAX must not be loaded when this module is imported: the number of its threads is set here, because
sums over several threads differ in their last bits from sums in one.
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

#: Packages that the numbers come from.
_PACKAGES = ("jax", "jaxlib", "numpy", "scipy")
#: Parts of this package that do not compute a number of a sweep.
_ASIDE = ("app", "cli", "experiment", "figures", "fit_report", "ledger", "recording")


class SupersededError(RuntimeError):
    """Another driver has the store: the chunks of this task are no longer wanted."""


class WorkerError(InputError):
    """A worker that would give other numbers than the driver, or none."""


@dataclass(frozen=True)
class Job:
    """What all tasks of one run share; called with chunks, it solves and writes them.

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
        `numerics` of the driver.
    """

    store: str
    digest: str
    token: str
    retry: bool = False
    laws: tuple[str, ...] = ()
    folder: str = ""
    numerics: Mapping[str, str] | None = None

    def __call__(self, chunks: tuple[int, ...], budget: float, give_up: bool = False) -> Report:
        """Do chunks one after the other until `budget` seconds are over, at least one.

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
            self._do(chunk, give_up, report)
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
        """Make laws known that the package does not bring."""
        from asperity.laws import get_law, known_law

        for place in self.laws:
            known_law(place)
        for name in self._store.record["laws"]:
            try:
                get_law(name)
            except InputError:
                raise WorkerError(
                    f"law must be known to the workers, got '{name}', which only the program has "
                    "that started them; name it by its place, like law = 'my_law.py:MyLaw'"
                ) from None

    def _do(self, chunk: int, give_up: bool, report: Report) -> None:
        """See that a chunk is in the store; one that is, and whose files are whole, is done."""
        store = self._store
        size, failed = store.grid.size(chunk), store.failed_in(chunk)
        if failed >= 0 and not (self.retry and failed):
            if store.is_sound(chunk):
                report.done.append(DoneChunk(chunk, size, failed, None))
                return
            report.messages.append(f"chunk {chunk} was damaged and is solved again")
        begin = compiler_free_clock()
        points = store.grid.at(chunk)
        answers = self._lost(points) if give_up else self._solved(points, report)
        self._write(chunk, answers)
        seconds = compiler_free_clock() - begin
        report.done.append(DoneChunk(chunk, size, answers.failed, seconds))

    def _lost(self, points: Points) -> Answers:
        """Outcomes of points whose process died each time."""
        from asperity.study.outcome import Answers, SweepOutcome

        answers = Answers.empty(self._store.record["outputs"], len(points))
        answers.fail(slice(None), SweepOutcome.WORKER_LOST)
        return answers

    def _solved(self, points: Points, report: Report) -> Answers:
        """Solve; where the solver stops with an error, single out the points that it stops at."""
        from asperity.study.outcome import Answers, SweepOutcome
        from asperity.study.solve import SOLVES

        record = self._store.record
        try:
            # The record names no folder: a store may move, and its data with it.
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
    """The store as the driver `token` has opened it: the next one may have repaired it."""
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
    """A time without the compiler's, which is spent once and no measure of a chunk (s)."""
    from asperity._jax import seconds_compiling

    return time.perf_counter() - seconds_compiling()


def _largest_memory() -> float:
    """Largest resident memory of this process so far (bytes); 0 where the system has no answer."""
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
    """Version of an installed package, "" without it."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


@cache
def numerics() -> dict[str, str]:
    """What changes the last digits of a sweep: versions, kind of processor, code of the solver.

    Two runs with the same give the same bits.
    """
    return {
        "asperity": __version__,
        **{name: package_version(name) for name in _PACKAGES},
        "processor": platform.machine(),
        "solver": _digest_of_sources(),
    }


def _digest_of_sources() -> str:
    """Digest of the package's modules, which may change between versions where it is developed."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        place = file.relative_to(root)
        if place.parts[0] not in _ASIDE:
            digest.update(place.as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
