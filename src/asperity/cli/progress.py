"""Progress of long work on stderr."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

from asperity.cli.interrupt import interruptible

#: Seconds between updates: a log file is not to be flooded.
_ON_TERMINAL, _IN_LOG = 0.2, 15.0


@contextmanager
def bar(unit: str, *, raising: bool = True) -> Iterator[Callable[..., None]]:
    """A progress bar, to be called with the work done, all work, and what is being worked on.

    It shows itself after a second: a short job stays silent. Inside, Ctrl-C raises, or ends the
    process at once where there are no files to put in order (`raising` False).
    """
    from tqdm import tqdm

    interval = _ON_TERMINAL if sys.stderr.isatty() else _IN_LOG
    shown = tqdm(
        unit=unit, file=sys.stderr, delay=1.0, mininterval=interval, leave=False, dynamic_ncols=True
    )
    with shown, interruptible() if raising else nullcontext(lambda: None) as check:

        def update(done: int, total: int, label: str = "") -> None:
            check()
            if shown.total is None:
                # What an earlier run had done is no speed of this one.
                shown.initial = shown.n = done
            shown.total = total
            if label:
                shown.set_description_str(label, refresh=False)
            shown.update(done - shown.n)

        yield update
