"""Protocol files."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.study.operating_point import all_quantities
from asperity.study.protocol.mistakes import ProtocolError
from asperity.study.protocol.protocol import Protocol
from asperity.units import KINDS

#: Kinds of what stands in the tables of a file: there, a quantity carries its unit.
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
        An `InputError` that tells all mistakes, with file, step and a valid example.
    """
    file = Path(path)
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise InputError(
            f"protocol must be a file, got '{path}'; there is none, correct the path"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(
            f"protocol must be a readable TOML file, got '{path}' ({why}); give another"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"protocol must be valid TOML, got '{path}' ({' '.join(str(error).split())}); "
            "correct that line"
        ) from None
    mistakes = list(_without_unit(content))
    try:
        protocol = Protocol(**{"folder": file.parent, **content})
    except ProtocolError as error:
        raise ProtocolError((*mistakes, *error.mistakes), str(path)) from None
    if mistakes:
        raise ProtocolError(mistakes, str(path))
    return protocol


def _without_unit(content: Mapping[str, Any]) -> list[str]:
    """Bare numbers where a unit is needed: a file says what it means."""
    kinds = {**_KINDS, "parameters": {n: q.kind for n, q in all_quantities().items()}}
    found = []
    for table, names in kinds.items():
        values = content.get(table)
        for name, value in values.items() if isinstance(values, Mapping) else ():
            unit = KINDS[names[name]].si if name in names else ""
            if unit and isinstance(value, int | float) and not isinstance(value, bool):
                example = KINDS[names[name]].example
                found.append(
                    f"{table}.{name} must carry a unit, got {value!r}; write it like '{example}'"
                )
    return found
