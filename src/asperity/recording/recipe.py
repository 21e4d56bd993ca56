"""Reduction files: how the recordings of one campaign are read, named once in TOML."""

from __future__ import annotations

import os

from pydantic import BaseModel, ConfigDict, ValidationError

from asperity.errors import InputError
from asperity.parameters.mistakes import worded
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
        first = error.errors(include_url=False)[0]
        sentence = worded(first, "recipe", {"": ReadingRecipe}, prefix="recipe.")[0]
        raise InputError(f"{sentence} (in '{file.name}')") from None
