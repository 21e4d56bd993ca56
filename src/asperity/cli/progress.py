"""Progress of long work on stderr: a bar on a terminal, lines in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

import click

from asperity.cli.interrupt import interruptible

#: Seconds before a bar shows itself, between its updates, and between lines of a log.
_SILENT, _ON_TERMINAL, _IN_LOG = 1.0, 0.2, 15.0


@contextmanager
def bar(unit: str, doing: str = "", *, raising: bool = True) -> Iterator[Callable[..., None]]:
    """Progress, to be called with the work done, all work, and what is being worked on.

    A short job stays silent. Inside, Ctrl-C raises, or ends the
    process at once where there are no files to put in order (`raising` False).

    Parameters
    ----------
    unit : str
        Of the work.
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
                # What an earlier run had done is no speed of this one.
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
