"""Rules that numbers obey; a value that breaks one is an error in one sentence."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from asperity.errors import InputError, require_known
from asperity.units import KINDS, to_si
from asperity.units.convert import is_traced


@dataclass(frozen=True)
class Rule:
    """A rule that a number obeys.

    Attributes
    ----------
    words : str
        Text after "must" in a message.
    holds : callable
        Whether each element of an array obeys the rule.
    advice : str
        Advice for a value that breaks the rule.
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
        "count": Rule(
            "be a whole number from 0",
            # Axes at equal ratios hit whole numbers up to rounding.
            lambda x: (x >= 0) & (np.abs(x - np.rint(x)) < 1e-6),
            "give one, such as 3",
        ),
        "switch": Rule(
            "be 1 or 0",
            lambda x: np.isin(x, (0.0, 1.0)),
            "write 1 to include it, 0 to leave it out",
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
        Name of the value in messages, such as ``slider.spring``.
    kind : str
        A key of `asperity.units.KINDS`.
    rule : str
        A key of `RULES`.

    Returns
    -------
    array of float
        Same shape as `value`. A value traced by JAX is returned unchanged and unchecked.

    Raises
    ------
    InputError
        With the label, the rule, the first value that breaks the rule, and its unit.
    """
    require_known(rule, RULES, "rule", "be a known rule")
    if is_traced(value):
        return value
    array = np.asarray(to_si(value, kind, label), dtype=float)
    # A number below the smallest normal double has few digits, and its reciprocal may be infinite.
    small = (array != 0) & (np.abs(array) < sys.float_info.min)
    within = "lie within the range of double precision", "give 0 or a larger number"
    for wrong, words, advice in (
        (~RULES[rule].holds(array), RULES[rule].words, RULES[rule].advice),
        (small, *within),
    ):
        if np.any(wrong):
            got = f"{array[wrong].flat[0]:g} {KINDS[kind].si}".rstrip()
            raise InputError(label, words, got, advice)
    return array
