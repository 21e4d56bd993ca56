"""The lock of a store: one driver at a time works on a store, and workers check its token."""

from __future__ import annotations

import json
import os
import socket
import time
import uuid
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.outputs.json import json_content

try:
    import fcntl
except ImportError:  # pragma: no cover  Windows: the age of the file decides
    fcntl = None  # type: ignore[assignment]

#: Seconds without refresh after which a lock of another machine is ignored.
STALE = 60.0

#: Entries of a lock file and their types.
_HOLDER = {"token": str, "host": str, "process": int, "since": str}


class StoreLock:
    """The lock file next to a store, ``STORE.lock``.

    The operating system drops the lock when the process ends, however it ends. On some shared file
    systems a lock is not seen by other machines; there the time of the file, which the driver
    refreshes, shows that the driver runs.

    Parameters
    ----------
    store : Path

    Attributes
    ----------
    path : Path
    token : str
        Token of this driver; its workers stop writing when the file has another token.
    """

    def __init__(self, store: Path) -> None:
        self.path = lock_file(store)
        self.token = uuid.uuid4().hex
        self._descriptor: int | None = None

    def acquire(self) -> None:
        """Take the lock.

        Raises
        ------
        InputError
            If another driver has it, or the file cannot be written.
        """
        while self._descriptor is None:
            try:
                descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as error:
                raise InputError(
                    f"out must lie in a folder that can be written, got '{self.path}' "
                    f"({(error.strerror or str(error)).lower()}); choose another folder"
                ) from None
            try:
                holder = holder_of(self.path)
                if _is_held(descriptor, holder, exclusive=True):
                    raise self._refused(holder)
                # The last holder may have removed the file between the opening and the locking.
                if os.path.samestat(os.fstat(descriptor), self.path.stat()):
                    self._descriptor = descriptor
            except FileNotFoundError:
                pass
            finally:
                if self._descriptor is None:
                    os.close(descriptor)
        record = {
            "token": self.token,
            "host": socket.gethostname(),
            "process": os.getpid(),
            "since": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        }
        os.ftruncate(self._descriptor, 0)
        os.pwrite(self._descriptor, json.dumps(record).encode(), 0)

    def _refused(self, holder: dict[str, Any]) -> InputError:
        who = (
            f"process {holder['process']} on {holder['host']} since {holder['since']}"
            if holder
            else "another process"
        )
        return InputError(
            f"out must not be in use, got '{self.path.with_suffix('').name}', which {who} is "
            "using; wait for it or stop it (asperity sweep status shows its progress)"
        )

    def refresh(self) -> None:
        """Update the time of the file; the driver calls this every few seconds."""
        if self._descriptor is not None:
            os.utime(self._descriptor)

    def release(self) -> None:
        """Release the lock and remove its file."""
        if self._descriptor is not None:
            if holder_of(self.path).get("token") == self.token:
                self.path.unlink(missing_ok=True)
            os.close(self._descriptor)
            self._descriptor = None

    def __enter__(self) -> StoreLock:
        self.acquire()
        return self

    def __exit__(self, *error: object) -> None:
        self.release()


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


def running_driver(store: Path) -> dict[str, Any]:
    """Contents of the lock file while a driver runs; empty without one.

    A killed driver leaves the file, but holds no lock.
    """
    holder = holder_of(lock_file(store))
    try:
        descriptor = os.open(lock_file(store), os.O_RDONLY)
    except OSError:
        return {}
    try:
        return holder if _is_held(descriptor, holder, exclusive=False) else {}
    finally:
        os.close(descriptor)


def holder_of(path: Path) -> dict[str, Any]:
    """Contents of a lock file; empty if it is missing or invalid."""
    holder = json_content(path)
    if not isinstance(holder, dict):
        return {}
    whole = all(isinstance(holder.get(name), kind) for name, kind in _HOLDER.items())
    return holder if whole else {}


def current_token(store: Path) -> str:
    """Token of the driver that works on a store; empty without a driver."""
    return str(holder_of(lock_file(store)).get("token", ""))
