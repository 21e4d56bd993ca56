"""The lock of a store: one driver at a time works on a store, and workers check its token.

The lock is a file next to the store, ``STORE.lock``. The operating system drops the lock when the
process ends, however it ends. On some shared file systems a lock is not seen by other machines;
there the time of the file, which the driver refreshes, shows that the driver runs.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import time
import uuid
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.outputs.atomic import writable
from asperity.outputs.json import json_content

try:
    import fcntl
except ImportError:  # pragma: no cover  Windows: the age of the file decides
    fcntl = None  # type: ignore[assignment]

#: Seconds without refresh after which a lock of another machine is ignored.
STALE = 60.0

#: Entries of a lock file and their types.
_HOLDER = {"token": str, "host": str, "process": int, "since": str}


@dataclass(frozen=True)
class StoreLock:
    """The lock that this process has.

    Attributes
    ----------
    token : str
        Token of this driver; its workers stop writing when the file has another token.
    descriptor : int
        File descriptor of the open lock file.
    """

    token: str
    descriptor: int

    def refresh(self) -> None:
        """Update the time of the file; the driver calls this every few seconds."""
        os.utime(self.descriptor)


@contextmanager
def store_lock(store: Path) -> Iterator[StoreLock]:
    """Take the lock of a store; its file is removed at the end.

    Raises
    ------
    InputError
        If another driver has it, or the file cannot be written.
    """
    path, token = lock_file(store), uuid.uuid4().hex
    with _writable(path):
        descriptor = _locked(path)
    record = {
        "token": token,
        "host": socket.gethostname(),
        "process": os.getpid(),
        "since": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }
    try:
        with _writable(path):
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, json.dumps(record).encode(), 0)
        yield StoreLock(token, descriptor)
    finally:
        # Without a token in it the file is the one that could not be written.
        if current_token(store) in (token, ""):
            path.unlink(missing_ok=True)
        os.close(descriptor)


def _writable(path: Path) -> AbstractContextManager[None]:
    return writable(path, "out", "lie in a folder that can be written", "choose another folder")


def _locked(path: Path) -> int:
    """Descriptor of the lock file, with the lock."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        holder = _holder_of(path)
        held = _is_held(descriptor, holder, exclusive=True)
        # The last holder may have removed the file between the opening and the locking.
        with contextlib.suppress(FileNotFoundError):
            if not held and os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor
        os.close(descriptor)
        if held:
            user = _text(holder) or "another process"
            raise InputError(
                "out",
                "not be in use",
                f"'{path.with_suffix('').name}', which {user} is using",
                "wait for it or stop it (asperity sweep status shows its progress)",
            )


def lock_file(store: Path) -> Path:
    """Path of the lock file of a store."""
    return store.with_name(store.name + ".lock")


def _is_held(descriptor: int, holder: dict[str, Any], *, exclusive: bool) -> bool:
    """Whether another driver has the lock of an open file; if not, this process has it now."""
    if fcntl is not None:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_NB | (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH))
        except BlockingIOError:
            return True
        except OSError:
            pass  # a file system without locks: the age of the file decides
        else:
            if holder.get("host") in (None, socket.gethostname()):
                return False
    return bool(holder) and time.time() - os.fstat(descriptor).st_mtime < STALE


def running_driver(store: Path) -> str:
    """The driver that works on a store, in words; "" without one.

    A killed driver leaves the file, but holds no lock.
    """
    holder = _holder_of(lock_file(store))
    try:
        descriptor = os.open(lock_file(store), os.O_RDONLY)
    except OSError:
        return ""
    try:
        return _text(holder) if _is_held(descriptor, holder, exclusive=False) else ""
    finally:
        os.close(descriptor)


def _text(holder: dict[str, Any]) -> str:
    return "process {process} on {host} since {since}".format_map(holder) if holder else ""


def _holder_of(path: Path) -> dict[str, Any]:
    """Contents of a lock file; empty if it is missing or invalid."""
    holder = json_content(path)
    if not isinstance(holder, dict):
        return {}
    whole = all(isinstance(holder.get(name), kind) for name, kind in _HOLDER.items())
    return holder if whole else {}


def current_token(store: Path) -> str:
    """Token of the driver that works on a store; empty without a driver."""
    return str(_holder_of(lock_file(store)).get("token", ""))
