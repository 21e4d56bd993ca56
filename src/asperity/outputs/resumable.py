"""Resumable output of a long computation: finished blocks, and a record of them.

``OUT.partial`` holds the finished blocks. ``OUT.partial.json``, the record, holds the inputs of the
computation and its progress. The record is replaced after each block is on the disk: bytes behind
the recorded end belong to an unfinished block.
"""

from __future__ import annotations

import csv
import io
import json
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from asperity._version import __version__
from asperity.errors import InputError, require
from asperity.outputs.atomic import replaced, to_disk, writable
from asperity.outputs.json import json_content
from asperity.outputs.targets import fresh_name, record_name, unfinished_name
from asperity.parameters.arguments import typed

_Result = TypeVar("_Result")

#: Largest number of differences in a message.
_LISTED = 3

#: Bytes of finished blocks that are read together.
_PART = 2**20


class Interrupted(KeyboardInterrupt):
    """The user stopped a computation; the message tells what is kept and how to continue.

    Parameters
    ----------
    kept : str
        The finished part, such as ``"8 of 12 rows"``; empty if nothing is kept.
    """

    def __init__(self, kept: str = "") -> None:
        super().__init__(
            f"interrupted with {kept} finished; repeat the command with --resume to go on from "
            "there"
            if kept
            else "interrupted before the first block was finished; nothing was written"
        )


@typed
class UnfinishedOutput:
    """The finished blocks of an output, and their record.

    Parameters
    ----------
    target : Path
        Appears only when everything is done.
    inputs : mapping of str to object
        Everything that the numbers depend on, as JSON values by name; nested mappings are allowed.
        The version of the package is added.

    Attributes
    ----------
    data : Path
        File of the finished blocks.
    record : Path
    progress : dict of str to object
        The saved progress; empty before the first block.
    """

    def __init__(self, target: Path, inputs: Mapping[str, Any]) -> None:
        self.target = target
        self.inputs = json.loads(json.dumps({"version": __version__, **inputs}))
        self.data = unfinished_name(target)
        self.record = record_name(target)
        self.progress: dict[str, Any] = {}

    def start(self, resume: bool) -> dict[str, Any]:
        """Read the record of an interrupted computation.

        Returns
        -------
        dict
            The saved progress; empty without one.

        Raises
        ------
        InputError
            If finished blocks exist and are not to be used, belong to other inputs, or have a
            damaged record.
        """
        if not (self.record.exists() and self.data.exists()):
            return self.progress
        advice = "go on with --resume, or delete it to start over"
        require(resume, str(self.target), "not have an unfinished run", f"'{self.record}'", advice)
        try:
            saved = json_content(self.record)
            inputs, progress = dict(saved["inputs"]), dict(saved["progress"])
            whole = saved["checksum"] == _checksum(progress)
            different = differences(inputs, self.inputs)
        except (ValueError, KeyError, TypeError, RecursionError):
            raise self.damaged() from None
        advice = "repeat the earlier command, or delete it to start over"
        require(not different, str(self.record), "belong to the same inputs", different, advice)
        if not whole:
            raise self.damaged()
        self.progress = progress
        return progress

    def damaged(self) -> InputError:
        """The error for a record that does not agree with the blocks."""
        return InputError(
            f"{self.record} must be the record of finished blocks, got a damaged one; "
            "delete it to start over"
        )

    def save(self, progress: Mapping[str, Any]) -> None:
        """Record the progress after a block has been written to `data`.

        Parameters
        ----------
        progress : mapping of str to object
            JSON values, from which doubles are restored exactly.
        """
        progress = dict(progress)
        saved = {"inputs": self.inputs, "progress": progress, "checksum": _checksum(progress)}
        with writable(self.target):
            to_disk(self.data)
            with replaced(self.record, fresh_name(self.record)) as fresh:
                fresh.write_text(json.dumps(saved), encoding="utf-8")
        self.progress = progress

    def finish(self) -> None:
        """Give the blocks their final name, and remove the record."""
        with writable(self.target):
            to_disk(self.data)
            self.data.replace(self.target)
        self.record.unlink(missing_ok=True)

    def discard(self) -> None:
        """Remove blocks and record."""
        self.data.unlink(missing_ok=True)
        self.record.unlink(missing_ok=True)

    @contextmanager
    def interruptible(self, finished: Callable[[], str]) -> Iterator[None]:
        """Raise `Interrupted` on Ctrl-C; remove all files if no block is finished at the end.

        Parameters
        ----------
        finished : callable
            Returns the finished part, such as ``"8 of 12 rows"``.
        """
        try:
            yield
        except KeyboardInterrupt:
            raise Interrupted(finished() if self.progress else "") from None
        finally:
            if not self.progress:
                self.discard()


