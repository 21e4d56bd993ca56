"""Progress of a sweep: a bar on a terminal, a line every ten seconds in a log."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from asperity.cli.interrupt import interruptible

if TYPE_CHECKING:
    from asperity.study.engine import SweepProgress

#: Seconds between lines of a log.
_LINES = 10.0

_PERIODS = ((86_400 * 365.25, "years"), (86_400, "days"), (3600, "h"), (60, "min"))


def time_text(seconds: float) -> str:
    """A duration as a person says it; "unknown" where there is no estimate."""
    if not math.isfinite(seconds):
        return "unknown"
    for length, name in _PERIODS:
        if seconds >= 1.5 * length:
            return f"{seconds / length:.3g} {name}"
    return f"{seconds:.3g} s"


@contextmanager
def shown() -> Iterator[tuple[Callable[[SweepProgress], None], Callable[[str], None]]]:
    """Two functions: for the progress of a sweep, and for lines about it.

    Inside, Ctrl-C raises; what is in the store stays, and the message says so.
    """
    last: SweepProgress | None = None
    on_terminal = sys.stderr.isatty()
    with interruptible() as check:
        report, line, close = _bar() if on_terminal else _lines()

        def progress(now: SweepProgress) -> None:
            nonlocal last
            last = now
            check()
            report(now)

        try:
            yield progress, line
        except KeyboardInterrupt:
            done = f"{last.points:,} of {last.total:,} points" if last else "nothing"
            raise KeyboardInterrupt(
                f"interrupted with {done} solved; chunks that are done stay in the store, and the "
                "same command goes on from there"
            ) from None
        finally:
            close()


def _text(now: SweepProgress) -> str:
    return (
        f"{now.points:,} of {now.total:,} points, {now.failed:,} failed, {now.rate:,.0f} points/s, "
        f"{time_text(now.left)} left"
    )


def _lines() -> tuple[Callable[[SweepProgress], None], Callable[[str], None], Callable[[], None]]:
    next_line = time.monotonic() + _LINES

    def report(now: SweepProgress) -> None:
        nonlocal next_line
        if time.monotonic() >= next_line:
            next_line = time.monotonic() + _LINES
            line(_text(now))

    def line(text: str) -> None:
        click.echo(f"{time.strftime('%H:%M:%S')} {text}", err=True)

    return report, line, lambda: None


def _bar() -> tuple[Callable[[SweepProgress], None], Callable[[str], None], Callable[[], None]]:
    from tqdm import tqdm

    bar = tqdm(unit="point", file=sys.stderr, leave=False, dynamic_ncols=True,
               bar_format="{percentage:3.0f}%|{bar}| {desc}")  # fmt: skip

    def report(now: SweepProgress) -> None:
        bar.total, bar.n = now.total, now.points
        bar.set_description_str(_text(now), refresh=True)

    return report, lambda text: tqdm.write(text, file=sys.stderr), bar.close
