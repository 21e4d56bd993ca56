"""Files that the page sends: in one temporary folder, under names that the server makes.

The folder is removed when the server ends, or by the next server after one that was killed.

A file has a random key that only its sender knows. The sender's name of the file is a text for
messages and never becomes part of a path; of its ending, one of a list is kept, since some formats
are recognised by it.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import tempfile
import weakref
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path

from asperity.errors import InputError, printable, require
from asperity.outputs import free_disk, size_text
from asperity.outputs.atomic import held_folder

#: Largest file (bytes), and all files together.
LARGEST, TOGETHER = 512 * 1024**2, 2 * 1024**3
#: Number of files that are kept; the least recently used file is deleted first.
_MOST_FILES = 200
#: Smallest free space of the disk after an upload (bytes).
_SPARE = 256 * 1024**2
_PREFIX = "asperity-uploads-"
_ENDINGS = ("csv", "txt", "dat", "tsv", "h5", "hdf5", "nc", "mat", "tdms", "json", "gz", "look")


@dataclass(frozen=True)
class Upload:
    """One file.

    Attributes
    ----------
    key : str
        Key of the file on the page.
    path : Path
    name : str
        The sender's name of the file, for people only.
    """

    key: str
    path: Path
    name: str


class Uploads:
    """The uploaded files of a server, and the temporary files of its workers.

    Attributes
    ----------
    folder : Path
    """

    def __init__(self) -> None:
        try:
            self.folder, lock = held_folder(Path(tempfile.gettempdir()), _PREFIX)
        except OSError as error:
            field, got = "the folder for temporary files", f"none ({error.strerror})"
            raise InputError(field, "be one that can be written", got, "set TMPDIR") from None
        self._end = weakref.finalize(self, _remove, self.folder, lock)
        self._files: OrderedDict[str, Upload] = OrderedDict()

    def begin(self, name: str) -> Upload:
        """A place for a new file.

        Raises
        ------
        InputError
            If the disk is full.
        """
        self._make_room()
        free, needed = free_disk(self.folder), LARGEST + _SPARE
        rule = f"have {size_text(needed)} free for a file of the page"
        require(free >= needed, "the disk", rule, size_text(free), "make room")
        key = secrets.token_hex(16)
        ending = re.search(r"\.(\w{1,5})$", name)
        known = ending is not None and ending[1].lower() in _ENDINGS
        suffix = f".{ending[1].lower()}" if ending is not None and known else ""
        upload = Upload(key, self.folder / f"{key}{suffix}", _shown(name))
        self._files[key] = upload
        return upload

    def get(self, key: str) -> Upload:
        """The file of a key.

        Raises
        ------
        InputError
            If there is no such file.
        """
        upload = self._files.get(key)
        if upload is None or not upload.path.is_file():
            rule, advice = "be one that the server still has", "drop the file again"
            raise InputError("recording", rule, "another", advice)
        self._files.move_to_end(key)
        return upload

    def remove(self, key: str) -> None:
        """Delete a file, if it exists."""
        upload = self._files.pop(key, None)
        if upload is not None:
            upload.path.unlink(missing_ok=True)

    def close(self) -> None:
        """Delete all files and their folder."""
        self._files.clear()
        self._end()

    def _make_room(self) -> None:
        """Delete the least recently used files if there are too many or they are too large."""
        while self._files and (
            len(self._files) >= _MOST_FILES or self._size() > TOGETHER - LARGEST
        ):
            self.remove(next(iter(self._files)))

    def _size(self) -> int:
        return sum(f.path.stat().st_size for f in self._files.values() if f.path.is_file())


def _remove(folder: Path, lock: int | None) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    if lock is not None:
        os.close(lock)


def _shown(name: str) -> str:
    """The last part of a name, fit for a line."""
    last = re.split(r"[/\\]", name)[-1].strip()
    return printable(last, 120) or "recording"
