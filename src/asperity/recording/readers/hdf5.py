"""HDF5 and everything written in it: plain datasets, tables, NetCDF-4, and MATLAB 7.3."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from asperity.errors import InputError
from asperity.recording.readers.raw import (
    RawColumn,
    RawRecording,
    beginning,
    group_columns,
    interval_of,
    one_table,
)

_SIGNATURE = b"\x89HDF\r\n\x1a\n"

#: Attribute of the datasets of a group that are its recording; without one, all are.
_ROLE = "recording_role"

#: Place of a group: the place of its parent, and its name; None for the root.
_Place = tuple[Any, str] | None


def is_format(path: Path) -> bool:
    """Recognise the signature, which may follow a user block."""
    head = beginning(path)
    # A user block has 512 bytes times a power of two; MATLAB writes 512 bytes.
    return any(head[at : at + 8] == _SIGNATURE for at in (0, 512, 1024, 2048)) or head.startswith(
        b"MATLAB 7.3 MAT-file"
    )


def read(path: Path, *, group: str | None = None) -> RawRecording:
    """Columns of an HDF5 file.

    Parameters
    ----------
    path : Path
        One that is cut cannot be opened by the library. One whose data lie in other files is
        refused, because the sender of the file may not be allowed to read the other files.
    group : str or None
        Where to look, in a file of several recordings.
    """
    import h5py

    with h5py.File(path, "r") as file:
        _refuse_links_out(file, path)
        matlab = any(item and "MATLAB_class" in item.attrs for item in file.values())
        contents = _contents(file, path, matlab)
        if group is not None:
            chosen = file.get(group.strip("/") or "/")
            if isinstance(chosen, h5py.Group):
                group = contents.names.get(_address(chosen), group)
    columns, findings = one_table(contents.columns, path, group)
    provenance = {"format": "matlab 7.3" if matlab else "hdf5", "group": group or ""}
    return RawRecording(columns, findings, provenance, step=contents.step)


def _refuse_links_out(file: Any, path: Path) -> None:
    """Refuse links to other files before a link is followed.

    Soft links are ignored, because their targets in this file also have a hard link.
    """
    import h5py

    def is_hard(node: Any, key: str) -> bool:
        return isinstance(node.get(key, getlink=True), h5py.HardLink)

    for place, node in _groups(file, is_hard):
        for key in node:
            if isinstance(node.get(key, getlink=True), h5py.ExternalLink):
                raise _elsewhere(path, _path((place, key)))


def _elsewhere(path: Path, name: str) -> InputError:
    return InputError(
        "recording.path",
        "hold its data itself",
        f"'{path.name}', whose {name!r} lies in another file",
        "copy the data into one file",
    )


def _groups(file: Any, followed: Callable[[Any, str], bool]) -> list[tuple[_Place, Any]]:
    """Every group once, with the first place that leads to it; inner groups first.

    A group may contain itself and be very deep. Therefore there is no recursion, and each group is
    opened from its parent.

    Parameters
    ----------
    file : h5py.File
    followed : callable
        Whether to follow the link of a group with a name.
    """
    import h5py

    root = file["/"]
    left: list[tuple[_Place, Any]] = [(None, root)]
    known, groups = {_address(root)}, []
    while left:
        place, node = left.pop()
        groups.append((place, node))
        for key in node:
            item = node.get(key) if followed(node, key) else None
            if isinstance(item, h5py.Group) and _address(item) not in known:
                known.add(_address(item))
                left.append(((place, key), item))
    return groups[::-1]


def _path(place: _Place) -> str:
    """The path of a group, without a slash at its ends; empty for the root."""
    keys = []
    while place is not None:
        place, key = place
        keys.append(key)
    return "/".join(reversed(keys))


def _address(item: Any) -> int:
    """Address of an object in the file, the same for all of its names."""
    import h5py

    address: int = h5py.h5o.get_info(item.id).addr
    return address


class _Contents(NamedTuple):
    """Columns of the groups, the stated sampling interval if any, and names of the groups.

    A group has the name under which it is in `columns` by each of its names.
    """

    columns: dict[str, list[RawColumn]]
    step: float | None
    names: dict[int, str]


def _contents(file: Any, path: Path, matlab: bool) -> _Contents:
    import h5py

    reader = _Reader(file, path, matlab)
    groups: dict[str, list[RawColumn]] = {}
    names: dict[int, str] = {}
    intervals = [interval_of(dict(file.attrs))]
    for place, node in _groups(file, lambda _, key: not _is_of_matlab(key)):
        arrays: dict[str, Any] = {}
        attributes: dict[str, dict[str, Any]] = {}
        for key, item in node.items():
            if _is_of_matlab(key):
                continue
            if isinstance(item, h5py.Group):
                arrays[key] = reader.texts(item)
            elif _holds_values(item) and not _is_bare_dimension(item):
                arrays[key] = reader.values(item)
                attributes[key] = dict(item.attrs)
                intervals.append(interval_of(attributes[key]))
        intervals.append(interval_of(dict(node.attrs)))
        # A file of a computed motion marks what an instrument would have recorded of it.
        recorded = [key for key, about in attributes.items() if _ROLE in about]
        arrays = {key: arrays[key] for key in recorded} or arrays
        columns, step = group_columns(arrays, attributes)
        if columns:
            groups[_path(place)] = columns
            names[_address(node)] = _path(place)
        intervals.append(step)
    step = next((step for step in intervals if step is not None), None)
    return _Contents(groups, step, names)


def _holds_values(item: Any) -> bool:
    """Whether an item of a group is a dataset that is not empty by its type."""
    import h5py

    return isinstance(item, h5py.Dataset) and item.shape is not None


def _is_bare_dimension(item: Any) -> bool:
    """Whether the dataset is a NetCDF dimension without coordinate values."""
    name = item.attrs.get("NAME", b"")
    name = name.decode(errors="replace") if isinstance(name, bytes) else str(name)
    return name.startswith("This is a netCDF dimension but not a netCDF variable")


def _is_one_text(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "OU" and value.size == 1


def _is_of_matlab(key: str) -> bool:
    """Whether a name is that of MATLAB's references and subsystem."""
    return key.startswith("#")


