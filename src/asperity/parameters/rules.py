"""The rules that values of parameters obey, and the sentence for a value that breaks one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from asperity.errors import InputError
from asperity.units import KINDS, to_si
from asperity.units.convert import is_traced


@dataclass(frozen=True)
class Rule:
    """A rule that a number obeys.

    Attributes
    ----------
    words : str
        What follows "must" in a message.
    holds : callable
        Whether each element of an array obeys the rule.
    advice : str
        What to do about a value that does not.
    """

    words: str
    holds: Callable[[Any], Any]
    advice: str


#: Every rule, by name. NaN and infinities are refused by `asperity.units.to_si` already.
RULES: Mapping[str, Rule] = MappingProxyType(
    {
        "positive": Rule("be positive", lambda x: x > 0, "give a value above zero"),
        "not negative": Rule("not be negative", lambda x: x >= 0, "give a value of at least zero"),
        "finite": Rule("be finite", np.isfinite, "give a finite value"),
        "amplitude": Rule(
            "be at least 0 and below 1, so that contact is never lost",
            lambda x: (x >= 0) & (x < 1),
            "give the relative amplitude of the load, such as 0.24 or '24 %'",
        ),
        "below a right angle": Rule(
            "be less than a right angle, pi/2, on either side",
            lambda x: np.abs(x) < np.pi / 2,
            "give the angle from the normal in rad, such as 0.03, or as a text like '2 deg'",
        ),
        "switch": Rule(
            "be 1 or 0",
            lambda x: np.isin(x, (0.0, 1.0)),
            "write 1 where it counts, 0 elsewhere",
        ),
    }
)


def obeying(value: Any, label: str, kind: str, rule: str) -> Any:
    """Convert a value to SI and check its rule.

    Parameters
    ----------
    value : str, number, array or sequence of these
        A text carries its unit, a number is SI.
    label : str
        What messages call the value, as ``slider.K``.
    kind : str
        A key of `asperity.units.KINDS`.
    rule : str
        A key of `RULES`.

    Returns
    -------
    array of float
        Of the shape of `value`. A value that JAX traces is returned as it is, unchecked.

    Raises
    ------
    InputError
        Naming the value, the rule, the first offending element and its unit.
    """
    if is_traced(value):
        return value
    array = np.asarray(to_si(value, kind, label), dtype=float)
    if not np.all(RULES[rule].holds(array)):
        bad = array[~RULES[rule].holds(array)]
        got = f"{bad.flat[0]:g} {KINDS[kind].si}".rstrip()
        raise InputError(f"{label} must {RULES[rule].words}, got {got}; {RULES[rule].advice}")
    return array
