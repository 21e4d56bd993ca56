"""Preparation of the page: programs are compiled in a thread before a request needs them."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


class Preparation:
    """Compiles programs one after the other in a thread.

    Parameters
    ----------
    tasks : mapping of str to callable
        Functions that compile programs, by the name that the page shows.
    """

    def __init__(self, tasks: Mapping[str, Callable[[], Any]]) -> None:
        self._tasks = dict(tasks)
        self._futures: dict[str, Future[Any]] = {}
        self._lock = threading.Lock()
        # The interpreter waits for this thread at exit: stopping it while it compiles would crash
        # the process.
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="asperity-preparation")

    def start(self, names: Iterable[str]) -> None:
        """Queue tasks; any other task runs only after a call of `want`."""
        for name in names:
            with contextlib.suppress(RuntimeError):  # the process is ending
                self._futures[name] = self._pool.submit(self._tasks[name])

    def want(self, name: str) -> bool:
        """Whether a task has ended; a task that has not ended becomes the next in the queue.

        A failed task counts as ended: the request that needs its program reports the reason.
        """
        with self._lock:
            future = self._futures.get(name)
            if name not in self._tasks or (future is not None and future.done()):
                return True
            if future is None or future.cancel():
                waiting = [n for n, f in self._futures.items() if n != name and f.cancel()]
                self.start([name, *waiting])
        return False

    def close(self) -> None:
        """Start no further task."""
        self._pool.shutdown(wait=False, cancel_futures=True)


_preparation: Preparation | None = None


def use(preparation: Preparation) -> None:
    """Set the preparation that `is_ready` asks."""
    global _preparation
    _preparation = preparation


def is_ready(task: str) -> bool:
    """Whether a task has ended, as `Preparation.want`; True without a preparation."""
    return _preparation is None or _preparation.want(task)
