"""Protocol files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from asperity.laws import registered
from asperity.operating_point import known_parameters
from asperity.parameters.arguments import shown
from asperity.parameters.toml_file import toml_content
from asperity.protocol.protocol import Protocol, ProtocolError
from asperity.units import KINDS

#: Kinds of the quantities in the tables of a file, where each carries its unit.
_KINDS = {
    "start": {"velocity": "velocity", "load": "force"},
    "solver": {"sampling": "frequency"},
}


def load_protocol(path: str | os.PathLike[str]) -> Protocol:
    """Read a protocol from a TOML file.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    ProtocolError
        An `InputError` that lists all mistakes, with file, step and a valid example.
    """
    file, content = toml_content(path, "protocol")
    return protocol_of({"folder": file.parent, **content}, str(path))


def protocol_of(content: Mapping[str, Any], source: str = "") -> Protocol:
    """The protocol that the content of a file describes, with the rules of a file.

    Parameters
    ----------
    content : mapping
    source : str
        The file, for messages.

    Raises
    ------
    ProtocolError
        As `load_protocol`.
    """
    mistakes = list(_without_unit(content))
    try:
        protocol = Protocol(**content)
    except ProtocolError as error:
        raise ProtocolError((*mistakes, *error.mistakes), source) from None
    if mistakes:
        raise ProtocolError(mistakes, source)
    return protocol


def _law(content: Mapping[str, Any]) -> str | None:
    """Name of the law, if the file gives one that is known."""
    name = content.get("law")
    return name if isinstance(name, str) and name in registered() else None


def _without_unit(content: Mapping[str, Any]) -> list[str]:
    """Numbers without the unit that a file must give."""
    kinds = {
        **_KINDS,
        "parameters": {n: q.kind for n, q in known_parameters(_law(content)).items()},
    }
    mistakes = []
    for table, names in kinds.items():
        values = content.get(table)
        for name, value in values.items() if isinstance(values, Mapping) else ():
            unit = KINDS[names[name]].si if name in names else ""
            if unit and isinstance(value, int | float) and not isinstance(value, bool):
                example = KINDS[names[name]].example
                mistakes.append(
                    f"{table}.{name} must carry a unit, got {shown(value)}; "
                    f"write it like '{example}'"
                )
    return mistakes
