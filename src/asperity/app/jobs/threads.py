"""Work in threads of the server: short computations, and compilation ahead of the first request."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

from starlette.exceptions import HTTPException

BUSY = "too many computations wait; try again in a while"
_SUPERSEDED = "a newer request took the place of this one"


class _Waiting(NamedTuple):
    work: Callable[[], Any]
    answer: asyncio.Future[Any]


class Lane:
    """Threads for short computations.

    A client has at most one request waiting: a newer request replaces it, and the older one is
    refused. Clients are served in the order in which they began to wait: a client that sends
    requests without pause gets no more turns than others.

    Parameters
    ----------
    threads : int
    most : int
        Clients that may wait.
    """

    def __init__(self, threads: int, most: int = 200) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="asperity-lane")
        self._idle = threads
        self._most = most
        self._waiting: OrderedDict[str, _Waiting] = OrderedDict()

    async def run(self, client: str, work: Callable[[], Any]) -> Any:
        """The result of `work`, called in a thread.

        Raises
        ------
        HTTPException
            409 where a newer request took the place of this one, 503 where too many clients wait.
        """
        answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        earlier = self._waiting.get(client)
        if earlier is None and len(self._waiting) >= self._most:
            raise HTTPException(503, BUSY)
        # The place in the queue stays that of the earlier request.
        self._waiting[client] = _Waiting(work, answer)
        if earlier is not None and not earlier.answer.done():
            earlier.answer.set_exception(HTTPException(409, _SUPERSEDED))
        self._start()
        return await answer

    def close(self) -> None:
        """Let no further work begin."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _start(self) -> None:
        while self._idle and self._waiting:
            _, (work, answer) = self._waiting.popitem(last=False)
            if answer.done():  # the client is gone
                continue
            self._idle -= 1
            asyncio.get_running_loop().create_task(self._finish(work, answer))

    async def _finish(self, work: Callable[[], Any], answer: asyncio.Future[Any]) -> None:
        try:
            result = await asyncio.get_running_loop().run_in_executor(self._pool, work)
        except Exception as error:
            if not answer.done():
                answer.set_exception(error)
        else:
            if not answer.done():
                answer.set_result(result)
        finally:
            self._idle += 1
            self._start()


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
