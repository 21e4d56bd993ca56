"""Where tasks run: processes of this machine, or the workers of a Dask scheduler."""

from __future__ import annotations

import contextlib
import logging
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any

from asperity._processes import ENVIRONMENT, kept_processes
from asperity.errors import InputError, printable

#: Seconds between counts of the workers of a scheduler.
_RECOUNT = 5.0


class Workers(ABC):
    """Processes that run tasks.

    Attributes
    ----------
    count : int
    about : str
        Description of the workers in the store.
    lost : tuple of type
        Exceptions that mean: the process of the task died.
    gone : tuple of type
        Exceptions that mean: there are no workers any more, and none will start.
    """

    count: int
    about: str
    lost: tuple[type[BaseException], ...] = (BrokenExecutor,)
    gone: tuple[type[BaseException], ...] = (CancelledError,)

    @abstractmethod
    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        """Submit a task."""

    def restart(self) -> None:  # noqa: B027
        """Replace dead processes, if the executor does not do so itself."""

    @abstractmethod
    def close(self, *, kill: bool) -> None:
        """Release the processes; with `kill` their running tasks are killed."""


class LocalProcesses(Workers):
    """Processes of this machine, each with one thread.

    Parameters
    ----------
    count : int
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self.about = f"{count} processes of one machine"
        self.restart()

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        """As in `Workers`."""
        try:
            return self._executor.submit(task, *args)
        except BrokenExecutor:
            self.restart()
            return self._executor.submit(task, *args)

    def restart(self) -> None:
        """As in `Workers`."""
        self._executor: Any = kept_processes(self.count)

    def close(self, *, kill: bool) -> None:
        """As in `Workers`; without `kill` idle processes stay ten minutes for the next sweep."""
        if kill:
            self._executor.shutdown(wait=False, kill_workers=True)


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
        """Count the workers, which a batch system may start and end while a sweep runs."""
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


def local_processes(count: int) -> AbstractContextManager[Workers]:
    """Processes of this machine, which are killed if the block ends with an exception."""
    return _closing(LocalProcesses(count))


@contextmanager
def local_cluster(count: int) -> Iterator[Workers]:
    """A Dask cluster on this machine, which ends with the block.

    Raises
    ------
    InputError
        If Dask is not installed.
    """
    distributed = _distributed("--cluster")
    import dask

    with ExitStack() as stack:
        spawned = {"distributed.nanny.pre-spawn-environ": dict(ENVIRONMENT)}
        stack.enter_context(dask.config.set(spawned))
        try:
            # No memory limit: near a limit Dask pauses a worker, and a pause does not free the
            # memory of compiled programs.
            cluster = distributed.LocalCluster(
                n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None,
                memory_limit=0,
            )  # fmt: skip
            client = distributed.Client(stack.enter_context(cluster))
            about = f"Dask cluster on one machine with {count} workers"
            workers = DaskWorkers(stack.enter_context(client), about)
        # Dask raises one of these when a starting process ends or does not answer.
        except (RuntimeError, OSError, TimeoutError, CancelledError) as error:
            rule = "be workers that this machine can start"
            got = f"{count}, of which some ended while they started ({printable(str(error), 200)})"
            raise InputError("--cluster", rule, got, "repeat the command, or take fewer") from None
        yield stack.enter_context(_closing(workers))


@contextmanager
def scheduler(address: str) -> Iterator[Workers]:
    """The workers of a running Dask scheduler.

    Raises
    ------
    InputError
        If Dask is not installed, or there is no scheduler or no worker at the address.
    """
    distributed = _distributed("--scheduler")
    try:
        client = distributed.Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        rule, got = "be the address of a Dask scheduler", f"'{address}' ({error})"
        raise InputError("--scheduler", rule, got, "write it like tcp://host:8786") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=60)
        except TimeoutError:
            rule, got = "have workers", f"none at '{address}' within a minute"
            raise InputError("--scheduler", rule, got, "start some with dask worker") from None
        with _closing(DaskWorkers(client, f"Dask scheduler at {address}")) as workers:
            yield workers


@contextmanager
def _closing(workers: Workers) -> Iterator[Workers]:
    """Release workers at the end of the block; after an exception their tasks are killed."""
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
    # A lost scheduler reaches the driver as an exception; its logged tracebacks are not needed.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    return distributed
