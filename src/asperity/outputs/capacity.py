"""Room in memory and on disk, asked for before anything large is computed."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from asperity.errors import InputError

#: Share of the free room that one computation may fill.
_SHARE = 0.8

_UNITS = ("B", "kB", "MB", "GB", "TB", "PB", "EB")


def size_text(count: float) -> str:
    """Return a number of bytes with its unit, such as ``"1.2 GB"``."""
    power = 0
    while count >= 1000 and power < len(_UNITS) - 1:
        count, power = count / 1000, power + 1
    return f"{count:.3g} {_UNITS[power]}"


def free_memory() -> float:
    """Bytes of memory that can still be filled; infinite where the system does not tell."""
    free = [_available(), _left_in_group()]
    return min(value for value in (*free, float("inf")) if value is not None)


def free_disk(folder: Path) -> float:
    """Bytes that a folder's disk can still hold; infinite where the system does not tell."""
    try:
        return float(shutil.disk_usage(folder).free)
    except OSError:
        return float("inf")


def require_memory(size: float, name: str, what: str, way_out: str) -> None:
    """Refuse what memory cannot hold.

    Parameters
    ----------
    size : float
        Bytes.
    name, what, way_out : str
        Parts of the message: the field, what would be held, and what to do instead.

    Raises
    ------
    InputError
        If less than `size` is free.
    """
    _require(size, free_memory(), name, what, way_out, "of memory")


def require_disk(size: float, folder: Path, name: str, what: str, way_out: str) -> None:
    """Refuse what a folder's disk cannot hold; parameters as in `require_memory`.

    Raises
    ------
    InputError
        If less than `size` is free.
    """
    _require(size, free_disk(folder), name, what, way_out, "of disk")


def _require(size: float, free: float, name: str, what: str, way_out: str, where: str) -> None:
    if size > _SHARE * free:
        raise InputError(
            f"{name} must come to what there is room for, got {what}, {size_text(size)}, with "
            f"{size_text(free)} {where} free; {way_out}"
        )


def _available() -> float | None:
    """Memory that the system can hand out without swapping."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError, AttributeError):
        return None


def _left_in_group() -> float | None:
    """Memory left to the control group that the process runs in, such as a container's."""
    group = Path("/sys/fs/cgroup")
    try:
        limit = (group / "memory.max").read_text(encoding="ascii").strip()
        used = (group / "memory.current").read_text(encoding="ascii").strip()
        return None if limit == "max" else float(limit) - float(used)
    except (OSError, ValueError):
        return None