class _Reader:
    """Reads datasets; one with several names is read once.

    Parameters
    ----------
    file : h5py.File
    path : Path
        For messages.
    matlab : bool
        Whether MATLAB has written the file.
    """

    def __init__(self, file: Any, path: Path, matlab: bool) -> None:
        self._file, self._path, self._matlab = file, path, matlab
        self._shared: dict[int, Any] = {}
        self._texts: dict[int, dict[str, Any]] = {}

    def values(self, item: Any) -> Any:
        """Values of a dataset: an array, a text, or a list of the contents of MATLAB's cells."""
        import h5py

        info = h5py.h5o.get_info(item.id)
        if info.rc <= 1:
            return self._values(item)
        if info.addr not in self._shared:
            self._shared[info.addr] = self._values(item)
        return self._shared[info.addr]

    def _values(self, item: Any) -> Any:
        import h5py

        if item.external or item.is_virtual:
            raise _elsewhere(self._path, item.name.strip("/"))
        if self._matlab and item.attrs.get("MATLAB_class") == b"char":
            return "".join(map(chr, np.asarray(item[()]).reshape(-1, order="F")))
        if h5py.check_ref_dtype(item.dtype) is not None:
            return self._cells(np.asarray(item[()]).reshape(-1, order="F"))
        if h5py.check_string_dtype(item.dtype) is not None:
            return np.asarray(item.asstr()[()])
        return item[()]

    def _cells(self, references: Any) -> list[Any]:
        """Contents of MATLAB's cells, each read once; None for cells that contain themselves."""
        import h5py

        contents: dict[int, Any] = {}
        places = []
        for reference in references:
            item: Any = self._file[reference] if reference else None
            if not _holds_values(item) or h5py.check_ref_dtype(item.dtype) is not None:
                places.append(-1)
                continue
            places.append(_address(item))
            if places[-1] not in contents:
                contents[places[-1]] = self.values(item)
        return [contents.get(place) for place in places]

    def texts(self, group: Any) -> dict[str, Any]:
        """The texts of a group, which can be the units of the arrays next to it."""
        address = _address(group)
        if address not in self._texts:
            texts = self._texts[address] = {}
            for key, item in group.items():
                if _holds_values(item) and item.size < 1000:
                    value = self.values(item)
                    if isinstance(value, str):
                        texts[key] = value
                    elif _is_one_text(value):
                        texts[key] = str(value.reshape(-1)[0])
        return self._texts[address]
