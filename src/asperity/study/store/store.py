"""Reading and writing the store of a sweep.

Every variable is a Zarr array with named dimensions and units. A chunk is done if its number in the
array ``status`` says so; this number is written when the data of the chunk are on the disk.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from glob import glob
from pathlib import Path
from typing import Any, Literal

import numpy as np
import zarr

from asperity.arrays import Float
from asperity.errors import InputError
from asperity.outputs.atomic import to_disk
from asperity.outputs.json import json_content
from asperity.study.plan import OF_CHUNKS, OF_POINTS
from asperity.study.points import Answers
from asperity.study.store.layout import ALL_CHUNKS, NOT_DONE, checksum, chunk_file, reset
from asperity.study.store.root import Root, make_way, read_root, sync_folder, write_root

#: Errors of reading a damaged chunk; which one depends on the codec.
_DAMAGED = (ValueError, RuntimeError, OSError, KeyError, TypeError)


class SweepStore:
    """A store that exists.

    Parameters
    ----------
    path : Path
    mode : {"r", "r+"}
        "r" to read only: all files except the answers must be undamaged. For "r+" the driver has
        repaired the store before.

    Attributes
    ----------
    root : Root
    grid : SweepGrid
    arrays, labels : dict of str to zarr.Array
        Answers by name; coordinates by name.

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is to be read and is damaged.
    """

    def __init__(self, path: Path, mode: Literal["r", "r+"] = "r+") -> None:
        self.path = path
        self.root = read_root(path)
        self.grid = self.root.grid
        self.record: dict[str, Any] = self.grid.record
        if mode == "r":
            _require_whole(path, self.root)
        group = zarr.open_group(path, mode=mode, use_consolidated=False)
        names = (*self.record["outputs"], *OF_POINTS)
        self.arrays = {name: _array(group, name) for name in names}
        self.checksum, self.status = (_array(group, name) for name in OF_CHUNKS)
        labels = [name for name in self.root.arrays if name not in self._of_chunks]
        self.labels = {name: _array(group, name) for name in labels}
        if mode == "r":
            self._require_labels()

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of the store."""
        return self.root.attributes

    @property
    def _of_chunks(self) -> tuple[str, ...]:
        return (*self.arrays, *OF_CHUNKS)

    def _require_labels(self) -> None:
        """Refuse to read a store whose coordinates have changed since they were written."""
        for name, array in self.labels.items():
            digest = checksum()
            try:
                for place in np.ndindex(*array.cdata_shape):
                    digest.update(chunk_file(self.path, name, place).read_bytes())
            except OSError:
                digest = None
            if (
                digest is None
                or digest.hexdigest() != self.attributes["coordinate_checksums"][name]
            ):
                raise _damaged(self.path, f"coordinate '{name}'")

    # Chunks

    def failed_in(self, chunk: int) -> int:
        """Failed points of a chunk; -1 if it is not done or its status is damaged."""
        return self._of(self.status, chunk, NOT_DONE)

    def share_done(self) -> float:
        """Share of the chunks that are done, from the number of files of ``status``."""
        files = sum(len(names) for _, _, names in os.walk(self.path / "status" / "c"))
        return min(1.0, files / self.grid.chunk_count)

    def is_sound(self, chunk: int) -> bool:
        """Whether the files of a chunk agree with its checksum."""
        try:
            return self._of(self.checksum, chunk, 0) == self._digest(chunk, self.failed_in(chunk))
        except OSError:
            return False

    def states(self, chunks: Iterable[int] | None = None) -> Iterator[tuple[int, int, bool]]:
        """Number of each chunk that is done, its failed points, and whether it is sound."""
        for chunk in range(self.grid.chunk_count) if chunks is None else chunks:
            # A chunk that a driver is writing may appear damaged once.
            for _ in range(2):
                # Of a chunk that is not done there is no such file.
                done = self._file("status", chunk).exists()
                failed = self.failed_in(chunk)
                sound = not done or self.is_sound(chunk)
                if sound:
                    break
            if done:
                yield chunk, failed, sound

    def done(self, chunks: Iterable[int] | None = None) -> Iterator[int]:
        """Numbers of the chunks that are done, of all or of `chunks`.

        Raises
        ------
        InputError
            If the files of a chunk do not agree with its checksum.
        """
        for chunk, _, sound in self.states(chunks):
            if not sound:
                raise _damaged(self.path, f"chunk {chunk}")
            yield chunk

    def _of(self, array: Any, chunk: int, otherwise: int) -> int:
        try:
            return int(array[self.grid.place(chunk)])
        except _DAMAGED:
            return otherwise

    def _digest(self, chunk: int, failed: int) -> int:
        """Checksum of a chunk: its part of the grid, its failed points and its files."""
        digest = checksum(repr((self.grid.slices(chunk), failed)).encode())
        for name in self.arrays:
            content = self._file(name, chunk).read_bytes()
            digest.update(f"{name} {len(content)} ".encode() + content)
        return int.from_bytes(digest.digest(), "little", signed=True)

    def write(self, chunk: int, answers: Answers) -> None:
        """Write a chunk; when this returns, the chunk is on the disk and done.

        Raises
        ------
        OSError
            If the disk is full or cannot be written: the chunk is then not done.
        """
        reset(self.path, self.grid, chunk)
        slices = self.grid.slices(chunk)
        shape = tuple(s.stop - s.start for s in slices)
        for name in self._of_chunks:
            make_way(self._file(name, chunk))
        # The outcome last: other readers then see a half-written chunk as "not computed".
        numbers: dict[str, Any] = {**answers.numbers, "detail": answers.detail}
        for name, values in [*numbers.items(), ("outcome", answers.outcome)]:
            self.arrays[name][slices] = values.reshape(shape)
        self.checksum[self.grid.place(chunk)] = self._digest(chunk, answers.failed)
        self._sync([self._file(name, chunk) for name in (*self.arrays, "checksum")])
        self.status[self.grid.place(chunk)] = answers.failed
        self._sync([self._file("status", chunk)])

    def read(self, chunk: int, names: tuple[str, ...] | None = None) -> dict[str, Any]:
        """The variables of a chunk as arrays of its shape."""
        slices = self.grid.slices(chunk)
        return {n: self.arrays[n][slices] for n in names or tuple(self.arrays)}

    def part(self, name: str, rows: Mapping[int, int]) -> Float:
        """An output at rows of some axes, along the other axes; NaN in chunks that are not done.

        Parameters
        ----------
        name : str
        rows : mapping of int to int
            Row by number of the axis. Only the chunks of these rows are read.

        Raises
        ------
        InputError
            As for `done`.
        """
        grid, others = self.grid, [a for a in range(len(self.grid.shape)) if a not in rows]
        values: Float = np.full([grid.shape[axis] for axis in others], np.nan)
        place: list[Any] = [slice(None)] * len(grid.shape)
        for axis, row in rows.items():
            place[axis] = row // grid.chunks[axis]
        numbers = np.arange(grid.chunk_count).reshape(grid.chunk_shape)[tuple(place)]
        for chunk in self.done(np.ravel(numbers).tolist()):
            slices = grid.slices(chunk)
            inside: list[Any] = [slice(None)] * len(slices)
            for axis, row in rows.items():
                inside[axis] = row - slices[axis].start
            answers = self.read(chunk, (name,))[name][tuple(inside)]
            values[tuple(slices[axis] for axis in others)] = answers
        return values

    def _file(self, name: str, chunk: int) -> Path:
        return chunk_file(self.path, name, self.grid.place(chunk))

    def _sync(self, files: list[Path]) -> None:
        for file in files:
            to_disk(file)
        # Each folder once, the inner folders first.
        inside = {f for file in files for f in file.relative_to(self.path).parents}
        for folder in sorted(inside - {Path()}, key=lambda f: -len(f.parts)):
            sync_folder(self.path / folder)

    def sweep_orphans(self) -> int:
        """Remove half-written files of killed processes; returns their number."""
        orphans = glob("**/*.partial", root_dir=self.path, recursive=True)
        for name in orphans:
            (self.path / name).unlink(missing_ok=True)
        return len(orphans)

    # Attributes

    def update_attributes(self, **changed: Any) -> None:
        """Replace attributes of the store; the file is on the disk when this returns."""
        self.attributes.update(changed)
        write_root(self.path, self.attributes, self.root.arrays)


def _require_whole(path: Path, root: Root) -> None:
    """Refuse to read a store whose metadata of arrays have changed since they were written."""
    if root.damage:
        raise _damaged(path, root.damage)
    for name, described in root.arrays.items():
        if json_content(path / name / "zarr.json") != described:
            raise _damaged(path, f"{name}/zarr.json")


def _damaged(path: Path, what: str) -> InputError:
    return InputError(
        f"store must be whole, got '{path.name}', whose {what} is missing or damaged; repeat "
        "asperity sweep with its plan and --out, which writes it again"
    )


def _array(group: Any, name: str) -> Any:
    """An array that also writes chunks of fill values; this setting is not stored in its file."""
    return group[name].with_config(ALL_CHUNKS)
