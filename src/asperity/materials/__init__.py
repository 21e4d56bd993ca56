"""Published numbers, one file a paper: ``materials.load("bureau2000")``.

A material file is TOML; `asperity.materials.number` describes its numbers. Loading one loads
pydantic, importing this package does not.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.materials.bibliography import available_citations, citation, cited_works

if TYPE_CHECKING:
    from asperity.materials.number import Number
    from asperity.materials.record import Material

__all__ = [
    "Material",
    "Number",
    "available",
    "available_citations",
    "citation",
    "cited_works",
    "load",
    "load_from",
]


def available() -> tuple[str, ...]:
    """Names of the materials that come with the package."""
    from asperity.materials.record import packaged

    return tuple(sorted(packaged()))


def load_from(folder: Path, name: str) -> Material:
    """Load a material by its name, or by a path relative to the folder.

    Raises
    ------
    InputError
        As of `load`.
    """
    return load(folder / name if name.endswith(".toml") else name)


def load(name: str | PathLike[str]) -> Material:
    """Load a material by name, or a material file by its path.

    Parameters
    ----------
    name : str or path
        One of `available`, or the path of a TOML file: anything that is a path object, ends in
        ``.toml`` or has a folder in it.

    Raises
    ------
    InputError
        If there is no such material, or the file is not a valid material file.
    """
    from asperity.materials.record import load_material

    return load_material(name)


def __getattr__(name: str) -> Any:
    if name == "Material":
        from asperity.materials.record import Material

        return Material
    if name == "Number":
        from asperity.materials.number import Number

        return Number
    raise AttributeError(f"module 'asperity.materials' has no attribute '{name}'")
