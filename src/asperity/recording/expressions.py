"""Arithmetic of channels with units: ``Conf.Press - (Up.Pore.Press + Dwn.Pore.Press)/2``.

A text is read by a grammar of its own and evaluated on arrays in SI; nothing of it is ever run as
Python.

    sum      = product { ("+" | "-") product }
    product  = signed { ("*" | "/") signed }
    signed   = [ "+" | "-" ] power
    power    = factor [ ("^" | "**") signed ]
    factor   = number [unit | "[" unit "]"] | "[" unit "]" | name | 'name' | "(" sum ")"
             | function "(" sum { "," sum } ")"

A unit behind a number may hold a quotient if it is written without blanks (``2.4 N/V``). A name is
that of a channel, or the role that one plays; if it is neither, it is a unit (``36 * mm``).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError, closest
from asperity.units.dimension import Dimension, base_units, dimension_of, unit_text

Array = NDArray[np.float64]

#: Characters and levels of brackets that a text may have.
_LONGEST, _DEEPEST = 2000, 40
#: Powers beyond this are misprints.
_HIGHEST_POWER = 16.0

_UNIT = r"(?:[^\W\d_]|[%°])+(?:\^?-?\d+)?"
_TOKEN = re.compile(
    rf"""
    (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:\s*(?P<unit>{_UNIT}(?:[*/·]{_UNIT})*))?
    | \[(?P<bracket>[^\[\]]*)\]
    | (?P<quoted>'[^']*'|"[^"]*"|`[^`]*`)
    | (?P<name>[^\W\d][\w.]*)
    | (?P<sign>\*\*|[-+*/^(),·×−])
    | (?P<blank>\s+)
    """,
    re.X,
)
_SAME = {"**": "^", "·": "*", "×": "*", "−": "-"}


class Quantity(NamedTuple):
    """Values in SI base units, an array or one number, and their dimension."""

    values: Array | np.float64
    dimension: Dimension


class Names(NamedTuple):
    """Where names of an expression lead.

    Attributes
    ----------
    find : callable
        The quantity of a name and the channel that it is, None if it names no channel.
    known : tuple of str
        For messages.
    time : array, (n,)
        Of the samples (s).
    """

    find: Callable[[str, bool], tuple[Quantity, str] | None]
    known: tuple[str, ...]
    time: Array


@dataclass(frozen=True)
class Evaluated:
    """Value of an expression.

    Attributes
    ----------
    quantity : Quantity
    sources : tuple of str
        Channels that it is made of.
    """

    quantity: Quantity
    sources: tuple[str, ...]


def evaluate(text: str, names: Names, field: str) -> Evaluated:
    """Value of an expression.

    Parameters
    ----------
    text : str
    names : Names
    field : str
        What messages call the expression, such as ``"channels['load']"``.

    Raises
    ------
    InputError
        If it is no expression, a name or unit is unknown, or dimensions do not agree.
    """
    parser = _Parser(text, names, field)
    # What overflows becomes infinite, and is found as such by the check of the channel.
    with np.errstate(all="ignore"):
        quantity = parser.whole()
    return Evaluated(quantity, tuple(dict.fromkeys(parser.sources)))


class _Parser:
    """One pass over the tokens of a text, evaluating as it goes."""

    def __init__(self, text: str, names: Names, field: str) -> None:
        self.text, self.names, self.field = text, names, field
        self.sources: list[str] = []
        self.depth = 0
        if len(text) > _LONGEST:
            self.fail(f"have at most {_LONGEST} characters", f"{len(text)}", "split it")
        self.tokens = self._tokens()
        self.at = 0

    def fail(self, rule: str, got: str, advice: str) -> NoReturn:
        raise InputError(f"{self.field} must {rule}, got {got}; {advice}")

    def _tokens(self) -> list[re.Match[str]]:
        found, at = [], 0
        while at < len(self.text):
            match = _TOKEN.match(self.text, at)
            if match is None:
                self._misplaced(self.text[at])
            if match.lastgroup != "blank":
                found.append(match)
            at = match.end()
        return found

    def _misplaced(self, what: str) -> NoReturn:
        self.fail(
            "be an expression of channels, numbers and units",
            f"'{what}' in '{self.text}'",
            "write it like 'Force * 1 kN / (20 mm * 36 mm)', names with blanks in quotes",
        )

    def sign(self) -> str:
        """The sign that comes next, empty if it is none."""
        if self.at < len(self.tokens) and self.tokens[self.at]["sign"]:
            sign = self.tokens[self.at]["sign"]
            return _SAME.get(sign, sign)
        return ""

    def take(self, sign: str) -> None:
        if self.sign() != sign:
            left = self.tokens[self.at][0] if self.at < len(self.tokens) else "its end"
            self.fail(f"have a '{sign}'", f"{left!r} in '{self.text}'", "check the brackets")
        self.at += 1

    def whole(self) -> Quantity:
        value = self.sum()
        if self.at < len(self.tokens):
            self._misplaced(self.tokens[self.at][0])
        return value

    def sum(self) -> Quantity:
        value = self.product()
        while (sign := self.sign()) in ("+", "-"):
            self.at += 1
            other = self.product()
            if value.dimension != other.dimension:
                self.fail(
                    "add like to like",
                    f"{_told(value)} {sign} {_told(other)} in '{self.text}'",
                    "check the units of the channels",
                )
            sum_ = value.values + other.values if sign == "+" else value.values - other.values
            value = Quantity(sum_, value.dimension)
        return value

    def product(self) -> Quantity:
        value = self.signed()
        while (sign := self.sign()) in ("*", "/"):
            self.at += 1
            other = self.signed()
            if sign == "*":
                values, power = value.values * other.values, 1.0
            else:
                values, power = np.divide(value.values, other.values), -1.0
            value = Quantity(values, _product(value.dimension, other.dimension, power))
        return value

    def signed(self) -> Quantity:
        sign = self.sign()
        if sign in ("+", "-"):
            self.at += 1
            self.depth += 1
            self._not_too_deep()
            value = self.signed()
            self.depth -= 1
            return Quantity(-value.values, value.dimension) if sign == "-" else value
        return self.power()

    def power(self) -> Quantity:
        value = self.factor()
        if self.sign() != "^":
            return value
        self.at += 1
        exponent = self.signed()
        if exponent.dimension or np.ndim(exponent.values):
            self.fail("have plain numbers as exponents", _told(exponent), "write it like x^2")
        n = float(exponent.values)
        if not abs(n) <= _HIGHEST_POWER:
            self.fail(f"have exponents up to {_HIGHEST_POWER:g}", f"{n:g}", "correct it")
        dimension = dimension_of({name: n * m for name, m in value.dimension})
        return Quantity(np.power(value.values, n), dimension)

    def factor(self) -> Quantity:
        if self.at >= len(self.tokens):
            self.fail("be complete", f"'{self.text}'", "add what is missing at its end")
        token = self.tokens[self.at]
        if token["sign"] == "(":
            self.at += 1
            self.depth += 1
            self._not_too_deep()
            value = self.sum()
            self.depth -= 1
            self.take(")")
            return value
        if token["sign"]:
            self._misplaced(token["sign"])
        self.at += 1
        if token["number"]:
            return self._number(float(token["number"]), token)
        if token["bracket"] is not None:
            return self._unit(token["bracket"])
        if token["quoted"]:
            return self._channel(token["quoted"][1:-1], only_channels=True)
        if self.sign() == "(" and token["name"] in FUNCTIONS:
            return self._function(token["name"])
        return self._channel(token["name"], only_channels=False)

    def _not_too_deep(self) -> None:
        if self.depth > _DEEPEST:
            self.fail(f"have at most {_DEEPEST} levels of brackets", "more", "simplify it")

    def _number(self, number: float, token: re.Match[str]) -> Quantity:
        text = token["unit"]
        if text is None:
            if self.at < len(self.tokens) and self.tokens[self.at]["bracket"] is not None:
                self.at += 1
                unit = self._unit(self.tokens[self.at - 1]["bracket"])
                return Quantity(np.float64(number * unit.values), unit.dimension)
            return Quantity(np.float64(number), ())
        # "2 N/area" is a number with a unit over a channel: as much is a unit as can be one.
        length = len(text)
        while length > 0:
            try:
                factor, dimension = base_units(text[:length])
            except InputError:
                length = max(text.rfind(mark, 0, length) for mark in "*/·")
                continue
            if length < len(text):
                self._split(token, length)
            return Quantity(np.float64(number * factor), dimension)
        return self._unit(text)

    def _split(self, token: re.Match[str], length: int) -> None:
        """Put what is no unit behind a number back among the tokens."""
        rest, at = [], token.start("unit") + length
        while at < token.end():
            match = _TOKEN.match(self.text, at, token.end())
            if match is None:
                self._misplaced(self.text[at])
            rest.append(match)
            at = match.end()
        self.tokens[self.at : self.at] = rest

    def _unit(self, text: str) -> Quantity:
        try:
            factor, dimension = base_units(text)
        except InputError:
            self.fail(
                "have units that are known",
                f"'{text}' in '{self.text}'",
                "write them like 'kN', 'cm^2' or 'N/V'",
            )
        return Quantity(np.float64(factor), dimension)

    def _channel(self, name: str, only_channels: bool) -> Quantity:
        found = self.names.find(name, only_channels)
        if found is not None:
            quantity, source = found
            if source:
                self.sources.append(source)
            return quantity
        try:
            if only_channels:
                raise InputError
            factor, dimension = base_units(name)
        except InputError:
            known = [*self.names.known, *([] if only_channels else FUNCTIONS)]
            self.fail(
                "be made of channels that are there",
                f"'{name}' in '{self.text}'",
                closest(name, known),
            )
        return Quantity(np.float64(factor), dimension)

    def _function(self, name: str) -> Quantity:
        self.take("(")
        self.depth += 1
        self._not_too_deep()
        arguments = [self.sum()]
        while self.sign() == ",":
            self.at += 1
            arguments.append(self.sum())
        self.depth -= 1
        self.take(")")
        rule = FUNCTIONS[name]
        if len(arguments) not in rule.arguments:
            counts = " or ".join(map(str, rule.arguments))
            self.fail(
                f"give {name} {counts} values", f"{len(arguments)}", f"write it like {rule.example}"
            )
        return rule.apply(self, arguments)

    def stretch(self, arguments: list[Quantity]) -> slice | NDArray[np.bool_]:
        """Samples from the second argument to the third; all without them."""
        if len(arguments) == 1:
            return slice(None)
        start, end = arguments[1:]
        for limit in (start, end):
            if limit.dimension != base_units("s")[1] or np.ndim(limit.values):
                self.fail("have stretches in time", _told(limit), "write it like zero(x, 0 s, 5 s)")
        time = self.names.time
        inside = (time >= start.values) & (time <= end.values)
        if not inside.any():
            self.fail(
                "have stretches that hold samples",
                f"{float(start.values):g} s to {float(end.values):g} s",
                f"the recording runs from {time[0]:.10g} s to {time[-1]:.10g} s",
            )
        return inside

    def column(self, value: Quantity) -> Array:
        """Values as one a sample."""
        return np.broadcast_to(np.asarray(value.values, dtype=np.float64), self.names.time.shape)


@dataclass(frozen=True)
class Function:
    """A function of expressions: how many values it takes, and what it makes of them."""

    arguments: tuple[int, ...]
    example: str
    apply: Callable[[_Parser, list[Quantity]], Quantity]


def _mean(parser: _Parser, given: list[Quantity]) -> Quantity:
    values = parser.column(given[0])[parser.stretch(given)]
    return Quantity(np.float64(np.nanmean(values)) if _any(values) else _NAN, given[0].dimension)


def _median(parser: _Parser, given: list[Quantity]) -> Quantity:
    values = parser.column(given[0])[parser.stretch(given)]
    return Quantity(np.float64(np.nanmedian(values)) if _any(values) else _NAN, given[0].dimension)


def _zero(parser: _Parser, given: list[Quantity]) -> Quantity:
    return Quantity(given[0].values - _mean(parser, given).values, given[0].dimension)


def _cumulative(parser: _Parser, given: list[Quantity]) -> Quantity:
    return Quantity(np.cumsum(parser.column(given[0])), given[0].dimension)


def _integral(parser: _Parser, given: list[Quantity]) -> Quantity:
    values, time = parser.column(given[0]), parser.names.time
    parts = np.diff(time) * (values[1:] + values[:-1]) / 2
    whole = np.concatenate([[0.0], np.cumsum(parts)])
    return Quantity(whole, _product(given[0].dimension, base_units("s")[1], 1.0))


def _derivative(parser: _Parser, given: list[Quantity]) -> Quantity:
    values = np.gradient(parser.column(given[0]), parser.names.time)
    return Quantity(values, _product(given[0].dimension, base_units("s")[1], -1.0))


def _absolute(parser: _Parser, given: list[Quantity]) -> Quantity:
    return Quantity(np.abs(given[0].values), given[0].dimension)


def _root(parser: _Parser, given: list[Quantity]) -> Quantity:
    half = dimension_of({name: n / 2 for name, n in given[0].dimension})
    return Quantity(np.sqrt(given[0].values), half)


_NAN = np.float64(np.nan)

#: Functions by name.
FUNCTIONS: Mapping[str, Function] = {
    "abs": Function((1,), "abs(x)", _absolute),
    "sqrt": Function((1,), "sqrt(x)", _root),
    "mean": Function((1, 3), "mean(x, 0 s, 5 s)", _mean),
    "median": Function((1, 3), "median(x, 0 s, 5 s)", _median),
    "zero": Function((1, 3), "zero(x, 0 s, 5 s)", _zero),
    "cumulative": Function((1,), "cumulative(x)", _cumulative),
    "integral": Function((1,), "integral(x)", _integral),
    "derivative": Function((1,), "derivative(x)", _derivative),
}


def _any(values: Array) -> bool:
    return bool(np.isfinite(values).any())


def _product(one: Dimension, other: Dimension, power: float) -> Dimension:
    exponents = dict(one)
    for name, n in other:
        exponents[name] = exponents.get(name, 0.0) + power * n
    return dimension_of(exponents)


def _told(value: Quantity | Any) -> str:
    return f"a quantity in {unit_text(value.dimension)}" if value.dimension else "a pure number"
