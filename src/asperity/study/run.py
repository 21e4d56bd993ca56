"""A sweep from its plan to its store, and an estimate of its time and size from a few points."""

from __future__ import annotations

import contextlib
import errno
import os
import platform
import shutil
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from asperity._processes import available_cores, process_count
from asperity._version import __version__
from asperity.errors import InputError, listed
from asperity.laws import get_law
from asperity.materials import cited_works, load_from
from asperity.outputs import differences, free_disk, require_disk, require_short, size_text
from asperity.parameters.arguments import FilePath, typed
from asperity.parameters.toml_file import file_content
from asperity.study.engine import SweepProgress, WorkersGoneError, solve_chunks
from asperity.study.grid import SweepGrid
from asperity.study.job import Job, WorkerError, numerics, package_version
from asperity.study.plan import SweepPlan, is_extension, law_places, load_plan
from asperity.study.solve import SOLVES
from asperity.study.store.layout import create, extend, fresh_folder, lay_out
from asperity.study.store.lock import StoreLock, lock_file, store_lock
from asperity.study.store.root import read_root
from asperity.study.store.store import SweepStore
from asperity.study.workers import Workers, local_cluster, local_processes, scheduler

#: Seconds between updates of the lock file, which show that the driver runs: a twelfth of the time
#: after which the lock counts as left behind.
_REFRESH = 5.0
_TIME = "%Y-%m-%dT%H:%M:%S%z"
#: Packages whose versions a run records, besides those of `numerics`.
_PACKAGES = ("zarr", "loky", "distributed")


@typed
def run_sweep(
    plan: SweepPlan | str | os.PathLike[str],
    out: FilePath,
    *,
    workers: Annotated[int, process_count] | Workers | None = None,
    cluster: Annotated[int, process_count] | None = None,
    address: str | None = None,
    extend_store: bool = False,
    retry_failed: bool = False,
    progress: Callable[[SweepProgress], None] | None = None,
    log: Callable[[str], None] | None = None,
) -> SweepProgress:
    """Solve every point of a plan and write it to a Zarr store.

    The same call continues after an interruption of any kind: chunks that are done and undamaged
    are kept. The numbers do not depend on the number of workers.

    Parameters
    ----------
    plan : SweepPlan or path
    out : path
        Folder of the store.
    workers : int or Workers, optional
        Number of processes on this machine, the number of cores by default; or any other
        `asperity.study.workers.Workers`.
    cluster : int, optional
        Number of workers of a Dask cluster on this machine, in place of `workers`.
    address : str, optional
        Address of a Dask scheduler, in place of `workers`.
    extend_store : bool
        Whether the plan may append rows to the axes of the store.
    retry_failed : bool
        Whether to solve chunks with failed points again, with this version of the package.
    progress : callable, optional
        Called with a `SweepProgress` at least once a second.
    log : callable, optional
        Called with a line of text for every error and repair.

    Returns
    -------
    SweepProgress
        Counts of the finished run.

    Raises
    ------
    InputError
        If the plan has mistakes, the store has another plan or is in use, or the disk is full.
    """
    path = Path(out).resolve()
    require_short(path, (fresh_folder(path), lock_file(path)))
    log = log or (lambda line: None)
    text = ""
    if not isinstance(plan, SweepPlan):
        file, plan = plan, load_plan(plan)
        # The text of a pipe cannot be read a second time.
        text = file_content(Path(file)).decode("utf-8-sig") if Path(file).is_file() else ""
    grid = SweepGrid.of(plan)
    pool = _workers(workers, cluster, address)
    with store_lock(path) as lock, ExitStack() as stack:
        fresh = not path.exists()
        if fresh:
            # Called after the workers have ended.
            stack.push(partial(_remove_refused, path))
        # Coordinates are written first.
        numbers = sum(axis.length * len(axis.names) for axis in grid.axes)
        what = f"{numbers:.3g} numbers along them"
        require_disk(8.0 * numbers, path.parent, "axes", what, "shorten them")
        with _writing(path):
            store = _opened(path, plan, text, grid, extend_store, retry_failed, log)
            swept = store.sweep_orphans()
        if swept:
            log(f"{swept} half-written files of killed processes were removed")
        try:
            # Bytes of the chunks that are not done, uncompressed.
            missing = (1 - store.share_done()) * store.grid.bytes
            require_disk(missing, path.parent, "out", f"{store.grid.points:,} points",
                         "choose another disk or fewer outputs")  # fmt: skip
            pool_workers = stack.enter_context(pool)
            with _writing(path):
                # With --retry-failed the versions may differ from the first run's; each run
                # records its own.
                runs = [*store.root.runs, _started(pool_workers)]
                store.update_attributes(runs=runs, numerics=numerics())
        except InputError:
            # A run that is refused leaves no new store.
            if fresh:
                shutil.rmtree(path)
            raise
        job = Job(
            str(store.path), store.grid.digest, lock.token, retry_failed, law_places(plan),
            str(plan.folder.resolve()), numerics(),
        )  # fmt: skip
        return _run(store, lock, pool_workers, job, runs, progress, log)


