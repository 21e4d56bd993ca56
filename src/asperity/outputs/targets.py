"""Checks of output paths, disk space and memory before a computation."""

from __future__ import annotations

import errno
import os
import shutil
import stat
from collections.abc import Mapping, Sequence
from pathlib import Path

from asperity.errors import InputError, require
from asperity.parameters.arguments import typed

#: Share of the free room that one computation may fill.
_SHARE = 0.8

_UNITS = ("B", "kB", "MB", "GB", "TB", "PB", "EB")


@typed
def size_text(count: float) -> str:
    """A number of bytes with its unit, such as ``"1.2 GB"``."""
    power = 0
    while count >= 1000 and power < len(_UNITS) - 1:
        count, power = count / 1000, power + 1
    return f"{count:.3g} {_UNITS[power]}"


def free_memory() -> float:
    """Free memory (bytes); infinite if unknown."""
    free = [_available(), _left_in_group()]
    return min(value for value in (*free, float("inf")) if value is not None)


@typed
def free_disk(folder: Path) -> float:
    """Free space on the disk of a folder (bytes); infinite if unknown."""
    try:
        return float(shutil.disk_usage(folder).free)
    except OSError:
        return float("inf")


@typed
def require_memory(size: float, name: str, what: str, way_out: str) -> None:
    """Refuse a computation that does not fit in memory.

    Parameters
    ----------
    size : float
        Bytes.
    name, what, way_out : str
        Parts of the message: the field, the content, and advice.

    Raises
    ------
    InputError
        If less than `size` is free.
    """
    _require(size, free_memory(), name, what, way_out, "of memory")


@typed
def require_disk(size: float, folder: Path, name: str, what: str, way_out: str) -> None:
    """Refuse an output that does not fit on the disk; parameters as in `require_memory`.

    Raises
    ------
    InputError
        If less than `size` is free.
    """
    _require(size, free_disk(folder), name, what, way_out, "of disk")


def _require(size: float, free: float, name: str, what: str, way_out: str, where: str) -> None:
    got = f"{what}, {size_text(size)}, with {size_text(free)} {where} free"
    require(not size > _SHARE * free, name, "fit into the free space", got, way_out)


def _available() -> float | None:
    """Memory that is available without swapping (bytes)."""
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
    """Free memory of the control group of the process, such as a container (bytes)."""
    group = Path("/sys/fs/cgroup")
    try:
        limit = (group / "memory.max").read_text(encoding="ascii").strip()
        used = (group / "memory.current").read_text(encoding="ascii").strip()
        return None if limit == "max" else float(limit) - float(used)
    except (OSError, ValueError):
        return None


#: Bytes of the longest name of a file, on all systems.
_LONGEST = 255


@typed
def output_file(
    path: str | os.PathLike[str],
    name: str = "out",
    *,
    example: str = "out.csv",
    inputs: Mapping[str, str | os.PathLike[str]] | None = None,
) -> Path:
    """Path of a file that can be written, with links followed.

    Because links are followed, replacing the file leaves a link in its place.

    Parameters
    ----------
    path : str or path
    name : str
        Name in messages, such as ``"--out"``.
    example : str
        A file name for messages.
    inputs : mapping of str to path, optional
        Input files, by their names in messages; the output must be none of them.

    Raises
    ------
    InputError
        If the path, or a temporary file next to it, is a folder, a pipe or a device, if its folder
        does not exist or cannot be written, or if it is one of the inputs.
    """
    target = _resolved(path, name, example)
    files = (target, *_temporary_files(target))
    require_short(target, files, name)
    for file in files:
        kind = not_a_file(file)
        if kind and file == target:
            got, advice = f"'{path}', which is {kind}", f"add a file name such as '{example}'"
            raise InputError(name, "be the name of a file", got, advice)
        if kind:
            rule, got = (
                f"leave room for '{file.name}' next to it",
                f"'{path}', where that is {kind}",
            )
            raise InputError(name, rule, got, "choose another name, or move what is there")
    folder = target.parent
    rule = "lie in a folder that exists"
    require(folder.is_dir(), name, rule, f"'{path}'", "make the folder or choose another")
    rule = "lie in a folder that can be written"
    require(os.access(folder, os.W_OK | os.X_OK), name, rule, f"'{path}'", "choose another folder")
    for role, source in (inputs or {}).items():
        rule, advice = f"be another file than the {role}", f"choose a new name, such as '{example}'"
        require(not _same(target, Path(source)), name, rule, f"'{path}'", advice)
    return target


