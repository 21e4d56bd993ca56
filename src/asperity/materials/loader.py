"""Loading of material files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from asperity.errors import InputError, closest
from asperity.materials.record import Material
from asperity.parameters.arguments import file_path
from asperity.parameters.toml_file import parsed_toml, toml_content


@cache
def packaged() -> Mapping[str, Any]:
    """The material files that come with the package, by name."""
    folder = files("asperity.materials")
    return {f.name.removesuffix(".toml"): f for f in folder.iterdir() if f.name.endswith(".toml")}


@cache
def _packaged_content(name: str) -> dict[str, Any]:
    """The parsed file of a material that comes with the package; parsing takes milliseconds."""
    text = packaged()[name].read_text(encoding="utf-8")
    return parsed_toml(text, "material", f"'{name}'")


def load_material(name: str | PathLike[str]) -> Material:
    """See `asperity.materials.load`."""
    text = fspath(file_path(name, "material"))
    if not isinstance(name, str) or text.endswith(".toml") or Path(text).name != text:
        file, content = toml_content(text, "material")
        return Material.of_content({"name": file.stem, **content}, text)
    if text not in packaged():
        rule = "be a known material or the path of a .toml file"
        raise InputError("material", rule, f"'{text}'", closest(text, packaged()))
    return Material.of_content({"name": text, **_packaged_content(text)}, text)
