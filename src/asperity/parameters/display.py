"""Short texts and tables of objects, for consoles and notebooks: no arrays, but what they hold."""

from __future__ import annotations

import html
from typing import Any, NamedTuple

import numpy as np

from asperity.parameters.parameter import Parameter, plain_text
from asperity.units import format_si
from asperity.units.convert import is_traced


class SummaryLine(NamedTuple):
    """A line of a summary: name, value as text, and what it is."""

    name: str
    value: str
    meaning: str = ""


class Displayed:
    """An object that shows itself by its summary.

    Subclasses that are dataclasses are declared with ``repr=False``.
    """

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """What the object is, and its most telling values."""
        raise NotImplementedError

    def __repr__(self) -> str:
        title, lines = self.summary()
        values = ", ".join(f"{line.name}={line.value}" for line in lines)
        return f"<{title}: {values}>" if values else f"<{title}>"

    def _repr_html_(self) -> str:
        title, lines = self.summary()
        rows = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in line) + "</tr>"
            for line in lines
        )
        return f"<table><caption>{html.escape(title)}</caption><tbody>{rows}</tbody></table>"


def parameter_line(parameter: Parameter, value: Any) -> SummaryLine:
    """A parameter with its value in a unit that reads well; of an array the range and the shape."""
    return SummaryLine(
        parameter.name, value_text(value, parameter.kind), plain_text(parameter.meaning)
    )


def value_text(value: Any, kind: str) -> str:
    """A value of a kind of quantity in a few words.

    Parameters
    ----------
    value : float or array
        In SI, or traced by JAX.
    kind : str
        A key of `asperity.units.KINDS`.
    """
    if is_traced(value) or (not hasattr(value, "__array__") and not np.isscalar(value)):
        return "traced"
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or not array.size:
        return f"an array of shape {array.shape}"
    if array.size == 1:
        return format_si(float(array.ravel()[0]), kind, 6)
    low, high = format_si(array.min(), kind), format_si(array.max(), kind)
    return f"{low if low == high else f'{low} to {high}'} {array.shape}"


def count_text(count: int, noun: str) -> str:
    """``1 point``, ``2 points``."""
    return f"{count:,} {noun}" + ("" if count == 1 else "s")


def number_line(name: str, values: Any, meaning: str = "") -> SummaryLine:
    """A number, or the range of an array without what is NaN in it."""
    array = np.asarray(values, dtype=float)
    known = array[np.isfinite(array)]
    if not known.size:
        return SummaryLine(name, "none", meaning)
    low, high = (f"{edge:.6g}" for edge in (known.min(), known.max()))
    return SummaryLine(name, low if low == high else f"{low} to {high}", meaning)