def _remove_refused(path: Path, kind: object, error: object, trace: object) -> None:
    """Remove a new store if the workers refused it before a chunk was done."""
    if isinstance(error, WorkerError) and SweepStore(path).share_done() <= 0:
        shutil.rmtree(path)


def _workers(
    workers: int | Workers | None, cluster: int | None, address: str | None
) -> AbstractContextManager[Workers]:
    choices = {"workers": workers, "cluster": cluster, "scheduler": address}
    chosen = [name for name, value in choices.items() if value is not None]
    if len(chosen) > 1:
        rule = "be the only choice of where to run"
        raise InputError(f"{chosen[0]}", rule, " and ".join(chosen), "leave all but one out")
    if cluster is not None:
        return local_cluster(cluster)
    if address is not None:
        return scheduler(address)
    if isinstance(workers, Workers):
        return nullcontext(workers)
    return local_processes(available_cores() if workers is None else workers)


def _opened(
    path: Path,
    plan: SweepPlan,
    text: str,
    grid: SweepGrid,
    extending: bool,
    retry: bool,
    log: Callable[[str], None],
) -> SweepStore:
    """The store of the plan: created, or that of an earlier run, repaired and extended."""
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        if path.exists():
            path.rmdir()
        create(path, grid, _attributes(plan, text, grid))
        return SweepStore(path)
    root = read_root(path)
    made = root.attributes["numerics"]
    if made != numerics() and not retry:
        raise InputError(
            "out",
            "be continued with the versions that began it",
            f"'{path.name}' with {differences(made, numerics())}, so that last digits may differ",
            "finish it with those versions, or choose another store",
        )
    old = root.grid.record
    if old == grid.record:
        written = [root.damage] if root.damage else []
        written += lay_out(path, root.grid, {**root.attributes, "runs": root.runs})
        if written:
            log(
                "missing or damaged files of the store were written again: "
                + listed(written, most=5)
            )
        return SweepStore(path)
    if extending and is_extension(old, grid.record):
        grid = SweepGrid(grid.record, root.grid.chunks)
        extend(path, root, grid, _attributes(plan, text, grid))
        return SweepStore(path)
    changed = differences(old, grid.record)
    advice = "its axes may only become longer" if extending else (
        "change the plan back, choose another store, or add points to the end of axes with --extend"
    )  # fmt: skip
    raise InputError(path.name, "have the same plan", changed, advice)


def _attributes(plan: SweepPlan, text: str, grid: SweepGrid) -> dict[str, Any]:
    works: dict[str, str] = {}
    for law in grid.record["laws"]:
        works |= cited_works(get_law(law).source)
    if plan.material:
        works |= cited_works(load_from(plan.folder, plan.material).source)
    return {
        "title": plan.title or f"Sweep of {grid.points:,} points",
        "source": f"asperity {__version__}",
        "asperity_version": __version__,
        "numerics": numerics(),
        "plan_text": text,
        "relative_tolerance": 1e-8,
        "convention": "F/W0 = mean_friction + sum mu_n cos(n w t + phase_n), w(t) = W/W0",
        "references": [works[key] for key in sorted(works)],
    }


def _run(
    store: SweepStore,
    lock: StoreLock,
    workers: Workers,
    job: Job,
    runs: list[dict[str, Any]],
    progress: Callable[[SweepProgress], None] | None,
    log: Callable[[str], None],
) -> SweepProgress:
    grid = store.grid
    counts = SweepProgress(store.path, total=grid.points, chunk_total=grid.chunk_count)
    if not job.retry:
        counts.stored = round(store.share_done() * grid.points)
    refreshed = time.monotonic()

    def tick(now: SweepProgress) -> None:
        nonlocal refreshed
        if time.monotonic() - refreshed > _REFRESH:
            lock.refresh()
            refreshed = time.monotonic()
        if progress is not None:
            progress(now)

    try:
        with _writing(store.path, counts):
            solve_chunks(job, range(grid.chunk_count), workers, counts, tick, log)
    except WorkersGoneError:
        raise InputError(
            "workers",
            "run until the sweep ends",
            f"no answer any more ({workers.about}) after {counts.points:,} of {counts.total:,} "
            "points",
            "start a cluster and repeat the command, which continues from there",
        ) from None
    finally:
        with contextlib.suppress(OSError):
            runs[-1] |= {
                "ended": time.strftime(_TIME),
                "seconds": round(counts.seconds, 3),
                "points_solved": counts.solved,
                "points_kept": counts.kept,
                "failed": counts.failed,
                "worker_seconds": round(counts.spent, 3),
                "worker_memory": round(counts.memory),
                "workers_lost": counts.lost,
            }
            store.update_attributes(runs=runs)
    return counts


