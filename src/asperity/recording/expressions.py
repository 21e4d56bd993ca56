"""Arithmetic of channels with units: ``Conf.Press - (Up.Pore.Press + Dwn.Pore.Press)/2``.

Names, numbers and units of a text are looked up first; what stands between them is parsed by `ast`,
and only sums, products, powers and the functions of `_FUNCTIONS` and `_STATISTICS` are evaluated,
on arrays in SI. Nothing is ever run as Python.

A unit stands behind its number (``36 mm``), or in brackets (``[N/V]``); behind a number it may hold
a quotient if it is written without blanks (``2.4 N/V``). A name is that of a channel, or the role
that one plays; if it is neither, it is a unit (``36 * mm``). Names with blanks stand in quotes.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from typing import Any, NamedTuple, NoReturn

import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument, InputError, closest
from asperity.recording.roles import recorded_as, role_of
from asperity.recording.trace import Channel, Trace
from asperity.units.scale import Dimension, base_units, dimension_of, unit_text

#: Characters that a text may have.
_LONGEST = 2000
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
_SECONDS: Dimension = (("second", 1.0),)


class Quantity(NamedTuple):
    """Values in SI base units, an array or one number, and their dimension."""

    values: Float | np.float64
    dimension: Dimension


def trapezoids(values: Float, time: Float) -> Float:
    """Integral of values over time, from the first sample on; arrays (n,)."""
    return np.concatenate([[0.0], np.cumsum(np.diff(time) * (values[1:] + values[:-1]) / 2)])


#: Functions of a quantity: of its values and the times, and the powers of the quantity's dimension
#: and of seconds in the dimension of the result.
_FUNCTIONS: dict[str, tuple[Callable[[Any, Float], Any], float, float]] = {
    "abs": (lambda x, t: np.abs(x), 1, 0),
    "sqrt": (lambda x, t: np.sqrt(x), 0.5, 0),
    "cumulative": (lambda x, t: np.cumsum(np.broadcast_to(x, t.shape)), 1, 0),
    "integral": (lambda x, t: trapezoids(np.broadcast_to(x, t.shape), t), 1, 1),
    "derivative": (lambda x, t: np.gradient(np.broadcast_to(x, t.shape), t), 1, -1),
}
#: Functions of the values in a stretch of time, or in all of it.
_STATISTICS: dict[str, Callable[[Any], Any]] = {
    "mean": np.nanmean,
    "median": np.nanmedian,
    "zero": np.nanmean,
}
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
}


def evaluate(text: str, trace: Trace, field: Argument) -> tuple[Quantity, tuple[str, ...]]:
    """Value of an expression, and the channels in it.

    Parameters
    ----------
    text : str
    trace : Trace
    field : Argument
        Name of the expression in messages, such as ``"channels['load']"``.

    Raises
    ------
    InputError
        If the text is no expression, a name or unit is unknown, or dimensions do not agree.
    """
    expression = _Expression(text, trace, field)
    # Overflow gives infinity, which the check of the channel reports.
    with np.errstate(all="ignore"):
        quantity = expression.value()
    return quantity, tuple(dict.fromkeys(expression.sources))


class _Expression:
    """A parsed text, and the quantities of its names, numbers and units."""

    def __init__(self, text: str, trace: Trace, field: Argument) -> None:
        self.text, self.trace, self.field = text, trace, field
        self.operands: list[Quantity] = []
        self.sources: list[str] = []
        if len(text) > _LONGEST:
            self._fail(f"have at most {_LONGEST} characters", f"{len(text)}", "split it")

    def _fail(self, rule: str, got: str, advice: str) -> NoReturn:
        raise InputError(self.field, rule, got, advice)

    def _misplaced(self, what: str) -> NoReturn:
        self._fail(
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
            self._fail("be short", f"{len(self.text)} characters", "split it")

    def _source(self) -> str:
        """The text as Python, each operand a name: ``_0 - (_1 + _2)/_3``."""
        parts: list[str] = []
        at = 0
        while at < len(self.text):
            token = _TOKEN.match(self.text, at)
            if token is None:
                self._misplaced(f"'{self.text[at]}' in '{self.text}'")
            at = token.end()
            if token["blank"]:
                continue
            if token["sign"]:
                parts.append(_PYTHON.get(token["sign"], token["sign"]))
                continue
            is_function = token["name"] in _FUNCTIONS or token["name"] in _STATISTICS
            if is_function and self.text[at:].lstrip().startswith("("):
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
        return " ".join(parts)

    def _number(self, token: re.Match[str]) -> tuple[Quantity, int]:
        """A number with its unit, and the position in the text after them."""
        number, text = float(token["number"]), token["unit"]
        if text is None:
            return self._unit(token["behind"] or "", number), token.end()
        # "2 N/V*G" is 2 N/V times the channel or role G, also where G is the name of a unit.
        parts = re.finditer(r"[*·]([^*/·]+)", text)
        factors = (m.start() for m in parts if self._is_of_recording(m[1]))
        # "2 N/area" is 2 N divided by a channel: the longest valid unit belongs to the number.
        length = next(factors, len(text))
        while length > 0:
            try:
                return _in_base_units(text[:length], number), token.start("unit") + length
            except InputError:
                length = max(text.rfind(mark, 0, length) for mark in "*/·")
        return self._unit(text), token.end()

    def _is_of_recording(self, name: str) -> bool:
        """Whether a name is that of a channel or of a role, also of one that is not there."""
        try:
            return _key_of(self.trace, name) is not None
        except InputError:
            return True

    def _unit(self, text: str, number: float = 1.0) -> Quantity:
        try:
            return _in_base_units(text, number)
        except InputError:
            self._fail(
                "have units that are known",
                f"'{text}' in '{self.text}'",
                "write them like 'kN', 'cm^2' or 'N/V'",
            )

    def _channel(self, name: str, only_channels: bool) -> Quantity:
        key = _key_of(self.trace, name)
        if key is not None:
            self.sources.append(key)
            return _quantity(self.trace.channels[key], key, self.field)
        known = ["time", *self.trace.channels]
        if not only_channels:
            if name.lower() == "time":
                return Quantity(self.trace.time, _SECONDS)
            try:
                return _in_base_units(name, 1.0)
            except InputError:
                known += [*_FUNCTIONS, *_STATISTICS]
        got, advice = f"'{name}' in '{self.text}'", closest(name, known)
        raise InputError(self.field, "be made of channels that are there", got, advice)

    def _evaluated(self, node: ast.expr) -> Quantity:
        match node:
            case ast.Name(id=name) if name.startswith("_"):
                value = self.operands[int(name[1:])]
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                value = self._evaluated(inner)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                value = self._evaluated(inner)
                value = Quantity(-value.values, value.dimension)
            case ast.BinOp(left=left, op=op, right=right):
                value = self._combined(self._evaluated(left), op, self._evaluated(right))
            case ast.Call(func=ast.Name(id=name), args=[inner]) if name in _FUNCTIONS:
                apply, power, seconds = _FUNCTIONS[name]
                value = self._evaluated(inner)
                dimension = _product((value.dimension, power), (_SECONDS, seconds))
                value = Quantity(apply(value.values, self.trace.time), dimension)
            case ast.Call(func=ast.Name(id=name), args=[inner, *limits]) if name in _STATISTICS:
                value = self._statistic(name, self._evaluated(inner), limits)
            case _:
                self._misplaced(f"'{self.text}'")
        return value

    def _combined(self, one: Quantity, op: ast.operator, other: Quantity) -> Quantity:
        match op:
            case ast.Add() | ast.Sub():
                if one.dimension != other.dimension:
                    sign = "+" if isinstance(op, ast.Add) else "-"
                    self._fail(
                        "add like to like",
                        f"{_described(one)} {sign} {_described(other)} in '{self.text}'",
                        "check the units of the channels",
                    )
                dimension = one.dimension
            case ast.Mult() | ast.Div():
                power = 1.0 if isinstance(op, ast.Mult) else -1.0
                dimension = _product((one.dimension, 1.0), (other.dimension, power))
            case _:
                if other.dimension or np.ndim(other.values):
                    self._fail(
                        "have plain numbers as exponents", _described(other), "write it like x^2"
                    )
                n = float(other.values)
                if not abs(n) <= _HIGHEST_POWER:
                    self._fail(f"have exponents up to {_HIGHEST_POWER:g}", f"{n:g}", "correct it")
                dimension = _product((one.dimension, n))
        return Quantity(_OPERATORS[type(op)](one.values, other.values), dimension)

    def _statistic(self, name: str, value: Quantity, limits: list[ast.expr]) -> Quantity:
        """A statistic of all samples, or of those from the first limit to the second."""
        time = self.trace.time
        values = np.broadcast_to(np.asarray(value.values, dtype=np.float64), time.shape)
        inside = np.ones(time.size, bool)
        example = f"write it like {name}(x, 0 s, 5 s)"
        if len(limits) not in (0, 2):
            self._fail(f"give {name} 1 or 3 values", f"{1 + len(limits)}", example)
        if limits:
            start, end = edges = [self._evaluated(limit) for limit in limits]
            for edge in edges:
                if edge.dimension != _SECONDS or np.ndim(edge.values):
                    self._fail("have stretches in time", _described(edge), example)
            inside = (time >= start.values) & (time <= end.values)
            if not inside.any():
                known = np.isfinite(time).any()
                runs = f"the recording runs from {time[0]:.10g} s to {time[-1]:.10g} s"
                self._fail(
                    "have stretches that hold samples",
                    f"{float(start.values):g} s to {float(end.values):g} s",
                    runs if known else "write the expression for time before this one",
                )
        part = values[inside]
        level = np.float64(_STATISTICS[name](part) if np.isfinite(part).any() else np.nan)
        return Quantity(value.values - level if name == "zero" else level, value.dimension)


def _in_base_units(unit: str, values: Float | float) -> Quantity:
    """Values in a unit of any dimension; raises `InputError` if the text is no unit."""
    factor, dimension = base_units(unit)
    return Quantity(values * np.float64(factor), dimension)


def _product(*powers: tuple[Dimension, float]) -> Dimension:
    """Dimension of a product of powers."""
    exponents: dict[str, float] = {}
    for dimension, power in powers:
        for name, n in dimension:
            exponents[name] = exponents.get(name, 0.0) + power * n
    return dimension_of(exponents)


def _described(value: Quantity) -> str:
    return f"a quantity in {unit_text(value.dimension)}" if value.dimension else "a pure number"


def _key_of(trace: Trace, name: str) -> str | None:
    """The channel of a name, heading or role."""
    key = recorded_as(name, {key: c.recorded_name for key, c in trace.channels.items()})
    if key is not None:
        return key
    role = role_of(name)
    if role is None or role == "time":
        return None
    try:
        channel = trace.channel(name)
    except InputError:
        # V, N, W and F are units where no channel has the role of this name.
        if name in ("V", "N", "W", "F"):
            return None
        raise
    return trace.name_of(channel)


def _quantity(channel: Channel, key: str, field: Argument) -> Quantity:
    if channel.kind is not None:
        return Quantity(channel.values, base_units(channel.unit)[1])
    if not channel.recorded_unit:
        # A column without a unit is dimensionless.
        return Quantity(channel.values, ())
    try:
        return _in_base_units(channel.recorded_unit, channel.values)
    except InputError:
        rule, got = "be made of channels in known units", f"'{key}' in '{channel.recorded_unit}'"
        raise InputError(field, rule, got, f"name its unit when reading, like {key}=N") from None
