"""The process that runs jobs: a request is a line of JSON, and so is each message of a job.

Started as ``python -m asperity.app.worker MODULE [LAW...]``: it imports the module and
registers the laws. A request is ``{"job": "module:function", "argument": ..., "limits": ...}``. The
function is called with the argument and with a function that sends a message; its result is the
last message. ``{"cancel": true}`` on the input makes the next report of progress raise `Cancelled`.

Memory and processor time of the process are limited.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from asperity.app.words import in_labels
from asperity.errors import InputError, naming, require
from asperity.outputs.json import to_json

try:
    import resource
except ImportError:  # Windows has no such limits
    resource = None  # type: ignore[assignment]


@contextlib.contextmanager
def limited(limits: Mapping[str, int]) -> Iterator[None]:
    """Limit address space (``memory``, bytes) and processor time (``seconds``) within a block.

    Both are in addition to what the process has used so far. The system ends the process after its
    time, and refuses further memory.
    """
    ends = _limit_values(limits)
    earlier = {kind: resource.getrlimit(kind) for kind in ends}
    for kind, end in ends.items():
        resource.setrlimit(kind, (end, earlier[kind][1]))
    try:
        yield
    finally:
        for kind, before in earlier.items():
            resource.setrlimit(kind, before)


def _limit_values(limits: Mapping[str, int]) -> dict[int, int]:
    """The new values of the limits of the system, at most the present values."""
    if resource is None:
        return {}
    used = resource.getrusage(resource.RUSAGE_SELF)
    taken = {
        "memory": (resource.RLIMIT_AS, _address_space()),
        "seconds": (resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime) + 1),
    }
    result = {}
    for name, more in limits.items():
        kind, before = taken[name]
        present = [end for end in resource.getrlimit(kind) if end != resource.RLIM_INFINITY]
        result[kind] = min([before + more, *present])
    return result


def _address_space() -> int:
    """Address space (bytes) that the process uses; 0 where the system does not report it."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError):
        return 0
    return pages * resource.getpagesize()


#: Where jobs may be defined.
_ROOM = "asperity.app.api."

Report = Callable[..., None]


class Cancelled(BaseException):
    """The client no longer waits for the result.

    It is no `Exception`, so that no other handler catches it.
    """


def main() -> None:
    """Run jobs until the input ends."""
    # Output of libraries goes to stderr, because stdout has the messages.
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)
    with contextlib.suppress(AttributeError, OSError):
        os.nice(10)  # requests of the page go first
    requests: list[dict[str, Any]] = []
    arrived = threading.Semaphore(0)
    cancelled = threading.Event()

    def listen() -> None:
        for line in sys.stdin:
            message = json.loads(line)
            if message.get("cancel"):
                cancelled.set()
                continue
            requests.append(message)
            arrived.release()
        os._exit(0)  # the server is gone

    threading.Thread(target=listen, daemon=True).start()
    _import(*sys.argv[1:])  # what jobs need, before the first job
    while True:
        arrived.acquire()
        request = requests.pop(0)
        cancelled.clear()
        _answer(request, channel, cancelled)


def _import(module: str, *laws: str) -> None:
    importlib.import_module(module)
    if laws:
        from asperity.laws import known_law

        for law in laws:
            known_law(law)


def _answer(request: dict[str, Any], channel: IO[str], cancelled: threading.Event) -> None:
    def send(**message: Any) -> None:
        channel.write(to_json(message) + "\n")

    def report(**message: Any) -> None:
        if cancelled.is_set():
            raise Cancelled
        if message:
            send(**message)

    try:
        with limited(request["limits"]), naming(in_labels):
            try:
                send(result=_function(request["job"])(request["argument"], report), done=True)
            except InputError as error:
                send(error=str(error), done=True)
    except Cancelled:
        send(error="cancelled", cancelled=True, done=True)
    except MemoryError:
        send(error="the computation needs more memory than it may have; ask for less", done=True)
    except Exception as error:
        import traceback

        traceback.print_exc()
        text = f"the computation failed by a defect of the program ({type(error).__name__})"
        send(error=text, fault=True, done=True)


def _function(job: str) -> Callable[[Any, Report], Any]:
    module, _, name = job.partition(":")
    require(module.startswith(_ROOM), "job", "be one of the page's", f"'{job}'", "name one")
    result: Callable[[Any, Report], Any] = getattr(importlib.import_module(module), name)
    return result


if __name__ == "__main__":
    main()
