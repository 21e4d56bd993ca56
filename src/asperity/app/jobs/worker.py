"""The process that runs a job: one line of JSON in a request, lines of JSON as it goes on.

Started as ``python -m asperity.app.jobs.worker MODULE [LAW...]``: it imports the module and
registers the laws, given by their places. A request is ``{"job": "module:function", "argument":
..., "limits": ...}``; the function is called with the argument and with a function that sends a
message, and its result is the last message. ``{"cancel": true}`` on the input makes the next report
of progress raise `Cancelled`.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import sys
import threading
from collections.abc import Callable
from typing import IO, Any

from asperity.app.jobs.limits import set_limits
from asperity.errors import InputError
from asperity.outputs.json import to_json

#: Where jobs may be defined.
_ROOM = "asperity.app.api."

Report = Callable[..., None]


class Cancelled(BaseException):
    """Whoever asked no longer waits.

    Not an `Exception`, so that nothing on the way catches it.
    """


def main() -> None:
    """Run jobs until the input ends."""
    # What libraries print must not get between the messages.
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)
    with contextlib.suppress(AttributeError, OSError):
        os.nice(10)  # the page's own requests go first
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
    _import(*sys.argv[1:])  # what jobs need, before the first one comes
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
        set_limits(request.get("limits") or {})
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
        text = f"the computation failed for a reason of its own ({type(error).__name__})"
        send(error=text, fault=True, done=True)


def _function(job: str) -> Callable[[Any, Report], Any]:
    module, _, name = job.partition(":")
    if not module.startswith(_ROOM):
        raise InputError(f"job must be one of the page's, got '{job}'; name one")
    found: Callable[[Any, Report], Any] = getattr(importlib.import_module(module), name)
    return found


if __name__ == "__main__":
    main()
