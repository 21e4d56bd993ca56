"""The root of a store: attributes with the plan, the versions and the runs.

The attributes are in ``zarr.json`` together with the metadata of all arrays. The empty group
``attributes`` has a second copy without the runs. Each copy has a checksum, the seal, so that
damage to one copy is detected and repaired from the other, from which the runs are lost. A store
with two damaged copies is refused.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.outputs.atomic import replaced
from asperity.outputs.json import json_content
from asperity.study.grid import SweepGrid
from asperity.study.plan import ATTRIBUTES

#: Attribute that marks a store of a sweep; its value is the version of the format.
KIND = "asperity_sweep"
FORMAT = 2
#: Attribute that changes during a run, and the attribute with the seal.
_RUNS, _SEAL = "runs", "seal"


@dataclass(frozen=True)
class Root:
    """The attributes of a store, and the metadata of its arrays.

    Attributes
    ----------
    attributes : dict
    arrays : dict of str to dict
        Content of ``zarr.json`` of each array; empty if the second copy was read.
    damage : str
        The copy that is missing or damaged; "" if both are complete.
    """

    attributes: dict[str, Any]
    arrays: dict[str, Any]
    damage: str

    @property
    def grid(self) -> SweepGrid:
        """The grid of the plan in the store."""
        return SweepGrid(json.loads(self.attributes["plan"]), self.attributes["chunk_shape"])

    @property
    def runs(self) -> list[dict[str, Any]]:
        """The runs so far."""
        return self.attributes.get(_RUNS) or []


def write_root(path: Path, attributes: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    """Write both copies of the attributes; they are on the disk when this returns."""
    kept = {n: v for n, v in attributes.items() if n not in (_RUNS, _SEAL)}
    _write(path / ATTRIBUTES, _group({**kept, _SEAL: _seal(kept, {})}))
    whole = {**kept, _RUNS: attributes.get(_RUNS) or []}
    _write(path, _group({**whole, _SEAL: _seal(whole, arrays)}, arrays))


def _group(attributes: Any, arrays: Any = None) -> dict[str, Any]:
    """Zarr metadata of a group; `arrays` become its consolidated metadata."""
    group = {"attributes": attributes, "zarr_format": 3, "node_type": "group"}
    if arrays is None:
        return group
    gathered = {"kind": "inline", "must_understand": False, "metadata": arrays}
    return {**group, "consolidated_metadata": gathered}


def _write(folder: Path, content: Mapping[str, Any]) -> None:
    put(folder / "zarr.json", json.dumps(content, indent=2).encode())
    sync_folder(folder.parent)


def _seal(attributes: Mapping[str, Any], arrays: Mapping[str, Any]) -> dict[str, Any]:
    content = json.dumps([attributes, arrays], sort_keys=True).encode()
    return {
        "attributes": sorted(attributes),
        "arrays": sorted(arrays),
        "sha256": hashlib.sha256(content).hexdigest(),
    }


def read_root(path: Path) -> Root:
    """The root of a store, from the undamaged copy of the attributes.

    Raises
    ------
    InputError
        If no copy is undamaged: the folder is no store, or its plan is lost.
    """
    first, copy = (_sealed(json_content(at / "zarr.json")) for at in (path, path / ATTRIBUTES))
    if first is not None:
        return Root(*first, damage="" if copy is not None else f"{ATTRIBUTES}/zarr.json")
    if copy is not None:
        return Root(copy[0], {}, damage="zarr.json")
    raise InputError(
        f"store must be the folder of a sweep, got '{path}', which is no such folder, was made by "
        "another version, or has lost its plan; give the folder of --out of asperity sweep, or "
        "choose another folder and solve it there"
    )


def _sealed(content: Any) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Attributes and arrays if they agree with their seal; unsealed attributes may be added."""
    try:
        attributes, seal = content["attributes"], content["attributes"][_SEAL]
        gathered = content["consolidated_metadata"]["metadata"] if seal["arrays"] else {}
        kept = {name: attributes[name] for name in seal["attributes"]}
        # In the order of the file, from which readers take the order of the dimensions.
        arrays = {name: array for name, array in gathered.items() if name in seal["arrays"]}
        whole = (
            content == _group(attributes, gathered if seal["arrays"] else None)
            and _seal(kept, arrays) == seal
            and kept[KIND] == FORMAT
        )
    except (TypeError, KeyError, ValueError, AttributeError, RecursionError):
        return None
    return (attributes, arrays) if whole else None


# Durable writing: a file is complete or absent, whenever the process ends


def sync_folder(path: Path) -> None:
    """Wait until the directory entries of a folder are on the disk; Windows needs no call."""
    if os.name == "posix":
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def put(file: Path, content: bytes) -> None:
    """Write a file by renaming a complete one; it is on the disk when this returns."""
    make_way(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    with replaced(file, file.with_name(f"{file.name}.{uuid.uuid4().hex}.partial")) as fresh:
        fresh.write_bytes(content)
    sync_folder(file.parent)


def make_way(file: Path) -> None:
    """Remove a folder in place of `file`, or a file in place of its folder."""
    if file.is_dir() and not file.is_symlink():
        shutil.rmtree(file)
    folder = file.parent
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        folder.unlink()
