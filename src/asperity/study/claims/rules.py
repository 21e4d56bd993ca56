"""Acceptance rules: when a computed number counts as what the paper states.

The meaning of each word is fixed here, once, before anything is computed, and holds for every claim
that uses the word:

============================  ===========================================================
the paper writes              accepted
============================  ===========================================================
a number with its digits      what rounds to it: half a unit of the last digit stated
"about", "approximately"      within 5 %
"of order", "k orders"        within half a decade: the nearest power of ten is the same
"much smaller", ">>"          by a factor of 10 or more
"negligible", "very weakly"   a change of less than 5 %
"very close", "excellent"     a difference of less than 5 %
"independent", "weakly"       a change of less than 10 %
"satisfactory"                a difference of less than 10 %
"quasi-independent"           a change of less than 20 %
"substantial", "relevant"     10 % or more
"significant", "sizeable"     20 % or more; so is a distance from something, "away"
"strongly", "crucially"       a factor of 1.5 or more, or an exponent above 1/2
"quasi-linear" in V           an exponent within 0.1 of 1; "much weaker": below 1/2
"quasi-linear" curve          within 5 % of a line, relative to its highest point
"saturates"                   a logarithmic slope below 1/4; "does not": above 1/2
============================  ===========================================================
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

ABOUT = 0.05
HALF_A_DECADE = 0.5
MUCH = 10.0
NEGLIGIBLE = 0.05
WEAK = 0.10
QUASI = 0.20
NEARLY_ONE = 0.1
SATURATED, UNSATURATED = 0.25, 0.5
#: A tie counts as inside, whatever its last bit: 0.485 rounds to 0.48 or 0.49.
_TIE = 1e-9


@dataclass(frozen=True)
class Rule:
    """A test of a number, and the sentence that says what it tests.

    Attributes
    ----------
    text : str
    accepts : callable
        Number to bool; never sees a number that is not finite.
    """

    text: str
    accepts: Callable[[float], bool]

    def holds(self, value: float) -> bool:
        """Whether `value` is finite and accepted."""
        return math.isfinite(value) and bool(self.accepts(value))


def rounds_to(stated: float, last_digit: float, what: str = "the value") -> Rule:
    """Half a unit of the last digit stated, `last_digit` being one unit of it."""
    half = last_digit / 2
    return Rule(
        f"{what} within {half:g} of {stated:g}, half a unit of the last digit stated",
        lambda value: abs(value - stated) <= half + _TIE * abs(stated),
    )


def about(stated: float, what: str = "the value") -> Rule:
    """Within 5 %."""
    return Rule(
        f"{what} within {100 * ABOUT:g} % of {stated:g}",
        lambda value: abs(value / stated - 1) <= ABOUT + _TIE,
    )


def of_order(stated: float, what: str = "the value") -> Rule:
    """Within half a decade."""
    return Rule(
        f"{what} within half a decade of {stated:g}",
        lambda value: value > 0 and abs(math.log10(value / stated)) <= HALF_A_DECADE,
    )


def below(limit: float, what: str) -> Rule:
    """Less than `limit`."""
    return Rule(f"{what} below {limit:g}", lambda value: value < limit)


def above(limit: float, what: str) -> Rule:
    """More than `limit`."""
    return Rule(f"{what} above {limit:g}", lambda value: value > limit)


def between(low: float, high: float, what: str) -> Rule:
    """From `low` to `high`, both included."""
    return Rule(f"{what} from {low:g} to {high:g}", lambda value: low <= value <= high)


def change_below(limit: float, what: str) -> Rule:
    """A relative change, of either sign, of less than `limit`."""
    return Rule(f"{what} changes by less than {100 * limit:g} %", lambda value: abs(value) < limit)


def agrees(reference: float, tolerance: float, what: str) -> Rule:
    """Within `tolerance`, relative, of a reference."""
    return Rule(
        f"{what} within {tolerance:.2g} (relative) of {reference:.6g}",
        lambda value: abs(value - reference) <= tolerance * abs(reference),
    )
