"""Files and folders that are whole, or not there, whenever the process ends."""

from __future__ import annotations

import os
import shutil
import uuid
from pathlib import Path


def sync_file(path: Path) -> None:
    """Wait until the contents of a file have reached the disk."""
    _sync(path, os.O_RDWR)


def sync_folder(path: Path) -> None:
    """Wait until the names in a folder have reached the disk; Windows needs no such call."""
    if os.name == "posix":
        _sync(path, os.O_RDONLY)


def _sync(path: Path, flags: int) -> None:
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def put(file: Path, content: bytes) -> None:
    """Write a file that is whole at any moment; it is on the disk after `sync_file`."""
    make_way(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    fresh = file.with_name(f"{file.name}.{uuid.uuid4().hex}.partial")
    try:
        fresh.write_bytes(content)
        os.replace(fresh, file)
    finally:
        fresh.unlink(missing_ok=True)


def make_way(file: Path) -> None:
    """Remove a folder that has the name of a file, or a file that has that of its folder."""
    if file.is_dir() and not file.is_symlink():
        shutil.rmtree(file)
    folder = file.parent
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        folder.unlink()