class UnfinishedText(UnfinishedOutput):
    """Finished blocks of lines of text.

    The progress holds ``length``, the bytes of the finished blocks, ``crc32``, their checksum,
    ``rows`` and further counts.
    """

    def start(self, resume: bool) -> dict[str, Any]:
        """As in `UnfinishedOutput`, and make an empty file if no block is finished."""
        progress = super().start(resume)
        if progress:
            if not self._whole():
                self.progress = {}
                raise self.damaged()
        else:
            with writable(self.target):
                self.data.write_bytes(b"")
        return progress

    def _whole(self) -> bool:
        """Whether the finished blocks agree with their checksum."""
        left, checksum = self.progress.get("length", 0), 0
        with writable(self.target), self.data.open("rb") as stream:
            while left > 0 and (part := stream.read(min(left, _PART))):
                left, checksum = left - len(part), zlib.crc32(part, checksum)
        return left == 0 and checksum == self.progress.get("crc32")

    @property
    def rows(self) -> int:
        """Finished rows."""
        return int(self.progress.get("rows", 0))

    def append(self, text: str, rows: int, **counts: int) -> None:
        """Append a block of `rows` rows and record it.

        Parameters
        ----------
        text : str
        rows : int
        **counts : int
            Other numbers that add up over the blocks, such as ``failed``.
        """
        length = self.progress.get("length", 0)
        with writable(self.target), self.data.open("r+b") as stream:
            stream.truncate(length)
            stream.seek(length)
            stream.write(text.encode())
            length = stream.tell()
        crc32 = zlib.crc32(text.encode(), self.progress.get("crc32", 0))
        added = {"rows": rows, **counts}
        summed = {name: self.progress.get(name, 0) + count for name, count in added.items()}
        self.save({**self.progress, **summed, "length": length, "crc32": crc32})

    def append_rows(
        self,
        rows: Sequence[Sequence[object]],
        delimiter: str = ",",
        header: Sequence[object] | None = None,
        **counts: int,
    ) -> None:
        """`append` rows of cells as CSV, after a line of column names if a header is given."""
        text = io.StringIO(newline="")
        writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
        writer.writerows([*([header] if header is not None else []), *rows])
        self.append(text.getvalue(), len(rows), **counts)

    def text(self) -> str:
        """The finished blocks."""
        with self.data.open("rb") as stream:
            return stream.read(self.progress.get("length", 0)).decode()


def _checksum(progress: Mapping[str, Any]) -> int:
    return zlib.crc32(json.dumps(progress, sort_keys=True).encode())


@typed
def undisturbed(work: Callable[[], _Result]) -> _Result:
    """Run `work` without interruption by Ctrl-C.

    Ctrl-C reaches the main thread only, which waits here while another one works.
    """
    with ThreadPoolExecutor(1) as worker:
        return worker.submit(work).result()


def _flat(inputs: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings as one, with dots between the names."""
    flat: dict[str, Any] = {}
    for name, value in inputs.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{name}.")
        else:
            flat[prefix + name] = value
    return flat


@typed
def differences(saved: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """Differences between inputs, in words; empty if there are none.

    Parameters
    ----------
    saved, wanted : mapping of str to object
        Inputs of the existing output and of the present command, as JSON values; nested mappings
        are allowed.
    """
    saved, wanted = _flat(saved), _flat(wanted)
    changed = [n for n in {**saved, **wanted} if saved.get(n, ...) != wanted.get(n, ...)]
    listed = [
        f"{name} = {_shown(saved, name)} there and {_shown(wanted, name)} here"
        for name in changed[:_LISTED]
    ]
    if len(changed) > _LISTED:
        listed.append(f"{len(changed) - _LISTED} other differences")
    return ", ".join(listed)


def _shown(values: Mapping[str, Any], name: str) -> str:
    if name not in values:
        return "nothing"
    text = json.dumps(values[name])
    return text if len(text) <= 60 else text[:57] + "..."
