"""Material files to `Material`; what is wrong with one is one sentence.

`CITATIONS.bib` has the works that laws and materials name as their source.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from asperity.errors import InputError, closest
from asperity.materials.number import Number
from asperity.materials.record import Material
from asperity.parameters.arguments import file_path
from asperity.parameters.mistakes import worded
from asperity.parameters.toml_file import parsed_toml, toml_content

_ENTRY = re.compile(r"^@\w+\{(?P<key>[^,\s]+),.*?^\}", re.MULTILINE | re.DOTALL)


def citation(key: str) -> str:
    """Return the BibTeX entry of a source, such as ``"bureau2000"``.

    Raises
    ------
    InputError
        If no source has that key; the message gives the nearest one.
    """
    entries = _entries()
    try:
        return entries[key]
    except KeyError:
        raise InputError(
            f"citation must be a known source, got '{key}'; {closest(key, entries)}"
        ) from None


def cited_works(source: str) -> dict[str, str]:
    """Works that a law names as its source, by citation key.

    Parameters
    ----------
    source : str
        Keys with commas between them, or the reference as a text.

    Returns
    -------
    dict of str to str
        BibTeX entries. What has none, as the source of a law from outside the package, stands for
        itself.
    """
    entries = _entries()
    keys = [key.strip() for key in source.split(",") if key.strip()]
    if any(" " in key for key in keys):
        keys = [source.strip()]
    return {key: entries.get(key, key) for key in keys}


def available_citations() -> tuple[str, ...]:
    """Keys that `citation` knows."""
    return tuple(sorted(_entries()))


@cache
def _entries() -> Mapping[str, str]:
    text = files("asperity.materials").joinpath("CITATIONS.bib").read_text(encoding="utf-8")
    return {match["key"]: match[0] for match in _ENTRY.finditer(text)}


@cache
def packaged() -> Mapping[str, Any]:
    """The material files that come with the package, by name."""
    folder = files("asperity.materials")
    return {f.name.removesuffix(".toml"): f for f in folder.iterdir() if f.name.endswith(".toml")}


def load_material(name: str | PathLike[str]) -> Material:
    """See `asperity.materials.load`."""
    text = fspath(file_path(name, "material"))
    if not isinstance(name, str) or text.endswith(".toml") or Path(text).name != text:
        if not os.path.isfile(text):
            raise InputError(
                f"material.file must be a readable TOML file, got '{text}', which is none; give "
                "the path of a material file"
            )
        file, content = toml_content(text, "material.file")
        return _material(content, file.stem, text)
    try:
        resource = packaged()[text]
    except KeyError:
        raise InputError(
            f"material must be a known material or the path of a .toml file, got '{text}'; "
            f"{closest(text, packaged())}"
        ) from None
    content = parsed_toml(resource.read_text(encoding="utf-8"), "material.file", f"'{text}'")
    return _material(content, text, text)


def _material(content: dict[str, Any], name: str, shown: str) -> Material:
    try:
        return Material.model_validate({"name": name} | content)
    except ValidationError as error:
        # The first mistake, and how many more there are.
        mistakes = error.errors(include_url=False)
        sentence = worded(mistakes[0], "material", {"": Material, "numbers": Number})[0]
        count = f", the first of {len(mistakes)} mistakes" if len(mistakes) > 1 else ""
        raise InputError(f"{sentence} (in '{shown}'{count})") from None