@typed
def require_netcdf(path: str | os.PathLike[str], name: str, example: str) -> None:
    """Refuse a name that does not end in ``.nc``; parameters as for `output_file`."""
    netcdf = Path(path).suffix.lower() == ".nc"
    require(netcdf, name, "be a NetCDF file", f"'{path}'", f"write it like {example}")


@typed
def output_files(
    paths: Mapping[str, str | os.PathLike[str] | None],
    *,
    inputs: Mapping[str, str | os.PathLike[str]] | None = None,
) -> dict[str, Path]:
    """Check all files that one command writes.

    Parameters
    ----------
    paths : mapping of str to path or None
        Outputs by their names in messages, such as ``"--csv"``; None for no output.
    inputs : mapping of str to path, optional
        As for `output_file`.

    Returns
    -------
    dict of str to Path
        The outputs that are not None, with links followed.

    Raises
    ------
    InputError
        As for `output_file`, and if two of them are one file.
    """
    targets: dict[str, Path] = {}
    for name, path in paths.items():
        if path is None:
            continue
        example = "new" + (Path(path).suffix or ".csv")
        target = output_file(path, name, example=example, inputs=inputs)
        for other, taken in targets.items():
            rule = f"be another file than {other}"
            require(target != taken, name, rule, f"'{path}' for both", "change one of the names")
        targets[name] = target
    return targets


def _resolved(path: str | os.PathLike[str], name: str, example: str) -> Path:
    try:
        target = Path(path).resolve()
        if target.is_symlink():  # of a circle; an error of `resolve` itself before Python 3.13
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        target.exists()
        os.fsencode(target)
    except (OSError, ValueError, RuntimeError, TypeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        got = f"{str(path)!r} ({why.lower()})"
        raise InputError(name, "be the name of a file", got, f"write it like '{example}'") from None
    return target


def _temporary_files(target: Path) -> tuple[Path, ...]:
    """Files that may be written next to the target until it is complete."""
    if not target.name:
        return ()
    partial = unfinished_name(target)
    record = record_name(target)
    return partial, record, fresh_name(record), fresh_name(target)


@typed
def require_short(target: Path, files: Sequence[Path], name: str = "out") -> None:
    """Refuse a target if the name of a temporary file next to it is too long.

    Raises
    ------
    InputError
        About `name`.
    """
    length = max(len(os.fsencode(file.name)) for file in files)
    name_length = len(os.fsencode(target.name))
    rule = f"have a name of at most {_LONGEST - length + name_length} bytes"
    got = f"{name_length}, which leaves no room for the names of temporary files"
    require(not length > _LONGEST, name, rule, got, "choose a shorter one")


def unfinished_name(target: Path) -> Path:
    """File of the finished blocks of a long computation."""
    return target.with_name(target.name + ".partial")


def record_name(target: Path) -> Path:
    """File of the record of the finished blocks."""
    return target.with_name(target.name + ".partial.json")


def fresh_name(target: Path) -> Path:
    """Temporary file that replaces the target when it is complete.

    The suffix stays, because libraries choose a format by it.
    """
    return target.with_name(f"{target.stem}.new{target.suffix}")


def require_rereadable(path: Path, label: str) -> None:
    """Refuse pipes and devices, which may block or never end.

    Raises
    ------
    InputError
        If the path is neither a regular file nor a folder.
    """
    other = not_a_file(path)
    got = f"'{path}', {other}"
    require(not other or path.is_dir(), label, "be a regular file", got, "write the data to a file")


def not_a_file(path: Path) -> str:
    """Type of a path that is no regular file; empty for a file, or if nothing exists."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return ""
    if stat.S_ISREG(mode):
        return ""
    if stat.S_ISDIR(mode):
        return "a folder"
    if stat.S_ISFIFO(mode):
        return "a pipe"
    if stat.S_ISSOCK(mode):
        return "a socket"
    return "a device"


def _same(target: Path, source: Path) -> bool:
    try:
        return target == source.resolve() or target.samefile(source)
    except (OSError, ValueError, RuntimeError):
        return False
