"""BibTeX entries of the sources of laws and materials."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from asperity.errors import require_known
from asperity.parameters.arguments import typed

_ENTRY = re.compile(r"^@\w+\{(?P<key>[^,\s]+),.*?^\}", re.MULTILINE | re.DOTALL)


@typed
def citation(key: str) -> str:
    """Return the BibTeX entry of a source, such as ``"bureau2000"``.

    Raises
    ------
    InputError
        If no source has that key; the message gives the nearest one.
    """
    require_known(key, _entries(), "citation", "be a known source")
    return _entries()[key]


@typed
def cited_works(source: str) -> dict[str, str]:
    """Sources of a law, by citation key.

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
    """Keys of all BibTeX entries."""
    return tuple(sorted(_entries()))


@cache
def _entries() -> Mapping[str, str]:
    text = files("asperity.materials").joinpath("CITATIONS.bib").read_text(encoding="utf-8")
    return {match["key"]: match[0] for match in _ENTRY.finditer(text)}
