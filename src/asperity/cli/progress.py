"""Progress on stderr, as a bar on a terminal or as lines in a log, and interruption by Ctrl-C."""

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

#: Seconds before a bar appears, between its updates, and between lines of a log.
_DELAY, _ON_TERMINAL, _IN_LOG = 1.0, 0.2, 15.0


@contextmanager
def bar(unit: str, task: str = "", *, raising: bool = True) -> Iterator[Callable[..., None]]:
    """Show progress within a block.

    A short job prints nothing. Within the block, Ctrl-C raises `KeyboardInterrupt`.

    Parameters
    ----------
    unit : str
        Unit of the work.
    task : str
        Name of the work, shown where a call gives no label.
    raising : bool
        False for work without files to clean up: Ctrl-C then ends the process at once.

    Yields
    ------
    callable
        To be called with the work done so far, all work and, optionally, a label.
    """
    shown = _on_terminal(unit) if sys.stderr.isatty() else _in_log(unit)
    with shown as show, interruptible() if raising else nullcontext(lambda: None) as check:

        def update(done: int, total: int, label: str = "") -> None:
            check()
            show(done, total, label or task)

        yield update


@contextmanager
def _on_terminal(unit: str) -> Iterator[Callable[[int, int, str], None]]:
    from tqdm import tqdm

    with tqdm(
        unit=unit,
        file=sys.stderr,
        delay=_DELAY,
        mininterval=_ON_TERMINAL,
        leave=False,
        dynamic_ncols=True,
    ) as shown:

        def show(done: int, total: int, label: str) -> None:
            if shown.total is None:
                # The work of an earlier run does not count in the speed.
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
def waiting(task: str) -> Iterator[None]:
    """Print the name of a task on a terminal if it takes long; for tasks without parts to count."""
    timer = threading.Timer(_DELAY, click.echo, [f"asperity: {task} ..."], {"err": True})
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
    """End the process on Ctrl-C without unwinding the stack.

    By default Python raises an exception between any two instructions: it crashes compiled modules
    during their import, and callbacks of JAX discard it.
    """
    with _handling(_leave):
        yield


@contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """Raise `KeyboardInterrupt` on Ctrl-C or SIGTERM, for work that has files to clean up.

    Batch systems send SIGTERM before they kill a job.

    Yields
    ------
    callable
        Raises again if other code has discarded the first exception; to be called repeatedly.
    """
    pressed = False

    def note(signum: int, frame: Any) -> None:
        nonlocal pressed
        pressed = True
        raise KeyboardInterrupt

    def check() -> None:
        if pressed:
            raise KeyboardInterrupt

    with _handling(note), _handling(note, signal.SIGTERM):
        yield check


def _leave(signum: int, frame: Any) -> None:
    # The interrupted code may be writing to sys.stderr.
    os.write(2, f"\nasperity: {MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


@contextmanager
def _handling(handler: Handler, number: int = signal.SIGINT) -> Iterator[None]:
    # Batch systems and nohup ignore Ctrl-C; only the main thread may set handlers.
    defaults = (signal.default_int_handler, _leave, signal.SIG_DFL)
    ours = signal.getsignal(number) in defaults
    if not ours or threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(number, handler)
    try:
        yield
    finally:
        signal.signal(number, previous)
