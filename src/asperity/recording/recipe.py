"""Reduction files: how the recordings of one campaign are read, named once in TOML."""

from __future__ import annotations

import os
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from asperity.errors import InputError, closest
from asperity.parameters.toml_file import toml_content


class ReadingRecipe(BaseModel):
    """How the recordings of a campaign are read: arguments of `asperity.recording.read`.

    Attributes
    ----------
    title : str
    columns : dict of str to str or int
        Columns by role.
    units : dict of str to str
        Units by column.
    channels : dict of str to str
        Expressions of derived channels, in their order.
    rate, group, delimiter, decimal, format : str, optional
        As of `asperity.recording.read`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str = ""
    columns: dict[str, str | int] = {}
    units: dict[str, str] = {}
    channels: dict[str, str] = {}
    rate: float | str | None = None
    group: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    format: str | None = None


def load_recipe(path: str | os.PathLike[str]) -> ReadingRecipe:
    """Read a reduction file.

    Parameters
    ----------
    path : str or path
        TOML with the fields of `ReadingRecipe`.

    Raises
    ------
    InputError
        If the file cannot be read or a field breaks its rule.
    """
    file, content = toml_content(path, "recipe")
    try:
        return ReadingRecipe.model_validate(content)
    except ValidationError as error:
        raise InputError(_sentence(error.errors(include_url=False)[0], file.name)) from None


def _sentence(mistake: Any, name: str) -> str:
    place = ".".join(map(str, mistake["loc"][:2]))
    if mistake["type"] == "extra_forbidden":
        advice = closest(str(mistake["loc"][-1]), ReadingRecipe.model_fields)
        return f"recipe.{place} must be a known field, got it in '{name}'; {advice}"
    rule = " ".join(mistake["msg"].split()).removeprefix("Input should be ")
    return f"recipe.{place} must be {rule}, got {mistake['input']!r} in '{name}'; correct the value"
