"""The job of a worker: solve a chunk of a sweep and write it to the store.

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
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from asperity._processes import ENVIRONMENT
from asperity._version import __version__
from asperity.arrays import Index
from asperity.errors import InputError
from asperity.outputs import differences
from asperity.study.engine import DoneChunk

if TYPE_CHECKING:
    from asperity.study.points import Answers, Points
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
    """The task of a sweep: called with the number of a chunk, it solves and writes the chunk.

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
    numerics: Mapping[str, str] | None = field(default=None, hash=False)

    def __call__(self, chunk: int, give_up: bool = False) -> DoneChunk:
        """Solve and write a chunk, unless the store has it and its files are undamaged.

        Raises
        ------
        OSError
            If the store cannot be written.
        SupersededError
            If another driver has taken the store.
        WorkerError
            If this process has several threads, other versions than the driver, or lacks a law.
        """
        store = _opened(self)
        from asperity._jax import spare_mappings
        from asperity.study.points import Answers, SweepOutcome
        from asperity.study.store.lock import current_token

        messages: list[str] = []
        size, failed = store.grid.size(chunk), store.failed_in(chunk)
        if failed >= 0 and not (self.retry and failed):
            if store.is_sound(chunk):
                return DoneChunk(size, failed, None)
            messages.append(f"chunk {chunk} was damaged and is solved again")
        begin = compiler_free_clock()
        answers = Answers.empty(store.record["outputs"], size)
        if give_up:
            answers.fail(slice(None), SweepOutcome.WORKER_LOST)
        else:
            self._solve(store.grid.at(chunk), answers, np.arange(size), messages)
        if self.token and current_token(store.path) != self.token:
            raise SupersededError(f"{store.path} belongs to another driver now")
        store.write(chunk, answers)
        seconds = compiler_free_clock() - begin
        spare_mappings()
        return DoneChunk(size, answers.failed, seconds, tuple(messages), _largest_memory())

    def _solve(self, points: Points, answers: Answers, rows: Index, messages: list[str]) -> None:
        """Solve the points `rows`; after an error find the failing points by bisection."""
        from asperity.study.points import SweepOutcome
        from asperity.study.solve import SOLVES

        record = _opened(self).record
        try:
            # The folder is not part of the record, because store and data may be moved.
            solved = SOLVES[record["solve"]].solve(
                points.take(rows), {**record, "folder": self.folder}
            )
        except (MemoryError, OSError):
            raise
        except Exception as error:
            if len(rows) > 1:
                for half in np.array_split(rows, 2):
                    self._solve(points, answers, half, messages)
                return
            refused = isinstance(error, InputError)
            answers.fail(rows, SweepOutcome.REFUSED if refused else SweepOutcome.SOLVER_ERROR)
            values = ", ".join(f"{n} = {v[rows[0]]:.9g}" for n, v in points.values.items())
            messages.append(f"{type(error).__name__}: {error} ({values})")
        else:
            answers.put(rows, solved)


@lru_cache(maxsize=1)
def _opened(job: Job) -> SweepStore:
    """The store of a job, after checks of this process; opened again for the next driver's job."""
    if "jax" not in sys.modules:
        os.environ.update(ENVIRONMENT)
    elif os.environ.get("NPROC") != "1":
        raise WorkerError(
            "workers must have one thread of JAX, got a process that loaded it with more; start "
            "the workers with the environment variable NPROC=1"
        )
    here = numerics()
    if job.numerics is not None and job.numerics != here:
        raise WorkerError(
            "workers must have the versions of the driver, got "
            f"{differences(job.numerics, here)} ({platform.node()}); start them from the same "
            "environment"
        )
    from asperity.laws import get_law, known_law
    from asperity.study.store.store import SweepStore

    for place in job.laws:
        known_law(place)
    store = SweepStore(Path(job.store))
    if store.grid.digest != job.digest:
        raise SupersededError(f"{store.path} has another plan now")
    for name in store.record["laws"]:
        try:
            get_law(name)
        except InputError:
            raise WorkerError(
                f"law must be known to the workers, got '{name}', which only the program that "
                "started them has registered; name its file, like law = 'my_law.py:MyLaw'"
            ) from None
    return store


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
