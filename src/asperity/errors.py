"""The one error a user's input can cause.

Every message is a single sentence of the form
``<object>.<field> must <rule>, got <value> <unit>; <what to do>``.
A solve that fails is not an error: it is reported in the result.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """Input that cannot be used; the message names field, rule, value and the way out."""


def closest(name: str, known: Iterable[str]) -> str:
    """Return ``did you mean 'x'?`` for the nearest known name, or the list of known names.

    Parameters
    ----------
    name : str
        What the user wrote.
    known : iterable of str
        The names that would have been right.
    """
    known = sorted(known)
    lowered = {k.lower(): k for k in known}
    near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.5)
    if near:
        return f"did you mean '{lowered[near[0]]}'?"
    return "choose one of " + ", ".join(known)
