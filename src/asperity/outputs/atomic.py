"""Atomic output: files and folders that are written completely or not at all."""

from __future__ import annotations

import contextlib
import csv
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from asperity.errors import InputError
from asperity.outputs.targets import fresh_name
from asperity.parameters.arguments import typed

try:
    import fcntl
except ImportError:  # pragma: no cover  Windows: temporary folders of killed runs stay
    fcntl = None  # type: ignore[assignment]

_PREFIX = ".asperity-unfinished-"


@typed
@contextmanager
def written_file(target: str | os.PathLike[str], name: str = "out") -> Iterator[Path]:
    """A temporary path next to `target`, whose file replaces `target` as in `replaced`.

    Parameters
    ----------
    target : str or path
        Checked by `output_file` beforehand.
    name : str
        Name in messages, such as ``"--plot"``.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    target = Path(target)
    with writable(target, name), replaced(target, fresh_name(target)) as fresh:
        yield fresh


@contextmanager
def replaced(target: Path, fresh: Path) -> Iterator[Path]:
    """The temporary path `fresh`, whose file replaces `target` at the end.

    An error or an interruption leaves `target` as it was and removes the new file. The content has
    reached the disk before the file gets its name.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    try:
        yield fresh
        to_disk(fresh)
        fresh.replace(target)
    finally:
        with contextlib.suppress(OSError):
            fresh.unlink(missing_ok=True)


@contextmanager
def writable(
    target: Path,
    name: str = "out",
    rule: str = "be a file that can be written",
    advice: str = "choose a folder that exists, is writable and has room",
) -> Iterator[None]:
    """Raise an `InputError` about `target` in place of an error of the file system."""
    try:
        yield
    except OSError as error:
        got = f"'{target}' ({(error.strerror or str(error)).lower()})"
        raise InputError(name, rule, got, advice) from None


def to_disk(path: Path) -> None:
    """Wait until the contents of a file are on the disk."""
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())


@typed
def require_folder(folder: Path, name: str = "out") -> None:
    """Refuse a folder that cannot be written, before anything is computed for it.

    Raises
    ------
    InputError
        About `name`.
    """
    with written_folder(folder, name):
        pass  # without files


@typed
@contextmanager
def written_folder(folder: Path, name: str = "out") -> Iterator[Path]:
    """A temporary folder, whose files are moved to `folder` at the end.

    An error, or an interruption, leaves `folder` as it was. Other files in `folder` stay. The
    temporary folder is inside `folder` if that exists, else next to it, so that each file is moved
    by renaming, which is atomic. Temporary folders that killed processes have left there are
    removed; those of running processes stay.

    Raises
    ------
    InputError
        About `name`, at once, if the folder cannot be written.
    """
    rule, advice = "be a folder that can be written", "choose another folder"
    with writable(folder, name, rule, advice):
        if folder.exists() and not folder.is_dir():
            raise NotADirectoryError(20, "it is a file")
        place = folder
        while not place.exists():
            place = place.parent
        staging, lock = held_folder(place, _PREFIX)
    try:
        yield staging
        with writable(folder, name, rule, advice):
            for source in sorted(p for p in staging.rglob("*") if p.is_file()):
                target = folder / source.relative_to(staging)
                target.parent.mkdir(parents=True, exist_ok=True)
                source.replace(target)
    finally:
        shutil.rmtree(staging, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def held_folder(place: Path, prefix: str) -> tuple[Path, int | None]:
    """A new temporary folder, and the descriptor of its lock (None without locks).

    Folders of the same prefix that killed processes have left are removed; those of running
    processes stay.

    Parameters
    ----------
    place : Path
        Parent folder.
    prefix : str
        Beginning of the folder's name.
    """
    # Until it is locked, another process might take the new folder for abandoned and remove it.
    guard = _locked(place, wait=True)
    try:
        if guard is not None:
            _remove_abandoned(place, prefix)
        made = Path(tempfile.mkdtemp(prefix=prefix, dir=place))
        return made, _locked(made)
    finally:
        if guard is not None:
            os.close(guard)


def _remove_abandoned(place: Path, prefix: str) -> None:
    """Remove temporary folders that no running process holds."""
    for left in place.glob(f"{prefix}*"):
        if left.is_symlink() or not left.is_dir():
            continue
        lock = _locked(left)
        if lock is not None:
            shutil.rmtree(left, ignore_errors=True)
            os.close(lock)


def _locked(folder: Path, *, wait: bool = False) -> int | None:
    """Lock a folder until the descriptor is closed or the process ends, however it ends.

    None if another process has locked it, or if the file system has no locks.
    """
    if fcntl is None:
        return None
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


@typed
def write_table(path: Path, names: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a table: a line of names, and a line for each row."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([names, *rows])
