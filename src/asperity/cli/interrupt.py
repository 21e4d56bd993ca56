"""Ctrl-C: ends the process at once, or, while files are being written, by an exception."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

INTERRUPTED = 130
MESSAGE = "interrupted; nothing was written"

Handler = Callable[[int, Any], Any]


@contextmanager
def ending_at_once() -> Iterator[None]:
    """Leave the process on Ctrl-C without unwinding.

    Python's own way, an exception between any two steps, crashes compiled modules that are just
    being loaded, and JAX's callbacks swallow it.
    """
    with _handling(_leave):
        yield


@contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """Raise `KeyboardInterrupt` on Ctrl-C, for work that has files to put in order.

    Yields
    ------
    callable
        To be called now and then: raises again if the first exception was swallowed.
    """
    pressed = False

    def note(signum: int, frame: Any) -> None:
        nonlocal pressed
        pressed = True
        raise KeyboardInterrupt

    def check() -> None:
        if pressed:
            raise KeyboardInterrupt

    with _handling(note):
        yield check


def _leave(signum: int, frame: Any) -> None:
    # Not through sys.stderr: the interrupted step may be in the middle of writing to it.
    os.write(2, f"\nasperity: {MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


@contextmanager
def _handling(handler: Handler) -> Iterator[None]:
    # Batch systems and nohup ignore Ctrl-C; only the main thread may set handlers.
    ours = signal.getsignal(signal.SIGINT) in (signal.default_int_handler, _leave)
    if not ours or threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
