"""Durable writing: a file is complete or absent, whenever the process ends."""

from __future__ import annotations

import os
import shutil
import uuid
from pathlib import Path


def sync_folder(path: Path) -> None:
    """Wait until the directory entries of a folder are on the disk; Windows needs no call."""
    if os.name == "posix":
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def put(file: Path, content: bytes) -> None:
    """Write a file by renaming a complete one; it is on the disk when this returns."""
    make_way(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    fresh = file.with_name(f"{file.name}.{uuid.uuid4().hex}.partial")
    try:
        with fresh.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(fresh, file)
    finally:
        fresh.unlink(missing_ok=True)
    sync_folder(file.parent)


def make_way(file: Path) -> None:
    """Remove a folder in place of `file`, or a file in place of its folder."""
    if file.is_dir() and not file.is_symlink():
        shutil.rmtree(file)
    folder = file.parent
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        folder.unlink()
