"""An axis of a map: a number of the operating point, its ends and its grid."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.operating_point import known_parameters
from asperity.parameters import Parameter, canonical_name, suggestion
from asperity.parameters.arguments import number, shown, switch, whole_number

Float = NDArray[np.float64]

_AXIS = re.compile(r"\s*([\w]+)\s*=\s*([^:\s]+)\s*:\s*([^:\s]+)\s*:\s*(\d+)(?:\s+|(?=%))(.*)")


@dataclass(frozen=True)
class Axis:
    """A number that varies along a side of a map.

    Attributes
    ----------
    name : str
        As in `asperity.parameters`: ``epsilon``, ``K``, ``V``, ``lambda``...
    low, high : float
        Ends in SI; texts with units are converted. ``low < high``.
    count : int
        Points of the grid, at least 2, both ends among them.
    log : bool
        Whether they lie at equal ratios instead of equal distances.

    Raises
    ------
    InputError
        If the name is unknown, an end breaks the rule of its parameter, or the ends and the count
        make no grid.
    """

    name: str
    low: float | str
    high: float | str
    count: int
    log: bool = False

    def __post_init__(self) -> None:
        parameter = _parameter(self.name)
        object.__setattr__(self, "name", parameter.name)
        for end in ("low", "high"):
            value = getattr(self, end)
            found = number(value, parameter.label, parameter.kind, parameter.rule)
            object.__setattr__(self, end, found)
        object.__setattr__(self, "count", whole_number(self.count, f"axis of {self.name}", 0))
        object.__setattr__(self, "log", switch(self.log, "axis.log"))
        if not self._ends[0] < self._ends[1]:
            raise InputError(
                f"axis of {self.name} must go from a smaller to a larger value, got "
                f"{self.low:g} to {self.high:g}{_unit(parameter)}; write the smaller end first"
            )
        if self.count < 2:
            raise InputError(
                f"axis of {self.name} must have at least 2 points, got {self.count}; "
                "ask for 2 or more"
            )
        if self.log and not self._ends[0] > 0:
            raise InputError(
                f"axis of {self.name} must start above zero to be logarithmic, got "
                f"{self.low:g}{_unit(parameter)}; raise its lower end or make it linear"
            )

    @classmethod
    def parse(cls, text: str, log: bool = False) -> Axis:
        """Read ``NAME=LOW:HIGH:COUNT UNIT``, as ``K=0.05:0.5:200 N/um``.

        Raises
        ------
        InputError
            If the text has another form, or as `Axis`.
        """
        match = _AXIS.fullmatch(text + " ")
        if match is None:
            raise InputError(
                f"axis must be NAME=LOW:HIGH:COUNT UNIT, got '{text}'; "
                "write it like 'K=0.05:0.5:200 N/um' or 'epsilon=0.01:0.5:200'"
            )
        name, low, high, count, unit = (part.strip() for part in match.groups())
        parameter = _parameter(name)
        if parameter.unit and not unit:
            raise InputError(
                f"axis of {name} must carry a unit, got '{text}'; write it like "
                f"'{name}={low}:{high}:{count} {parameter.unit}'"
            )
        return cls(name, f"{low} {unit}".strip(), f"{high} {unit}".strip(), int(count), log)

    @property
    def unit(self) -> str:
        """SI unit; empty for a pure number."""
        return _parameter(self.name).unit

    @property
    def kind(self) -> str:
        """Kind of parameter, a key of `asperity.units.KINDS`."""
        return _parameter(self.name).kind

    @property
    def values(self) -> Float:
        """The grid in SI, shape (count,)."""
        return self.at(np.linspace(0.0, 1.0, self.count))

    def at(self, u: Any) -> Float:
        """SI values at the fractions `u` of the axis, 0 at its lower and 1 at its upper end."""
        low, high = self._ends
        u = np.asarray(u, dtype=float)
        inner = low * (high / low) ** u if self.log else low + (high - low) * u
        # Rounding may leave the interval by a unit in the last place.
        return np.clip(inner, low, high)

    @property
    def _ends(self) -> tuple[float, float]:
        return float(self.low), float(self.high)


def _parameter(name: str) -> Parameter:
    # A map cannot pass through a switch.
    known = {n: p for n, p in known_parameters().items() if p.rule != "switch"}
    found = canonical_name(str(name), known)
    if found is None:
        raise InputError(
            f"axis must be a number of an operating point, got {shown(name)}; "
            + suggestion(str(name), known)
        )
    return known[found]


def _unit(parameter: Parameter) -> str:
    return f" {parameter.unit}" if parameter.unit else ""
