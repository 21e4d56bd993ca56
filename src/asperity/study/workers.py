"""Where tasks run: processes of this machine, or the workers of a Dask scheduler."""

from __future__ import annotations

import contextlib
import logging
import os
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import ExitStack, contextmanager
from typing import Any

from asperity.errors import InputError, printable

#: Environment of a worker: one thread of XLA and of the linear algebra of NumPy, as Dask has it.
#: Sums over several threads differ in their last bits from sums in one.
ENVIRONMENT = {
    "NPROC": "1",
    **dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
}

#: Seconds after which the workers of a scheduler are counted again.
_RECOUNT = 5.0
#: Seconds between looks of a worker process at whether its driver still runs.
_LOOK = 1.0


class Workers(ABC):
    """Processes that do tasks.

    Attributes
    ----------
    count : int
    about : str
        What the store says of them.
    lost : tuple of type
        Exceptions of a task whose process died.
    gone : tuple of type
        Exceptions where there are no workers any more, and will be none.
    """

    count: int
    about: str
    lost: tuple[type[BaseException], ...] = (BrokenExecutor,)
    gone: tuple[type[BaseException], ...] = (CancelledError,)

    @abstractmethod
    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        """Hand out a task."""

    def restart(self) -> None:  # noqa: B027
        """Start new processes in place of dead ones, where that does not happen by itself."""

    @abstractmethod
    def close(self, *, kill: bool) -> None:
        """Let the processes go; with `kill`, whatever they are doing."""


class ThisProcess(Workers):
    """The process of the driver: a task is done when it is handed out."""

    count = 1
    about = "this process"
    lost = ()
    gone = ()

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        """As in `Workers`; an interruption is raised at once."""
        future: Future[Any] = Future()
        try:
            future.set_result(task(*args))
        except Exception as error:  # as an executor does
            future.set_exception(error)
        return future

    def close(self, *, kill: bool) -> None:
        """As in `Workers`."""


class LocalProcesses(Workers):
    """Processes of this machine, each with one thread.

    Parameters
    ----------
    count : int
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self.about = f"{count} processes of one machine"
        self._executor = self._start()

    def _start(self) -> Any:
        from loky import get_reusable_executor

        # Never forked: a fork of a process in which JAX runs hangs.
        return get_reusable_executor(
            max_workers=self.count,
            env=dict(ENVIRONMENT),
            timeout=600,
            initializer=_begin,
            initargs=(os.getpid(),),
        )

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        """As in `Workers`."""
        try:
            return self._executor.submit(task, *args)
        except BrokenExecutor:
            self.restart()
            return self._executor.submit(task, *args)

    def restart(self) -> None:
        """As in `Workers`."""
        self._executor = self._start()

    def close(self, *, kill: bool) -> None:
        """As in `Workers`; without `kill` the processes stay for the next sweep a while."""
        if kill:
            self._executor.shutdown(wait=False, kill_workers=True)


def _begin(driver: int) -> None:
    """Set up a worker of the process `driver`."""
    from loky import process_executor

    # A worker whose memory has grown by 300 MB has compiled programs, and no leak.
    process_executor._USE_PSUTIL = False
    if os.name == "posix":
        threading.Thread(target=_end_with, args=(driver,), daemon=True).start()


def _end_with(driver: int) -> None:
    """End this process when its driver is gone: one that was killed can tell it nothing."""
    while os.getppid() == driver:
        time.sleep(_LOOK)
    os._exit(1)


class DaskWorkers(Workers):
    """Workers of a Dask scheduler.

    Parameters
    ----------
    client : distributed.Client
    about : str
    """

    def __init__(self, client: Any, about: str) -> None:
        from distributed.client import ClosedClientError, FutureCancelledError
        from distributed.comm.core import CommClosedError
        from distributed.scheduler import KilledWorker

        self.client = client
        self.lost = (KilledWorker,)
        self.gone = (CancelledError, FutureCancelledError, CommClosedError, ClosedClientError)
        self._recount()
        self.about = f"{about}, {self.count} threads"
        self._executor: Executor = client.get_executor(pure=False)

    def _recount(self) -> None:
        """Count the workers: jobs of a batch system begin and end while a sweep runs."""
        self.count = max(1, sum(self.client.nthreads().values()))
        self._counted = time.monotonic()

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        """As in `Workers`."""
        if time.monotonic() - self._counted > _RECOUNT:
            self._recount()
        return self._executor.submit(task, *args)

    def close(self, *, kill: bool) -> None:
        """As in `Workers`."""
        self._executor.shutdown(wait=False)


@contextmanager
def local_processes(count: int) -> Iterator[Workers]:
    """Processes of this machine; they are killed if the block ends with an exception."""
    workers = LocalProcesses(count)
    try:
        yield workers
    except BaseException:
        workers.close(kill=True)
        raise
    workers.close(kill=False)


@contextmanager
def local_cluster(count: int) -> Iterator[Workers]:
    """A Dask cluster on this machine, for the time of the block.

    Raises
    ------
    InputError
        If Dask is not installed.
    """
    distributed = _distributed("--cluster")
    import dask

    with ExitStack() as stack:
        stack.enter_context(
            dask.config.set({"distributed.nanny.pre-spawn-environ": dict(ENVIRONMENT)})
        )
        try:
            # Without a limit: near one Dask pauses a worker, whose compiled programs no pause
            # frees.
            cluster = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                    memory_limit=0,
                )
            )
            client = stack.enter_context(distributed.Client(cluster))
            workers = DaskWorkers(client, f"Dask cluster on one machine with {count} workers")
        # Dask raises one of these when a process ends, or does not answer, while it starts.
        except (RuntimeError, OSError, TimeoutError, CancelledError) as error:
            raise InputError(
                f"--cluster must be workers that this machine can start, got {count}, of which "
                f"some ended while they started ({printable(str(error), 200)}); repeat the "
                "command, or take fewer"
            ) from None
        yield from _using(workers)


@contextmanager
def scheduler(address: str) -> Iterator[Workers]:
    """The workers of a Dask scheduler that runs already.

    Raises
    ------
    InputError
        If Dask is not installed, or there is no scheduler or no worker at the address.
    """
    distributed = _distributed("--scheduler")
    try:
        client = distributed.Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise InputError(
            f"--scheduler must be the address of a Dask scheduler, got '{address}' ({error}); "
            "write it like tcp://host:8786"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=60)
        except TimeoutError:
            raise InputError(
                f"--scheduler must have workers, got none at '{address}' within a minute; start "
                "some with dask worker"
            ) from None
        yield from _using(DaskWorkers(client, f"Dask scheduler at {address}"))


def _using(workers: Workers) -> Iterator[Workers]:
    kill = True
    try:
        yield workers
        kill = False
    finally:
        with contextlib.suppress(RuntimeError):
            workers.close(kill=kill)


def _distributed(option: str) -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError(
            f"{option} must have Dask, got none installed; install it with pip install "
            "'asperity[dask]', or leave the option out for processes of this machine"
        ) from None
    # What it logs of a lost scheduler, with tracebacks, reaches the driver as an exception.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    return distributed
