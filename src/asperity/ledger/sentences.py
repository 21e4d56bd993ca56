"""Sentences with placeholders for numbers, from the TOML files of a paper.

``{name:spec}`` stands for the number ``name`` in Python's format ``spec``, ``{100*name:.1f}`` for a
multiple of it. A name may hold blanks, commas and dots: ``{mu1, 10 um/s:.3g}``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from string import Formatter
from typing import Any

from asperity.errors import InputError, closest
from asperity.parameters.arguments import typed

_FIELD = re.compile(r"(?:(-?[\d.]+(?:e-?\d+)?)\*)?(.*)", re.DOTALL)


class _Filler(Formatter):
    def get_field(
        self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]
    ) -> tuple[Any, str]:
        factor, name = _parts(field_name)
        return (kwargs[name] if factor is None else float(factor) * kwargs[name]), name


def _parts(field: str) -> tuple[str | None, str]:
    match = _FIELD.fullmatch(field)
    assert match is not None  # the pattern takes every text
    return match[1], match[2]


@typed
def names_in(sentence: str) -> tuple[str, ...]:
    """Names of the numbers that a sentence quotes.

    Raises
    ------
    ValueError
        If a brace is not closed.
    """
    return tuple(_parts(field)[1] for _, field, _, _ in Formatter().parse(sentence) if field)


@typed
def fill(sentence: str, values: Mapping[str, Any], where: str) -> str:
    """The sentence with its numbers.

    Parameters
    ----------
    sentence : str
    values : mapping of str to float or str
    where : str
        Place of the sentence, for messages.

    Raises
    ------
    InputError
        If a number is missing, or cannot be formatted as in the sentence.
    """
    try:
        return _Filler().vformat(sentence, (), values)
    except KeyError as error:
        name = str(error.args[0])
        rule = "quote numbers that are computed"
        raise InputError(where, rule, f"'{{{name}}}'", closest(name, values)) from None
    except (ValueError, TypeError) as error:
        raise InputError(
            f"{where} must be a sentence with valid placeholders, got: {error}; correct it"
        ) from None
