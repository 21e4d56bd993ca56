"""Processes that compute next to this one: how many, how they start and how they end."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

from asperity.errors import InputError, require

T = TypeVar("T")

#: One thread for XLA and for the linear algebra of NumPy: sums over several threads differ in their
#: last bits from sums in one, and more threads than cores slow all of them. The CPU, as in
#: `asperity._jax.configure`: every process that starts on an accelerator takes most of its memory.
ENVIRONMENT = {
    "NPROC": "1",
    **dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
    "JAX_PLATFORMS": os.environ.get("JAX_PLATFORMS") or "cpu",
}

#: Time (s) that idle processes stay: to start one and load its programs takes seconds.
_IDLE = 600
#: Seconds between checks of a process whether its parent process still runs.
_DRIVER_CHECK = 1.0


def available_cores() -> int:
    """Cores this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def process_count(value: int, name: str) -> int:
    """The rule of a number of processes, as an annotation: more than the cores only slow it down.

    Raises
    ------
    InputError
    """
    most = max(64, 4 * available_cores())
    rule = f"be from 1 to {most} processes"
    require(1 <= value <= most, name, rule, value, "give another number")
    return value


def kept_processes(count: int) -> Any:
    """An executor of `count` processes, each with one thread.

    They stay for the next call from the same thread, and end with this thread.
    """
    from loky import get_reusable_executor

    # loky does not fork: the fork of a process that runs JAX hangs.
    return get_reusable_executor(
        max_workers=count,
        env=ENVIRONMENT,
        timeout=_IDLE,
        initializer=_begin,
        initargs=(os.getpid(),),
    )


#: loky keeps processes for the thread that takes them; this thread does not end.
_TAKER = ThreadPoolExecutor(1, "asperity-process")


def in_kept_process(function: Callable[..., T], *arguments: Any) -> T:
    """Result of a function in one process that stays for callers in any thread."""
    result: T = _TAKER.submit(kept_processes, 1).result().submit(function, *arguments).result()
    return result


@contextmanager
def process_pool(count: int, name: str) -> Iterator[Any]:
    """An executor of `kept_processes`; left early, by Ctrl-C or an error, its processes end.

    Parameters
    ----------
    count : int
    name : str
        Source of the number, for messages.

    Raises
    ------
    InputError
        If a process ended by itself.
    """
    executor = kept_processes(count)
    try:
        yield executor
    except BaseException as error:
        executor.shutdown(wait=False, kill_workers=True)
        if isinstance(error, BrokenExecutor):
            rule = "be processes for which there is memory"
            got = f"{count}, of which one was ended by the system"
            raise InputError(name, rule, got, "take fewer") from None
        raise


def _begin(driver: int) -> None:
    """Set up a process that the process `driver` has started."""
    from loky import process_executor

    # loky restarts processes whose memory grows by 300 MB; compiled programs take this memory.
    process_executor._USE_PSUTIL = False
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the driver's to answer
    if os.name == "posix":
        threading.Thread(target=_end_with, args=(driver,), daemon=True).start()


def _end_with(driver: int) -> None:
    """End this process when its driver has ended; a killed driver cannot end it."""
    while os.getppid() == driver:
        time.sleep(_DRIVER_CHECK)
    os._exit(1)
