"""HDF5 and everything written in it: plain datasets, tables, NetCDF-4, and MATLAB 7.3."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError
from asperity.recording.readers.raw import (
    Group,
    RawRecording,
    as_texts,
    beginning,
    group_of,
    one_recording,
    unusable,
)

_SIGNATURE = b"\x89HDF\r\n\x1a\n"

#: Attribute of the datasets of a group that are its recording; without one, all are.
_ROLE = "recording_role"
#: Attributes of NetCDF: numbers that stand for a missing value, and how the others are packed.
_FILLS = ("_FillValue", "missing_value")
_PACKING = (*_FILLS, "scale_factor", "add_offset")
#: Most values of a text that can be the unit of an array.
_SHORT = 1000
#: Bytes of an array that are always read, and bytes that a byte of a file can hold: DEFLATE packs
#: by 1,032 at most.
_MUCH, _PACKED = 1 << 30, 1032


def is_format(path: Path) -> bool:
    """Recognise the signature, which may follow a user block."""
    head = beginning(path)
    # A user block has 512 bytes times a power of two; MATLAB writes 512 bytes.
    signed = any(head[at : at + 8] == _SIGNATURE for at in (0, 512, 1024, 2048))
    return signed or head.startswith(b"MATLAB 7.3 MAT-file")


def read(path: Path, *, group: str | None = None) -> RawRecording:
    """Columns of an HDF5 file.

    Parameters
    ----------
    path : Path
        One whose data lie in other files is refused, because the sender of the file may not be
        allowed to read these.
    group : str or None
        Where to look, in a file of several recordings.
    """
    import h5py

    with h5py.File(path, "r") as file:
        nodes = _groups(file, path)
        matlab = any(item and "MATLAB_class" in item.attrs for item in file.values())
        groups = {name: _group(node, path, matlab) for name, node in nodes.items()}
        chosen = file.get(group) if group else None
        if chosen is not None:
            # A group may have several names.
            group = next((name for name, node in nodes.items() if node == chosen), group)
    provenance = {"format": "matlab 7.3" if matlab else "hdf5"}
    return one_recording(groups, path, group, provenance)


def _groups(file: Any, path: Path) -> dict[str, Any]:
    """Every group by its path, without those of MATLAB's references."""
    import h5py

    groups = {"": file["/"]}

    def add(name: str, item: Any) -> None:
        if isinstance(item, h5py.Group) and not name.startswith("#"):
            groups[name] = item

    # Each object comes once, and only links within the file are followed.
    file.visititems(add)
    for name, node in groups.items():
        for key in node:
            if isinstance(node.get(key, getlink=True), h5py.ExternalLink):
                raise _elsewhere(path, f"{name}/{key}")
    return groups


def _elsewhere(path: Path, name: str) -> InputError:
    why = f"whose '{name.strip('/')}' lies in another file"
    return unusable(path, why, "hold its data itself", "copy the data into one file")


def _group(node: Any, path: Path, matlab: bool) -> Group:
    """Columns of a group, and the clocks that it and its datasets state."""
    import h5py

    arrays: dict[str, Any] = {}
    attributes: dict[str, dict[str, Any]] = {}
    for key, item in node.items():
        if isinstance(item, h5py.Group):
            # Its texts can be the units of the arrays next to it.
            texts = {k: v for k, v in item.items() if _holds_values(v) and v.size < _SHORT}
            arrays[key] = {k: _value(v, path, matlab) for k, v in texts.items()}
        elif _holds_values(item):
            attributes[key] = _without_origin(dict(item.attrs))
            arrays[key] = _unpacked(_value(item, path, matlab), attributes[key])
    # A file of a computed motion marks what an instrument would have recorded of it.
    recorded = [key for key, about in attributes.items() if _ROLE in about]
    arrays = {key: arrays[key] for key in recorded} or arrays
    return group_of(arrays, attributes, dict(node.attrs))


def _without_origin(attributes: dict[str, Any]) -> dict[str, Any]:
    """Attributes with the unit of times such as ``"minutes since 2024-05-17"`` of NetCDF alone."""
    unit = (as_texts(attributes.get("units")) or [""])[0]
    plain, since, _ = unit.partition(" since ")
    return {**attributes, "units": plain} if since else attributes


def _unpacked(values: Any, attributes: Mapping[str, Any]) -> Any:
    """Numbers of a dataset that is packed as in NetCDF, NaN where it has the fill value."""
    about = {key: np.ravel(attributes[key]) for key in _PACKING if key in attributes}
    about = {key: number for key, number in about.items() if number.dtype.kind in "iuf"}
    if not about or not isinstance(values, np.ndarray) or values.dtype.kind not in "iuf":
        return values
    missing = np.isin(values, np.concatenate([about.pop(key, np.empty(0)) for key in _FILLS]))
    unpacked = values.astype(np.float64)
    unpacked = unpacked * about.get("scale_factor", 1.0) + about.get("add_offset", 0.0)
    unpacked[missing] = np.nan
    return unpacked


def _holds_values(item: Any) -> bool:
    """Whether it is a dataset with values, which a dimension of NetCDF may have none of."""
    import h5py

    if not isinstance(item, h5py.Dataset) or item.shape is None:
        return False
    return "This is a netCDF dimension but not" not in str(item.attrs.get("NAME", ""))


def _value(item: Any, path: Path, matlab: bool) -> Any:
    """Values of a dataset: an array, a text, or a list of the contents of MATLAB's cells."""
    import h5py

    if item.external or item.is_virtual:
        raise _elsewhere(path, item.name)
    if item.nbytes > max(_MUCH, _PACKED * path.stat().st_size):
        # Declared values that were never written are fill values, and would be created here.
        why = f"whose '{item.name.strip('/')}' has {item.size} values"
        raise unusable(path, why, "hold what it declares", "remove that dataset")
    if matlab and item.attrs.get("MATLAB_class") == b"char":
        return "".join(map(chr, np.asarray(item[()]).reshape(-1, order="F")))
    if h5py.check_ref_dtype(item.dtype) is not None:
        references = np.asarray(item[()]).reshape(-1, order="F")
        cells: list[Any] = [item.file[r] if r else None for r in references]
        known = [_holds_values(c) and h5py.check_ref_dtype(c.dtype) is None for c in cells]
        return [_value(c, path, matlab) if k else None for c, k in zip(cells, known, strict=True)]
    if h5py.check_string_dtype(item.dtype) is not None:
        return np.asarray(item.asstr()[()])
    return item[()]
