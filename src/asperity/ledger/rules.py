"""Acceptance rules: when a computed number agrees with a statement of the paper.

The meaning of each word is fixed here, once, before anything is computed, and holds for every claim
that uses the word. claims.toml names the rule and the word; no tolerance is written next to a
result.

==============================  =========================================================
the paper writes                accepted
==============================  =========================================================
a number with its digits        what rounds to it: half a unit of the last digit stated
"about", "approximately"        within 5 %
"~", "of order", "k orders"     within half a decade: the nearest power of ten is the same
"much larger", ">>"             by a factor of 10 or more; "much smaller", "<<" likewise
"negligible", "very close"      a change of less than 5 %
"independent of", "weakly",     a change of less than 10 %; so for "very weakly dependent
"satisfactory"                  on V" and "quasi-independent of V", which say the same
"substantial", "relevant"       10 % or more
"significant", "sizeable"       20 % or more; so is a distance from something, "away"
"strongly", "crucially"         a factor of 1.5 or more, or an exponent above 1/2
"quasi-linear" in V             an exponent within 0.1 of 1; "much weaker": below 1/2
"quasi-linear" curve            within 5 % of a line, relative to its highest point
"saturates"                     a logarithmic slope below 1/4; "does not": above 1/2
==============================  =========================================================

A paper whose rules were fixed with other tolerances names them with "within" and "between".

A statement about a range is judged at both ends of the range and between. Where the paper states
one number twice, the more precise statement is judged.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from asperity.errors import InputError, closest, code_of_others
from asperity.parameters.arguments import typed

#: Relative tolerance of "about".
ABOUT = 0.05
#: Decades to either side of "of order".
HALF_A_DECADE = 0.5
#: Numbers of the words that a rule may use as its limit.
WORDS: Mapping[str, float] = {
    "negligible": 0.05,
    "weak": 0.10,
    "substantial": 0.10,
    "sizeable": 0.20,
    "strong": 1.5,
    "much larger": 10.0,
    "much smaller": 0.1,
    "half a decade": HALF_A_DECADE,
    "saturated": 0.25,
    "unsaturated": 0.5,
    "nearly one, low": 0.9,
    "nearly one, high": 1.1,
}
#: Tolerance at the limits: 0.485 counts as 0.48 and as 0.49, independent of round-off.
_TIE = 1e-9


@dataclass(frozen=True)
class AcceptanceRule:
    """A test of a number, and the sentence of the test.

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


@typed
def rounds_to(stated: float, last_digit: float, what: str = "the value") -> AcceptanceRule:
    """Half a unit of the last digit stated, `last_digit` being one unit of it."""
    half = last_digit / 2
    return AcceptanceRule(
        f"{what} within {half:g} of {stated:g}, half a unit of the last digit stated",
        lambda value: abs(value - stated) <= half + _TIE * abs(stated),
    )


@typed
def about(stated: float, what: str = "the value") -> AcceptanceRule:
    """Within 5 %."""
    return within(stated, ABOUT, what)


@typed
def within(stated: float, tolerance: float, what: str = "the value") -> AcceptanceRule:
    """Within a relative tolerance that was fixed beforehand."""
    return AcceptanceRule(
        f"{what} within {100 * tolerance:.2g} % of {stated:g}",
        lambda value: abs(value - stated) <= (tolerance + _TIE) * abs(stated),
    )


@typed
def of_order(stated: float, what: str = "the value") -> AcceptanceRule:
    """Within half a decade, of the same sign."""
    return AcceptanceRule(
        f"{what} within half a decade of {stated:g}",
        lambda v: v * stated > 0 and abs(math.log10(v / stated)) <= HALF_A_DECADE,
    )


@typed
def below(limit: float, what: str) -> AcceptanceRule:
    """Less than `limit`."""
    return AcceptanceRule(f"{what} below {limit:g}", lambda value: value < limit)


@typed
def above(limit: float, what: str) -> AcceptanceRule:
    """More than `limit`."""
    return AcceptanceRule(f"{what} above {limit:g}", lambda value: value > limit)


@typed
def between(low: float, high: float, what: str) -> AcceptanceRule:
    """From `low` to `high`, both included."""
    return AcceptanceRule(f"{what} from {low:g} to {high:g}", lambda value: low <= value <= high)


@typed
def change_below(limit: float, what: str) -> AcceptanceRule:
    """A relative change, of either sign, of less than `limit`."""
    return AcceptanceRule(
        f"{what} changes by less than {100 * limit:g} %", lambda value: abs(value) < limit
    )


_OPERATIONS: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt,
    "ln": math.log,
    "abs": abs,
    "min": min,
    "max": max,
    "real": operator.attrgetter("real"),
    "imag": operator.attrgetter("imag"),
}


@typed
def formula_value(
    formula: str,
    numbers: Mapping[str, float],
    place: str,
    terms: Mapping[str, Any] | None = None,
) -> float:
    """The value of a formula of the paper's numbers with + - * / ** and pi.

    Functions are sqrt, ln, abs, min and max, and real and imag of a complex number.

    Parameters
    ----------
    formula : str
        A name that is a word of Python has an underscore at its end: ``lambda_``.
    numbers : mapping of str to float
        From `asperity.ledger.claims.printed_numbers`.
    place : str
        Place of the formula, for messages.
    terms : mapping of str to object, optional
        Further names: functions, and their arguments.

    Raises
    ------
    InputError
        If it is not such a formula, or has an unknown name.
    """
    known = {**_FUNCTIONS, **(terms or {})}

    def value(node: ast.expr) -> Any:
        match node:
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
                return _OPERATIONS[type(op)](value(left), value(right))
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -value(inner)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in known:
                return known[name](*map(value, args))
            case ast.Constant(value=int() | float() as constant):
                return float(constant)
            case ast.Constant(value=str() as text):
                return text
            case ast.Name(id=name) if name in known:
                return known[name]
            case ast.Name() | ast.Attribute():
                name = re.sub(r"_(?=$|\.)", "", ast.unparse(node))
                return number(name, {**numbers, "pi": math.pi}, place)
        raise SyntaxError(f"'{ast.unparse(node)}' is neither a number nor a known name")

    rule, advice = "be a formula of the paper's numbers", "write it like 'W0/Sigma0'"
    with code_of_others(place, rule, advice, f"'{formula}'"):
        return float(value(ast.parse(formula, mode="eval").body))


#: Rules that claims.toml may name; their arguments are the numbers of a rule.
RULES: Mapping[str, Callable[..., AcceptanceRule]] = {
    make.__name__.replace("_", "-"): make
    for make in (rounds_to, about, within, of_order, below, above, between, change_below)
}


@typed
def number(value: float | str, numbers: Mapping[str, float], place: str) -> float:
    """A number of a rule: itself, a word of `WORDS`, or the name of one of the paper's numbers.

    Raises
    ------
    InputError
        If a text is neither.
    """
    if isinstance(value, float | int):
        return float(value)
    if value in WORDS:
        return WORDS[value]
    if value in numbers:
        return numbers[value]
    rule = "be a number, a word of the rules or one of the paper's numbers"
    raise InputError(place, rule, f"'{value}'", closest(value, {**WORDS, **numbers}))
