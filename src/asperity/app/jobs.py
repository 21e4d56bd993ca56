"""Worker processes: few at a time, reused, and killed if they do not stop when cancelled."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import AsyncGenerator, Coroutine, Mapping, Sequence
from pathlib import Path
from typing import Any

_BUSY = "too many computations wait; try again later"
#: Largest number of waiting jobs.
_MOST_WAITING = 20
#: Longest message of a worker (bytes).
_LONGEST = 64 * 1024**2
#: Time (s) within which a cancelled job must stop.
_PATIENCE = 1.0


class Jobs:
    """Runs jobs in a worker process, one after the other.

    Parameters
    ----------
    preload : str
        Module that a worker imports before its first job.
    laws : sequence of str
        Locations of laws outside the package, which a worker registers.
    folder : Path, optional
        Folder of temporary files of workers. The owner of the folder removes files that a killed
        worker leaves.
    """

    def __init__(
        self,
        preload: str = "asperity.orbit",
        laws: Sequence[str] = (),
        folder: Path | None = None,
    ) -> None:
        self._folder = folder
        self._preload = (preload, *laws)
        self._free = asyncio.Lock()
        self._waiting = 0
        self._worker: _Worker | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._closed = False

    async def run(
        self,
        job: str,
        argument: Any,
        *,
        limits: Mapping[str, int] | None = None,
        seconds: float = 600.0,
    ) -> AsyncGenerator[dict[str, Any], None]:
        """Messages of a job; the last message has ``done``.

        Closing the iterator early ends the job; this happens when the page closes the connection.
        Where too many jobs wait, the only message says so.

        Parameters
        ----------
        job : str
            ``module:function``; see `asperity.app.worker`.
        argument
            Value of a JSON type.
        limits : mapping of str to int, optional
            ``memory`` (bytes) and ``seconds`` (of processor time); a worker with limits runs this
            job only.
        seconds : float
            Time after which the job is ended.
        """
        if self._waiting >= _MOST_WAITING:
            yield {"error": _BUSY, "done": True}
            return
        self._waiting += 1
        try:
            if self._free.locked():
                yield {"waiting": self._waiting}
            await self._free.acquire()
        finally:
            self._waiting -= 1
        if self._closed:
            self._free.release()
            return
        finished = False
        clock = asyncio.get_running_loop().time
        end = clock() + seconds
        try:
            worker = await self.prepare()
            await worker.send({"job": job, "argument": argument, "limits": dict(limits or {})})
            while not finished:
                try:
                    message = await asyncio.wait_for(worker.read(), end - clock())
                except TimeoutError:
                    text = f"the computation took longer than {seconds:.0f} s and was ended"
                    yield {"error": f"{text}; ask for less", "done": True}
                    return
                finished = message is None or bool(message.get("done"))
                yield message or {"error": _why_it_ended(limits), "done": True}
        finally:
            # The client may be gone, and this task cancelled: another task takes over the worker.
            self._start_task(self._release(reusable=not limits, finished=finished))

    def _start_task(self, work: Coroutine[Any, Any, None]) -> None:
        """Run a coroutine in the background; `close` waits for its end."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _release(self, *, reusable: bool, finished: bool) -> None:
        """Keep the worker for the next job if its job is done or stops when cancelled.

        A worker that had limits is replaced by a new worker, which imports its modules at once.
        """
        try:
            worker = self._worker
            kept = reusable and worker is not None and worker.running
            if not (kept and worker and (finished or await worker.stop_job())):
                await self._end_worker()
            if not (reusable or self._closed):
                await self.prepare()
        finally:
            self._free.release()

    async def prepare(self, warm: str | None = None) -> _Worker:
        """Start a worker, unless one runs, and let it run `warm` in the background."""
        if self._worker is None or not self._worker.running:
            self._worker = await _Worker.start(self._preload, self._folder)
        if warm is not None:
            self._start_task(self._warm(warm))
        return self._worker

    async def _end_worker(self) -> None:
        if self._worker is not None:
            await self._worker.end()

    async def _warm(self, job: str) -> None:
        async for _ in self.run(job, {}):
            pass

    async def close(self) -> None:
        """End the worker, and wait until it has ended."""
        self._closed = True
        await self._end_worker()
        while self._tasks:  # a task that ends may start another task
            # `gather` of tasks that have all ended would not let the loop remove them from the set.
            await asyncio.wait(self._tasks)
        await self._end_worker()  # one that has started in the meantime


class _Worker:
    """One worker process."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        # One task reads all lines, because a caller of `read` may stop waiting between two lines.
        self._lines: asyncio.Queue[bytes] = asyncio.Queue()
        self._reader = asyncio.get_running_loop().create_task(self._read_lines())

    @classmethod
    async def start(cls, preload: Sequence[str], folder: Path | None) -> _Worker:
        """Start a process that imports a module, and laws, before its first job."""
        place = {} if folder is None else {"TMPDIR": str(folder)}
        return cls(
            await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "asperity.app.worker",
                *preload,
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=_LONGEST,
                env={**os.environ, **place},
            )
        )

    @property
    def running(self) -> bool:
        """Whether the process has not ended."""
        return self._process.returncode is None

    async def send(self, message: Mapping[str, Any]) -> None:
        """Write a message to the process."""
        assert self._process.stdin is not None
        with contextlib.suppress(ConnectionError):
            self._process.stdin.write(json.dumps(message).encode() + b"\n")
            await self._process.stdin.drain()

    async def read(self) -> dict[str, Any] | None:
        """Read a message of the process; None if the process has ended."""
        line = await self._lines.get()
        if not line:
            return None
        result: dict[str, Any] = json.loads(line)
        return result

    async def _read_lines(self) -> None:
        assert self._process.stdout is not None
        try:
            while line := await self._process.stdout.readline():
                self._lines.put_nowait(line)
        except ValueError:  # a message longer than `_LONGEST`
            self.kill()
        await self._process.wait()
        self._lines.put_nowait(b"")

    async def end(self) -> None:
        """End the process at once, and wait until its pipes are closed."""
        self.kill()
        await self._reader
        if self._process.stdin is not None:
            self._process.stdin.close()
            with contextlib.suppress(ConnectionError):
                await self._process.stdin.wait_closed()

    async def stop_job(self) -> bool:
        """Ask the job to stop, and return whether it did within `_PATIENCE`."""
        await self.send({"cancel": True})
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_PATIENCE):
                while (message := await self.read()) is not None:
                    if message.get("done"):
                        return True
        return False

    def kill(self) -> None:
        """End the process at once."""
        with contextlib.suppress(ProcessLookupError):
            self._process.kill()


def _why_it_ended(limits: Mapping[str, int] | None) -> str:
    """A sentence on a process that ended before its job did."""
    if limits:
        return "the computation exceeded its time or memory and was ended; ask for less"
    return "the computation's process ended before its work did; try again"
