"""Compilation ahead of the first request, in a thread of the server."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any


class Preparation:
    """Compiles programs one after the other in a thread.

    Parameters
    ----------
    tasks : mapping of str to callable
        By the name that the page shows; each compiles some programs.
    """

    def __init__(self, tasks: Mapping[str, Callable[[], Any]]) -> None:
        self._tasks = dict(tasks)
        self._queue: list[str] = []
        self._done: set[str] = set()
        self._current: str | None = None
        self._closed = False
        self._lock = threading.Lock()
        # The interpreter waits for this thread at exit: stopping it while it compiles would crash
        # the process. The thread has the current task only.
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="asperity-preparation")

    def start(self, names: list[str]) -> None:
        """Queue some tasks; the others are not run before `want`."""
        with self._lock:
            self._queue += [n for n in names if n not in self._queue]
        self._next()

    def want(self, name: str) -> bool:
        """Whether a task is done; a task that is not becomes the next in the queue."""
        with self._lock:
            if name in self._done or name not in self._tasks:
                return True
            if name != self._current:
                self._queue = [name, *(n for n in self._queue if n != name)]
        self._next()
        return False

    def state(self) -> dict[str, Any]:
        """Tasks that are done, the current one, and the number of tasks that are not done."""
        with self._lock:
            return {
                "ready": sorted(self._done),
                "preparing": self._current,
                "left": len(self._queue) + (self._current is not None),
            }

    def close(self) -> None:
        """Start no further task."""
        with self._lock:
            self._closed = True
        self._pool.shutdown(wait=False)

    def _next(self) -> None:
        with self._lock:
            if self._closed or self._current is not None or not self._queue:
                return
            self._current = self._queue.pop(0)
            with contextlib.suppress(RuntimeError):  # the process is ending
                self._pool.submit(self._run, self._current)

    def _run(self, name: str) -> None:
        # The request that needs the program reports what is wrong.
        with contextlib.suppress(Exception):
            self._tasks[name]()
        with self._lock:
            self._done.add(name)
            self._current = None
        self._next()