#: What a failed write means and what to do.
_CAUSES = {
    errno.ENOSPC: ("the disk is full", "make room"),
    errno.EDQUOT: ("the disk is full", "make room"),
    errno.EFBIG: ("the limit on the size of a file is reached", "raise the limit (ulimit -f)"),
}


@contextmanager
def _writing(path: Path, counts: SweepProgress | None = None) -> Iterator[None]:
    """Raise an `InputError` about the store in place of an error of the file system."""
    try:
        yield
    except OSError as error:
        room = size_text(free_disk(path.parent))
        reason = (error.strerror or str(error)).lower()
        why, remedy = _CAUSES.get(error.errno or 0, (reason, "correct that"))
        done = f" after {counts.points:,} of {counts.total:,} points" if counts else ""
        rule = "be a folder that can be written"
        advice = f"{remedy} and repeat the command, which continues from there"
        raise InputError("out", rule, f"'{path.name}' ({why}, {room} free){done}", advice) from None


def _started(workers: Workers) -> dict[str, Any]:
    return {
        "started": time.strftime(_TIME),
        "ended": None,
        "host": socket.gethostname(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "workers": workers.about,
        **numerics(),
        "python": platform.python_version(),
        **{name: number for name in _PACKAGES if (number := package_version(name))},
    }


#: Chunks of the sample, and target time for the sample (s).
_CHUNKS, _SECONDS = 8, 20.0
#: Points of a chunk that are solved first; the whole chunk follows if its time allows.
_FIRST_POINTS = 32


@dataclass(frozen=True)
class SweepEstimate:
    """Size of a sweep, and estimates of its time and of its share of failures.

    Attributes
    ----------
    shape, chunk_shape : tuple of int
        Rows along each axis, of the sweep and of a chunk.
    points, chunks : int
    bytes : float
        Size of the answers in the store, uncompressed.
    sample : int
        Points that were solved for the estimate.
    failed : float
        Share of the points of the sample without a converged answer.
    seconds : float
        Processor time for all points (s); divide by the number of workers.
    """

    shape: tuple[int, ...]
    chunk_shape: tuple[int, ...]
    points: int
    chunks: int
    bytes: float
    sample: int
    failed: float
    seconds: float


@typed
def dry_run(plan: SweepPlan | str | os.PathLike[str]) -> SweepEstimate:
    """Count the points of a plan, and solve a sample of them to estimate the time.

    Raises
    ------
    InputError
        If the plan has mistakes.
    """
    if not isinstance(plan, SweepPlan):
        plan = load_plan(plan)
    grid = SweepGrid.of(plan)
    record = {**grid.record, "folder": str(plan.folder.resolve())}
    draw = np.random.default_rng(0)
    count = min(_CHUNKS, grid.chunk_count)
    sample, failed, seconds = 0, 0, 0.0
    begin = time.perf_counter()
    # Chunks at equal distances, so that the sample has all laws of an outer axis of laws.
    for k in range(count):
        chunk = grid.at((2 * k + 1) * grid.chunk_count // (2 * count))
        drawn = np.sort(draw.permutation(len(chunk))[:_FIRST_POINTS])
        for points in (chunk.take(drawn), chunk):
            # The first call compiles and is not timed.
            SOLVES[plan.solve].solve(points, record)
            start = time.process_time()
            answers = SOLVES[plan.solve].solve(points, record)
            spent = time.process_time() - start
            if 2 * spent * len(chunk) / len(points) > _SECONDS / count:
                break
        sample, failed = sample + len(points), failed + answers.failed
        seconds += spent * len(chunk) / len(points)
        if time.perf_counter() - begin > _SECONDS:
            break
    return SweepEstimate(
        shape=grid.shape,
        chunk_shape=grid.chunks,
        points=grid.points,
        chunks=grid.chunk_count,
        bytes=grid.bytes,
        sample=sample,
        failed=failed / sample,
        seconds=seconds / (k + 1) * grid.chunk_count,
    )
