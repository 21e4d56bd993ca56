"""A file that is written completely or not at all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from asperity.errors import InputError
from asperity.outputs.targets import fresh_name


@contextmanager
def written_file(target: str | os.PathLike[str], name: str = "out") -> Iterator[Path]:
    """Hand out a path beside `target` whose file replaces `target` at the end.

    An error or an interruption leaves `target` as it was and removes the new file. What is
    written has reached the disk before it gets its name.

    Parameters
    ----------
    target : str or path
        Checked by `output_file` beforehand.
    name : str
        What messages call it, such as ``"--plot"``.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    target = Path(target)
    fresh = fresh_name(target)
    try:
        with writable(target, name):
            yield fresh
            to_disk(fresh)
            fresh.replace(target)
    finally:
        with contextlib.suppress(OSError):
            fresh.unlink(missing_ok=True)


@contextmanager
def writable(target: Path, name: str = "out") -> Iterator[None]:
    """Turn an error of the file system into a sentence about `target`."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{name} must be a file that can be written, got '{target}' "
            f"({(error.strerror or str(error)).lower()}); choose a folder that exists, is "
            "writable and has room"
        ) from None


def to_disk(path: Path) -> None:
    """Wait until the contents of a file have reached the disk."""
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())
