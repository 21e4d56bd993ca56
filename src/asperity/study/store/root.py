"""The attributes of a store: what it was made for, by what, and who has run it.

They are in ``zarr.json``, together with the descriptions of all arrays, and once more, without the
runs, in those of the empty group ``attributes``. Both carry a seal, so that a store is never taken
for that of another plan: what neither can tell is refused.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.outputs.json import json_content
from asperity.study.grid import SweepGrid
from asperity.study.record import ATTRIBUTES
from asperity.study.store import durable

#: Attribute that says what kind of group this is, and the format.
KIND = "asperity_sweep"
FORMAT = 2
#: Attributes that change during a run, and what seals the others.
_RUNS, _SEAL = "runs", "seal"
#: What a run says of itself, when it begins and when it ends.
_BEGUN = dict.fromkeys(("started", "host", "workers", "asperity"), str)
_ENDED = {"points_solved": int, "seconds": int | float}


@dataclass(frozen=True)
class Root:
    """The attributes of a store, and the descriptions of its arrays.

    Attributes
    ----------
    attributes : dict
    arrays : dict of str to dict
        What ``zarr.json`` of each array holds; empty where the second copy was read.
    damage : str
        Which of the two files is missing or damaged; "" for none.
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
        runs = self.attributes.get(_RUNS)
        return [run for run in runs if _is_run(run)] if isinstance(runs, list) else []


def _is_run(run: Any) -> bool:
    """Whether a record can be shown: runs are not sealed."""
    if not isinstance(run, dict):
        return False
    try:
        json.dumps(run, ensure_ascii=False).encode()
    except UnicodeEncodeError:  # half of a character
        return False
    needed = _BEGUN | (_ENDED if run.get("ended") else {})
    return all(isinstance(run.get(name), kind) for name, kind in needed.items())


def write_root(path: Path, attributes: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    """Write both copies of the attributes; they are on the disk when this returns."""
    kept = {n: v for n, v in attributes.items() if n not in (_RUNS, _SEAL)}
    _write(path / ATTRIBUTES, _group({**kept, _SEAL: _seal(kept, {})}))
    whole = {**kept, _SEAL: _seal(kept, arrays), _RUNS: attributes.get(_RUNS, [])}
    _write(path, _group(whole, arrays))


def _group(attributes: Any, arrays: Any = None) -> dict[str, Any]:
    """A group as Zarr describes it; with `arrays` consolidated, so that readers open them by it."""
    group = {"attributes": attributes, "zarr_format": 3, "node_type": "group"}
    if arrays is None:
        return group
    gathered = {"kind": "inline", "must_understand": False, "metadata": arrays}
    return {**group, "consolidated_metadata": gathered}


def _write(folder: Path, content: Mapping[str, Any]) -> None:
    file = folder / "zarr.json"
    durable.put(file, json.dumps(content, indent=2).encode())
    durable.sync_file(file)
    durable.sync_folder(folder)
    durable.sync_folder(folder.parent)


def _seal(attributes: Mapping[str, Any], arrays: Mapping[str, Any]) -> dict[str, Any]:
    content = json.dumps([attributes, arrays], sort_keys=True).encode()
    return {
        "attributes": sorted(attributes),
        "arrays": sorted(arrays),
        "sha256": hashlib.sha256(content).hexdigest(),
    }


def read_root(path: Path) -> Root:
    """The attributes of a store, from whichever copy is whole.

    Raises
    ------
    InputError
        If none is: then it is no store, or one whose plan is lost.
    """
    content, second = (json_content(folder / "zarr.json") for folder in (path, path / ATTRIBUTES))
    first, copy = _sealed(content), _sealed(second)
    if first is not None:
        return Root(*first, damage="" if copy is not None else f"{ATTRIBUTES}/zarr.json")
    if copy is not None:
        attributes = content.get("attributes") if isinstance(content, dict) else None
        runs = attributes.get(_RUNS) if isinstance(attributes, dict) else None
        return Root({**copy[0], _RUNS: runs}, {}, damage="zarr.json")
    raise InputError(
        f"store must be the folder of a sweep, got '{path}', which is none, was made by another "
        "version, or has lost its plan; give what --out of asperity sweep named, or choose "
        "another folder and solve it there"
    )


def _sealed(content: Any) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Attributes and arrays that are as they were sealed; others may have been added to them."""
    try:
        attributes, seal = content["attributes"], content["attributes"][_SEAL]
        gathered = content["consolidated_metadata"]["metadata"] if seal["arrays"] else {}
        kept = {name: attributes[name] for name in seal["attributes"]}
        # In the order of the file, which is that of the dimensions for readers.
        arrays = {name: array for name, array in gathered.items() if name in seal["arrays"]}
        whole = (
            content == _group(attributes, gathered if seal["arrays"] else None)
            and _seal(kept, arrays) == seal
            and kept[KIND] == FORMAT
        )
    except (TypeError, KeyError, ValueError, AttributeError, RecursionError):
        return None
    return (attributes, arrays) if whole else None
