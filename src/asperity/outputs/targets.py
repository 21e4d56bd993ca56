"""Checks of where a result goes, made before anything is computed."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path

from asperity.errors import InputError

#: Bytes of the longest name of a file, on all systems.
_LONGEST = 255


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
        What messages call it, such as ``"--out"``.
    example : str
        A file name for messages.
    inputs : mapping of str to path, optional
        Files that are read, by what messages call them: the output must be none of them.

    Raises
    ------
    InputError
        If the path, or one of the files that are written beside it until it is complete, is a
        folder, a pipe or a device, if its folder does not exist or cannot be written, or if it
        is one of the inputs.
    """
    target = _resolved(path, name, example)
    files = (target, *_beside(target))
    require_short(target, files, name)
    for file in files:
        kind = not_a_file(file)
        if kind:
            raise InputError(
                f"{name} must be the name of a file, got '{path}', which is {kind}; "
                f"add a file name such as '{example}'"
                if file == target
                else f"{name} must leave room for '{file.name}' beside it, got '{path}', where "
                f"that is {kind}; choose another name, or move what is there"
            )
    folder = target.parent
    if not folder.is_dir():
        raise InputError(
            f"{name} must lie in a folder that exists, got '{path}'; make the folder or choose "
            "another"
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(
            f"{name} must lie in a folder that can be written, got '{path}'; choose another folder"
        )
    for role, source in (inputs or {}).items():
        if _same(target, Path(source)):
            raise InputError(
                f"{name} must be another file than the {role}, got '{path}'; choose a new name, "
                f"such as '{example}'"
            )
    return target


def output_files(
    paths: Mapping[str, str | os.PathLike[str] | None],
    *,
    inputs: Mapping[str, str | os.PathLike[str]] | None = None,
) -> dict[str, Path]:
    """Check all files that one command writes.

    Parameters
    ----------
    paths : mapping of str to path or None
        By what messages call them, such as ``"--csv"``; None for an output that is not wanted.
    inputs : mapping of str to path, optional
        As for `output_file`.

    Returns
    -------
    dict of str to Path
        The wanted ones, with links followed.

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
            if target == taken:
                raise InputError(
                    f"{name} must be another file than {other}, got '{path}' for both; "
                    "change one of the names"
                )
        targets[name] = target
    return targets


def _resolved(path: str | os.PathLike[str], name: str, example: str) -> Path:
    try:
        target = Path(path).resolve()
        target.exists()
        os.fsencode(target)
    except (OSError, ValueError, RuntimeError, TypeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{name} must be the name of a file, got {str(path)!r} ({why.lower()}); "
            f"write it like '{example}'"
        ) from None
    return target


def _beside(target: Path) -> tuple[Path, ...]:
    """Files that may be written beside the target until it is complete."""
    if not target.name:
        return ()
    partial = unfinished_name(target)
    record = record_name(target)
    return partial, record, fresh_name(record), fresh_name(target)


def require_short(target: Path, files: Iterable[Path], name: str = "out") -> None:
    """Refuse a target beside which files are written of whose names one is too long.

    Raises
    ------
    InputError
        Which calls the target `name`.
    """
    length = max(len(os.fsencode(file.name)) for file in files)
    name_length = len(os.fsencode(target.name))
    if length > _LONGEST:
        raise InputError(
            f"{name} must have a name of at most {_LONGEST - length + name_length} bytes, got "
            f"{name_length}, which leaves no room for the names of files beside it; choose a "
            "shorter one"
        )


def unfinished_name(target: Path) -> Path:
    """Where the finished blocks of a long computation wait."""
    return target.with_name(target.name + ".partial")


def record_name(target: Path) -> Path:
    """Where it is recorded what those blocks are."""
    return target.with_name(target.name + ".partial.json")


def fresh_name(target: Path) -> Path:
    """Where a file is written that replaces the target when it is complete.

    The suffix stays, because libraries choose a format by it.
    """
    return target.with_name(f"{target.stem}.new{target.suffix}")


def require_rereadable(path: Path, label: str) -> None:
    """Refuse pipes and devices, which would be waited for, or never end.

    Raises
    ------
    InputError
        If there is something else at the path than a regular file or a folder.
    """
    other = not_a_file(path)
    if other and not path.is_dir():
        raise InputError(
            f"{label} must be a regular file, got '{path}', {other}; write the data to a file"
        )


def not_a_file(path: Path) -> str:
    """What a path is if it is no regular file; empty if it is one, or nothing."""
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
