"""The unfinished output: whole blocks beside a record of what they belong to.

``OUT.partial`` holds the output as far as it is done, ``OUT.partial.json`` its length, the rows in
it and the fingerprint of table and options. The record is replaced after each block has reached the
disk: what lies behind the recorded length is a block that was never finished.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from asperity.errors import InputError


@dataclass
class Progress:
    """What the record says: finished rows, failed ones among them, and bytes of output."""

    rows: int = 0
    failed: int = 0
    length: int = 0


class PartialOutput:
    """The output on its way to `target`.

    Parameters
    ----------
    target : Path
        Appears only when all rows are done.
    fingerprint : str
        Identifies table and options.
    """

    def __init__(self, target: Path, fingerprint: str) -> None:
        self.target = target
        self.fingerprint = fingerprint
        self.path = target.with_name(target.name + ".partial")
        self.record = target.with_name(target.name + ".partial.json")
        self.done = Progress()

    def start(self, resume: bool) -> None:
        """Take up what an interrupted run left, or begin an empty output.

        Raises
        ------
        InputError
            If finished blocks exist and are not to be used, or belong to another table.
        """
        if self.record.exists() and self.path.exists():
            if not resume:
                raise InputError(
                    f"{self.target} must not have an unfinished run, got '{self.record}'; "
                    "go on with --resume, or delete it to start over"
                )
            self._take_up()
            return
        with _writing(self.target), self.path.open("wb"):
            pass

    def _take_up(self) -> None:
        try:
            said = json.loads(self.record.read_text(encoding="utf-8"))
            done = Progress(said["rows"], said["failed"], said["length"])
            same = said["fingerprint"] == self.fingerprint
            long_enough = self.path.stat().st_size >= done.length
        except (OSError, ValueError, KeyError, TypeError):
            same = long_enough = False
        if not (same and long_enough):
            raise InputError(
                f"{self.record} must belong to the same table, options and version, got another; "
                "repeat the earlier command, or delete it to start over"
            )
        self.done = done

    def append(self, rows: Iterable[Sequence[object]], count: int, failed: int, comma: str) -> None:
        """Add a block of `count` rows, of which `failed` have no result."""
        text = io.StringIO(newline="")
        csv.writer(text, delimiter=comma, lineterminator="\n").writerows(rows)
        with _writing(self.target), self.path.open("r+b") as stream:
            stream.truncate(self.done.length)
            stream.seek(self.done.length)
            stream.write(text.getvalue().encode())
            _to_disk(stream)
            length = stream.tell()
        if count:
            done = Progress(self.done.rows + count, self.done.failed + failed, length)
            self._note(done)
            self.done = done
        else:
            self.done.length = length

    def _note(self, done: Progress) -> None:
        said = {"fingerprint": self.fingerprint, **vars(done)}
        fresh = self.record.with_name(self.record.name + ".new")
        with _writing(self.target):
            with fresh.open("wb") as stream:
                stream.write(json.dumps(said).encode())
                _to_disk(stream)
            fresh.replace(self.record)

    def finish(self) -> None:
        """Put the output in its place."""
        with _writing(self.target):
            self.path.replace(self.target)
        self.record.unlink(missing_ok=True)

    def drop_if_empty(self) -> None:
        """Leave nothing behind when not one block was finished."""
        if not self.done.rows:
            self.path.unlink(missing_ok=True)
            self.record.unlink(missing_ok=True)


def _to_disk(stream: BinaryIO) -> None:
    stream.flush()
    os.fsync(stream.fileno())


@contextmanager
def _writing(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(
            f"out must be a file that can be written, got '{target}' ({error.strerror}); "
            "choose a folder that exists, is writable and has room"
        ) from None
