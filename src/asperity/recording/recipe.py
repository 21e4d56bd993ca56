"""Reduction files: how the recordings of one campaign are read, named once in TOML."""

from __future__ import annotations

import os

from asperity.questions.recording import ReadingRecipe

__all__ = ["ReadingRecipe", "load_recipe"]


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
    return ReadingRecipe.from_file(path)
