"""A folder that is written completely or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from asperity.errors import InputError


@contextmanager
def written_whole(folder: Path) -> Iterator[Path]:
    """Hand out a temporary folder whose files are moved to `folder` at the end.

    An error, or an interruption, leaves `folder` as it was. Files of other names that lie there
    stay. The temporary folder lies inside `folder` if that exists, else beside it, so that moving
    is renaming, which cannot stop half-way through a file.

    Raises
    ------
    InputError
        At once, if the folder cannot be written.
    """
    staging = _staging(folder)
    try:
        yield staging
        _move_files(staging, folder)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _staging(folder: Path) -> Path:
    try:
        if folder.exists() and not folder.is_dir():
            raise NotADirectoryError(20, "it is a file")
        place = folder
        while not place.exists():
            place = place.parent
        return Path(tempfile.mkdtemp(prefix=".asperity-", dir=place))
    except OSError as error:
        raise _unwritable(folder, error) from None


def _move_files(staging: Path, folder: Path) -> None:
    try:
        for source in sorted(p for p in staging.rglob("*") if p.is_file()):
            target = folder / source.relative_to(staging)
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, target)
    except OSError as error:
        raise _unwritable(folder, error) from None


def _unwritable(folder: Path, error: OSError) -> InputError:
    why = (error.strerror or "no reason given").lower()
    return InputError(
        f"out must be a folder that can be written, got '{folder}' ({why}); choose another folder"
    )
