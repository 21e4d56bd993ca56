"""Protocol files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Any

from asperity.laws import registered
from asperity.operating_point import known_parameters
from asperity.parameters.toml_file import toml_content
from asperity.protocol.protocol import Protocol, ProtocolError
from asperity.questions.record import without_unit

#: Kinds of the quantities in the tables of a file, where each carries its unit.
_KINDS = {
    "start": {"velocity": "velocity", "load": "force"},
    "solver": {"sampling": "frequency"},
    "track": {"length": "length", "origin": "length"},
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
    mistakes = without_unit(_numbers(content))
    try:
        protocol = Protocol(**content)
    except ProtocolError as error:
        raise ProtocolError((*mistakes, *error.errors), source) from None
    if mistakes:
        raise ProtocolError(mistakes, source)
    return protocol


def _numbers(content: Mapping[str, Any]) -> Iterator[tuple[str, str, Any]]:
    """Place, kind and value of the quantities of a file."""
    law = content.get("law")
    known = known_parameters(law if isinstance(law, str) and law in registered() else None)
    kinds = {**_KINDS, "parameters": {name: p.kind for name, p in known.items()}}
    for table, names in kinds.items():
        values = content.get(table)
        for name, value in values.items() if isinstance(values, Mapping) else ():
            if name in names:
                yield f"{table}.{name}", names[name], value
