"""Short computations in threads: the newest request of a client wins, and clients take turns."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple


class Superseded(Exception):  # noqa: N818
    """A newer request of the same client took this one's place."""


class Busy(Exception):  # noqa: N818
    """Too many clients wait."""


class _Waiting(NamedTuple):
    work: Callable[[], Any]
    answer: asyncio.Future[Any]


class Lane:
    """Threads for short computations.

    A client has at most one request waiting: a newer one takes its place, which is `Superseded`.
    Clients are served in the order in which they began to wait, so that one who asks without pause
    takes no more than a turn.

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
        Superseded, Busy
            Instead of a result.
        """
        answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        earlier = self._waiting.get(client)
        if earlier is None and len(self._waiting) >= self._most:
            raise Busy
        # The place in the queue stays that of the earlier request.
        self._waiting[client] = _Waiting(work, answer)
        if earlier is not None and not earlier.answer.done():
            earlier.answer.set_exception(Superseded())
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
