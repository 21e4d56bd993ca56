"""HDF5 and everything written in it: plain datasets, tables, NetCDF-4, and MATLAB 7.3."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError
from asperity.recording.readers.named_arrays import group_columns
from asperity.recording.readers.raw import (
    RawColumn,
    RawRecording,
    interval_of,
    one_table,
    refuse_truncated,
)


def load(path: Path, group: str | None = None) -> RawRecording:
    """Columns of an HDF5 file.

    Parameters
    ----------
    path : Path
        The file. One that is cut cannot be opened by the library, and is refused; so is one whose
        data lie in other files, which whoever sent it may not be allowed to read.
    group : str or None
        Where to look, in a file of several recordings.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            _refuse_other_files(file, path)
            matlab = any("MATLAB_class" in item.attrs for item in file.values())
            groups, step = _walk(file, matlab)
    except InputError:
        raise
    # The library raises whatever the damage makes of the data.
    except Exception as refused:
        raise _unreadable(path, refused) from None
    columns, findings = one_table(groups, path, group)
    provenance = {"format": "matlab 7.3" if matlab else "hdf5", "group": group or ""}
    return RawRecording(columns, findings, provenance, step=step)


def _refuse_other_files(file: Any, path: Path) -> None:
    """Refuse links and datasets that lead to other files, before one of them is opened."""
    import h5py

    def outside(name: str, item: Any) -> str | None:
        if isinstance(item, h5py.ExternalLink):
            return name
        stored = isinstance(item, h5py.Dataset) and (item.external or item.is_virtual)
        return name if stored else None

    # The first name that is returned ends the visit; an exception would be lost in the library.
    found = file.visititems_links(outside) or file.visititems(outside)
    if found:
        raise InputError(
            f"recording.path must hold its data itself, got '{path.name}', whose {found!r} lies in "
            "another file; copy the data into one file"
        )


def _unreadable(path: Path, refused: Exception) -> InputError:
    text = str(refused)
    if isinstance(refused, MemoryError):
        return InputError(
            f"recording.path must fit into memory, got '{path.name}', which holds more; cut it"
        )
    if "truncated" in text or "addr overflow" in text or "eof" in text.lower():
        return refuse_truncated(path, "which HDF5 finds cut short")
    return refuse_truncated(path, "which HDF5 cannot open as it is damaged or not whole")


def _walk(file: Any, matlab: bool) -> tuple[dict[str, list[RawColumn]], float | None]:
    """Columns of every group by its path, and an interval if one is stated."""
    import h5py

    groups: dict[str, list[RawColumn]] = {}
    intervals = [interval_of(dict(file.attrs))]

    def visit(node: Any, name: str) -> None:
        arrays: dict[str, Any] = {}
        attributes: dict[str, dict[str, Any]] = {}
        for key, item in node.items():
            if key.startswith("#"):
                # References and the subsystem of MATLAB.
                continue
            if isinstance(item, h5py.Group):
                arrays[key] = _texts_of(item, matlab)
                visit(item, f"{name}/{key}".strip("/"))
            elif item.shape is not None and not _is_bare_dimension(item):
                arrays[key] = _values(file, item, matlab)
                attributes[key] = dict(item.attrs)
                intervals.append(interval_of(attributes[key]))
        intervals.append(interval_of(dict(node.attrs)))
        columns, step = group_columns(arrays, attributes)
        groups[name] = columns
        intervals.append(step)

    visit(file, "")
    return groups, next((step for step in intervals if step is not None), None)


def _is_bare_dimension(item: Any) -> bool:
    """Whether NetCDF has made the dataset for the length of a dimension only."""
    name = item.attrs.get("NAME", b"")
    name = name.decode(errors="replace") if isinstance(name, bytes) else str(name)
    return name.startswith("This is a netCDF dimension but not a netCDF variable")


def _values(file: Any, item: Any, matlab: bool) -> Any:
    import h5py

    if matlab and item.attrs.get("MATLAB_class") == b"char":
        return "".join(map(chr, np.asarray(item[()]).reshape(-1, order="F")))
    if h5py.check_ref_dtype(item.dtype) is not None:
        # Cells of MATLAB are references to their contents.
        return [_values(file, file[r], matlab) for r in np.asarray(item[()]).reshape(-1, order="F")]
    if h5py.check_string_dtype(item.dtype) is not None:
        return np.asarray(item.asstr()[()])
    return item[()]


def _texts_of(group: Any, matlab: bool) -> dict[str, Any]:
    """The texts of a group, which can be the units of the arrays beside it."""
    import h5py

    found = {}
    for key, item in group.items():
        if isinstance(item, h5py.Dataset) and item.shape is not None and item.size < 1000:
            value = _values(group.file, item, matlab)
            if isinstance(value, str):
                found[key] = value
            elif isinstance(value, np.ndarray) and value.dtype.kind in "OU" and value.size == 1:
                found[key] = str(value.reshape(-1)[0])
    return found
