"""The error that a user's input can cause.

Every message is a single sentence of the form
``<object>.<field> must <rule>, got <value> <unit>; <what to do>``.
A solve that fails is not an error: it is reported in the result.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import ClassVar


class InputError(ValueError):
    """Input that cannot be used; the message names field, rule, value and the way out."""


class ConstantLoadError(InputError):
    """A recording that is to have a modulated load has a constant one."""


class MistakesError(InputError):
    """Several mistakes in one file or object, in one message.

    Parameters
    ----------
    mistakes : sequence of str
        One sentence each.
    source : str
        The file, if there is one.

    Attributes
    ----------
    mistakes : tuple of str
    """

    #: What has the mistakes, for the message.
    subject: ClassVar[str]

    def __init__(self, mistakes: Sequence[str], source: str = "") -> None:
        self.mistakes = tuple(mistakes)
        where = f" (in '{source}')" if source else ""
        if len(self.mistakes) == 1:
            super().__init__(f"{self.mistakes[0]}{where}")
            return
        numbered = "; ".join(f"({i}) {m}" for i, m in enumerate(self.mistakes, start=1))
        super().__init__(
            f"{self.subject} must be free of mistakes, got {len(self.mistakes)}{where}: {numbered}"
        )


def closest(name: str, known: Iterable[str]) -> str:
    """Return ``did you mean 'x'?`` for the nearest known name, or the list of known names.

    Parameters
    ----------
    name : str
        What the user wrote.
    known : iterable of str
        The names that would have been right; of a long list, the first ones are shown.
    """
    known = sorted(known)
    lowered = {k.lower(): k for k in known}
    near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.5)
    if near:
        return f"did you mean '{lowered[near[0]]}'?"
    return "choose one of " + listed(known)


def listed(names: Iterable[str], joint: str = ", ", most: int = 40) -> str:
    """Names in one text, the first `most` of them if there are more.

    Parameters
    ----------
    names : iterable of str
    joint : str
        What stands between two names.
    most : int
    """
    every = list(names)
    rest = len(every) - most
    return joint.join(every[:most]) + (f" and {rest} more" if rest > 0 else "")


def printable(text: str, most: int = 600) -> str:
    """A text as one line that a terminal can show: control characters escaped, its end cut.

    Parameters
    ----------
    text : str
        It may come from a damaged file.
    most : int
        Characters.
    """
    plain = text
    if not text.isprintable():
        plain = "".join(
            c
            if c.isprintable()
            else " "
            if c.isspace()
            else c.encode("unicode_escape").decode("ascii")
            for c in text[: 2 * most]
        )
    return plain if len(plain) <= most else plain[: most - 3] + "..."
