"""Material files to `Material`, and what is wrong with one in one sentence."""

from __future__ import annotations

import os
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
from asperity.parameters.toml_file import parsed_toml, toml_content


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
        raise InputError(_sentence(error, shown)) from None


def _sentence(error: ValidationError, shown: str) -> str:
    """The first mistake, how many more there are, and the way out of the first."""
    mistakes = error.errors(include_url=False)
    count = f", the first of {len(mistakes)} mistakes" if len(mistakes) > 1 else ""
    return f"{_told(mistakes[0])} (in '{shown}'{count})"


def _told(mistake: Any) -> str:
    """One mistake as ``<field> must <rule>, got <value>; <what to do>``."""
    own = mistake.get("ctx", {}).get("error")
    if isinstance(own, InputError):
        return str(own)
    field = ".".join(str(part) for part in mistake["loc"]) or "material"
    if mistake["type"] == "value_error":
        # Raised by the models' own validators, which leave only the field to be named.
        return f"{field} must {own}"
    rule, advice = _rule(mistake)
    return f"{field} must {rule}, got {_value(mistake)}; {advice}"


def _rule(mistake: Any) -> tuple[str, str]:
    """What the field must do, and what to do about it, where pydantic found the mistake."""
    if mistake["type"] == "extra_forbidden":
        model = Number if "numbers" in mistake["loc"] else Material
        wrong = str(mistake["loc"][-1])
        return "be a known field", closest(wrong, model.model_fields)
    if mistake["type"] == "missing":
        return "be given", "add the field"
    rule = _one_line(mistake["msg"]).removeprefix("Input should be ")
    return f"be {rule}", "correct the value"


def _value(mistake: Any) -> str:
    if mistake["type"] == "missing":
        return "nothing"
    value = mistake["input"]
    return f"a table of {len(value)} fields" if isinstance(value, Mapping) else repr(value)


def _one_line(text: str) -> str:
    return " ".join(text.split())
