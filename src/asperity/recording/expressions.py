"""Arithmetic of channels with units: ``Conf.Press - (Up.Pore.Press + Dwn.Pore.Press)/2``.

Names, numbers and units of a text are looked up first; what stands between them is parsed by `ast`,
and only sums, products, powers and the functions of `FUNCTIONS` are evaluated, on arrays in SI.
Nothing is ever run as Python.

A unit stands behind its number (``36 mm``), or in brackets (``[N/V]``); behind a number it may hold
a quotient if it is written without blanks (``2.4 N/V``). A name is that of a channel, or the role
that one plays; if it is neither, it is a unit (``36 * mm``). Names with blanks stand in quotes.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from asperity.errors import Argument, InputError, closest
from asperity.units.scale import Dimension, base_units, dimension_of, unit_text

Array = NDArray[np.float64]

#: Characters and levels of brackets that a text may have.
_LONGEST, _DEEPEST = 2000, 40
#: Larger powers are treated as misprints.
_HIGHEST_POWER = 16.0

_UNIT = r"(?:[^\W\d_]|[%°])+(?:\^?-?\d+)?"
_TOKEN = re.compile(
    rf"""
    (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
        (?:\s*(?P<unit>{_UNIT}(?:[*/·]{_UNIT})*)|\s*\[(?P<behind>[^\[\]]*)\])?
    | \[(?P<bracket>[^\[\]]*)\]
    | (?P<quoted>'[^']*'|"[^"]*"|`[^`]*`)
    | (?P<name>[^\W\d][\w.]*)
    | (?P<sign>\*\*|[-+*/^(),·×−])
    | (?P<blank>\s+)
    """,
    re.X,
)
_PYTHON = {"^": "**", "·": "*", "×": "*", "−": "-"}


class Quantity(NamedTuple):
    """Values in SI base units, an array or one number, and their dimension."""

    values: Array | np.float64
    dimension: Dimension


class Names(NamedTuple):
    """Lookup of the names in an expression.

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
        Channels in the expression.
    """

    quantity: Quantity
    sources: tuple[str, ...]


def evaluate(text: str, names: Names, field: str | Argument) -> Evaluated:
    """Value of an expression.

    Parameters
    ----------
    text : str
    names : Names
    field : str or Argument
        Name of the expression in messages, such as ``"channels['load']"``.

    Raises
    ------
    InputError
        If the text is no expression, a name or unit is unknown, or dimensions do not agree.
    """
    expression = _Expression(text, names, field)
    # Overflow gives infinity, which the check of the channel reports.
    with np.errstate(all="ignore"):
        quantity = expression.value()
    return Evaluated(quantity, tuple(dict.fromkeys(expression.sources)))


class _Expression:
    """A parsed text, and the quantities of its names, numbers and units."""

    def __init__(self, text: str, names: Names, field: str | Argument) -> None:
        self.text, self.names, self.field = text, names, field
        self.operands: list[Quantity] = []
        self.sources: list[str] = []
        if len(text) > _LONGEST:
            self.fail(f"have at most {_LONGEST} characters", f"{len(text)}", "split it")

    def fail(self, rule: str, got: str, advice: str) -> NoReturn:
        raise InputError(self.field, rule, got, advice)

    def _misplaced(self, what: str) -> NoReturn:
        self.fail(
            "be an expression of channels, numbers and units",
            what,
            "write it like 'Force * 1 kN / (20 mm * 36 mm)', names with blanks in quotes",
        )

    def value(self) -> Quantity:
        source = self._source()
        try:
            return self._evaluated(ast.parse(source, mode="eval").body)
        except SyntaxError:
            self._misplaced(f"'{self.text}'")
        except RecursionError:
            self.fail("be short", f"{len(self.text)} characters", "split it")

    def _source(self) -> str:
        """The text as Python, each operand a name: ``_0 - (_1 + _2)/_3``."""
        parts: list[str] = []
        at = level = signs = 0
        while at < len(self.text):
            token = _TOKEN.match(self.text, at)
            if token is None:
                self._misplaced(f"'{self.text[at]}' in '{self.text}'")
            at = token.end()
            if token["blank"]:
                continue
            if token["sign"]:
                sign = _PYTHON.get(token["sign"], token["sign"])
                parts.append(sign)
                level += {"(": 1, ")": -1}.get(sign, 0)
                signs = signs + 1 if sign in "+-" else 0
                if max(level, signs) > _DEEPEST:
                    self.fail(f"have at most {_DEEPEST} levels of brackets", "more", "simplify it")
                continue
            signs = 0
            if token["name"] in FUNCTIONS and self.text[at:].lstrip().startswith("("):
                parts.append(token["name"])
                continue
            parts.append(f"_{len(self.operands)}")
            if token["number"]:
                quantity, at = self._number(token)
            elif token["bracket"] is not None:
                quantity = self._unit(token["bracket"])
            elif token["quoted"]:
                quantity = self._channel(token["quoted"][1:-1], only_channels=True)
            else:
                quantity = self._channel(token["name"], only_channels=False)
            self.operands.append(quantity)
        if level > 0:
            self.fail("have a ')'", f"'{self.text}'", "check the brackets")
        if not parts or parts[-1] in ("+", "-", "*", "/", "**"):
            self.fail("be complete", f"'{self.text}'", "add what is missing at its end")
        return " ".join(parts)

    def _number(self, token: re.Match[str]) -> tuple[Quantity, int]:
        """A number with its unit, and where the text goes on behind them."""
        number, text = float(token["number"]), token["unit"]
        if text is None:
            unit = self._unit(token["behind"] or "")
            return Quantity(np.float64(number * unit.values), unit.dimension), token.end()
        # "2 N/area" is 2 N divided by a channel: the longest valid unit belongs to the number.
        length = len(text)
        while length > 0:
            try:
                factor, dimension = base_units(text[:length])
            except InputError:
                length = max(text.rfind(mark, 0, length) for mark in "*/·")
                continue
            return Quantity(np.float64(number * factor), dimension), token.start("unit") + length
        return self._unit(text), token.end()

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
        known = self.names.find(name, only_channels)
        if known is not None:
            quantity, source = known
            if source:
                self.sources.append(source)
            return quantity
        try:
            if only_channels:
                raise InputError
            factor, dimension = base_units(name)
        except InputError:
            self.fail(
                "be made of channels that are there",
                f"'{name}' in '{self.text}'",
                closest(name, [*self.names.known, *([] if only_channels else FUNCTIONS)]),
            )
        return Quantity(np.float64(factor), dimension)

    def _evaluated(self, node: ast.expr) -> Quantity:
        match node:
            case ast.Name(id=name) if name not in FUNCTIONS:
                value = self.operands[int(name[1:])]
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                value = self._evaluated(inner)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                value = self._evaluated(inner)
                value = Quantity(-value.values, value.dimension)
            case ast.BinOp(left=left, op=op, right=right):
                value = self._combined(self._evaluated(left), op, self._evaluated(right))
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in FUNCTIONS:
                value = self._function(name, [self._evaluated(each) for each in arguments])
            case _:
                self._misplaced(f"'{self.text}'")
        return value

    def _combined(self, one: Quantity, op: ast.operator, other: Quantity) -> Quantity:
        match op:
            case ast.Add() | ast.Sub():
                sign = "+" if isinstance(op, ast.Add) else "-"
                if one.dimension != other.dimension:
                    self.fail(
                        "add like to like",
                        f"{_described(one)} {sign} {_described(other)} in '{self.text}'",
                        "check the units of the channels",
                    )
                total = one.values + other.values if sign == "+" else one.values - other.values
                return Quantity(total, one.dimension)
            case ast.Mult():
                dimension = _product(one.dimension, other.dimension, 1.0)
                return Quantity(one.values * other.values, dimension)
            case ast.Div():
                dimension = _product(one.dimension, other.dimension, -1.0)
                return Quantity(np.divide(one.values, other.values), dimension)
        return self._power(one, other)

    def _power(self, value: Quantity, exponent: Quantity) -> Quantity:
        if exponent.dimension or np.ndim(exponent.values):
            self.fail("have plain numbers as exponents", _described(exponent), "write it like x^2")
        n = float(exponent.values)
        if not abs(n) <= _HIGHEST_POWER:
            self.fail(f"have exponents up to {_HIGHEST_POWER:g}", f"{n:g}", "correct it")
        dimension = dimension_of({name: n * m for name, m in value.dimension})
        return Quantity(np.power(value.values, n), dimension)

    def _function(self, name: str, arguments: list[Quantity]) -> Quantity:
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
                self.fail(
                    "have stretches in time", _described(limit), "write it like zero(x, 0 s, 5 s)"
                )
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
    """A function of expressions: its number of arguments, and its implementation."""

    arguments: tuple[int, ...]
    example: str
    apply: Callable[[_Expression, list[Quantity]], Quantity]


def _mean(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    values = expression.column(arguments[0])[expression.stretch(arguments)]
    return Quantity(
        np.float64(np.nanmean(values)) if _any(values) else _NAN, arguments[0].dimension
    )


def _median(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    values = expression.column(arguments[0])[expression.stretch(arguments)]
    return Quantity(
        np.float64(np.nanmedian(values)) if _any(values) else _NAN, arguments[0].dimension
    )


def _zero(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    return Quantity(
        arguments[0].values - _mean(expression, arguments).values, arguments[0].dimension
    )


def _cumulative(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    return Quantity(np.cumsum(expression.column(arguments[0])), arguments[0].dimension)


def _integral(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    values, time = expression.column(arguments[0]), expression.names.time
    parts = np.diff(time) * (values[1:] + values[:-1]) / 2
    whole = np.concatenate([[0.0], np.cumsum(parts)])
    return Quantity(whole, _product(arguments[0].dimension, base_units("s")[1], 1.0))


def _derivative(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    values = np.gradient(expression.column(arguments[0]), expression.names.time)
    return Quantity(values, _product(arguments[0].dimension, base_units("s")[1], -1.0))


def _absolute(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    return Quantity(np.abs(arguments[0].values), arguments[0].dimension)


def _root(expression: _Expression, arguments: list[Quantity]) -> Quantity:
    half = dimension_of({name: n / 2 for name, n in arguments[0].dimension})
    return Quantity(np.sqrt(arguments[0].values), half)


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


def _described(value: Quantity | Any) -> str:
    return f"a quantity in {unit_text(value.dimension)}" if value.dimension else "a pure number"
