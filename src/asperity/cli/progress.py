"""Progress of long work on stderr, a bar on a terminal or lines in a log, and Ctrl-C in it."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import click

#: Seconds before a bar shows itself, between its updates, and between lines of a log.
_SILENT, _ON_TERMINAL, _IN_LOG = 1.0, 0.2, 15.0


@contextmanager
def bar(unit: str, doing: str = "", *, raising: bool = True) -> Iterator[Callable[..., None]]:
    """Progress, to be called with the work done, all work, and what is being worked on.

    A short job prints nothing. Within the block, Ctrl-C raises, or ends the process at once where
    there are no files to put in order (`raising` False).

    Parameters
    ----------
    unit : str
        Unit of the work.
    doing : str
        What is done, where calls do not say it.
    """
    shown = _on_terminal(unit) if sys.stderr.isatty() else _in_log(unit)
    with shown as show, interruptible() if raising else nullcontext(lambda: None) as check:

        def update(done: int, total: int, label: str = "") -> None:
            check()
            show(done, total, label or doing)

        yield update


@contextmanager
def _on_terminal(unit: str) -> Iterator[Callable[[int, int, str], None]]:
    from tqdm import tqdm

    with tqdm(
        unit=unit,
        file=sys.stderr,
        delay=_SILENT,
        mininterval=_ON_TERMINAL,
        leave=False,
        dynamic_ncols=True,
    ) as shown:

        def show(done: int, total: int, label: str) -> None:
            if shown.total is None:
                # The work of an earlier run does not count for the speed.
                shown.initial = shown.n = done
            shown.total = total
            if label:
                shown.set_description_str(label, refresh=False)
            shown.update(done - shown.n)

        yield show


@contextmanager
def _in_log(unit: str) -> Iterator[Callable[[int, int, str], None]]:
    start = last = time.monotonic()

    def show(done: int, total: int, label: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < _IN_LOG:
            return
        last = now
        units = unit if unit.endswith("s") else f"{unit}s"
        amount = f"{done} %" if unit == "%" else f"{done} of {total} {units}"
        click.echo(f"asperity: {label or 'done'}: {amount}, {now - start:.0f} s", err=True)

    yield show


@contextmanager
def waiting(doing: str) -> Iterator[None]:
    """Say on a terminal what is done, where it takes long and has no parts to count."""
    timer = threading.Timer(_SILENT, click.echo, [f"asperity: {doing} ..."], {"err": True})
    if sys.stderr.isatty():
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


INTERRUPTED = 130
MESSAGE = "interrupted; nothing was written"

Handler = Callable[[int, Any], Any]


@contextmanager
def ending_at_once() -> Iterator[None]:
    """Leave the process on Ctrl-C without unwinding.

    Python's default, an exception between any two steps, crashes compiled modules that are just
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
