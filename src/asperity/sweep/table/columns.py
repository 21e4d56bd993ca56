"""Names of the columns of a table, with suggestions for misspelt ones."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence

from asperity.errors import InputError
from asperity.operating_point import known_parameters
from asperity.parameters import RESULT_COLUMNS

#: Similarity above which a name is a misspelling and not a column of the user's own.
_SIMILAR = 0.75


def check_header(header: Sequence[str], shown: str) -> dict[str, int]:
    """Position of every known column.

    Parameters
    ----------
    header : sequence of str
        As read; blanks around a name are ignored.
    shown : str
        Name of the table in messages.

    Raises
    ------
    InputError
        If a column occurs twice, is named like a result, or looks like a misspelt known one.
    """
    names = [name.strip() for name in header]
    known = {"law", *known_parameters()}
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"{shown} must have each column once, got '{name}' {names.count(name)} times; "
                "remove or rename all but one"
            )
        if name in RESULT_COLUMNS:
            raise InputError(
                f"{shown} must not have a column named like a result, got '{name}'; "
                "rename or remove it"
            )
        meant = None if name in known else _nearest(name, known)
        if meant:
            raise InputError(
                f"{shown} must have columns of known names, got '{name}'; "
                f"did you mean '{meant}'? Rename a column of your own that is not meant so"
            )
    return {name: place for place, name in enumerate(names) if name in known}


def _nearest(name: str, known: set[str]) -> str | None:
    """The known column that resembles an unknown one, None if there is none."""
    # 'V (m/s)' and 'D0 [m]' carry the name before the unit.
    bare = re.split(r"[\s(\[]", name.lower(), maxsplit=1)[0].rstrip("_")
    if not bare:
        return None
    for parameter in known_parameters().values():
        if bare in parameter.meant or bare in map(str.lower, parameter.aliases):
            return parameter.name
    lowered = {k.lower(): k for k in sorted(known)}
    if bare in lowered:
        return lowered[bare]
    begun = [k for k in lowered if k.startswith(bare) and (len(bare) > 2 or len(k) < 4)]
    near = begun or difflib.get_close_matches(bare, lowered, n=1, cutoff=_SIMILAR)
    return lowered[near[0]] if near else None
