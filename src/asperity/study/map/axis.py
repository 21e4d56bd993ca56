"""An axis of a map: a number of the operating point, its ends and its grid."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError, closest
from asperity.study.operating_point import Quantity, all_quantities

Float = NDArray[np.float64]

_AXIS = re.compile(r"\s*([\w]+)\s*=\s*([^:\s]+)\s*:\s*([^:\s]+)\s*:\s*(\d+)(?:\s+|(?=%))(.*)")
#: Numbers of an operating point that are no quantities: a map cannot pass through them.
_SWITCHES = ("inertia",)


@dataclass(frozen=True)
class Axis:
    """A number that varies along a side of a map.

    Attributes
    ----------
    name : str
        As in `asperity.study.operating_point.quantities`: ``epsilon``, ``K``, ``V``, ``lambda``...
    low, high : float
        Ends in SI; texts with units are converted. ``low < high``.
    count : int
        Points of the grid, at least 2, both ends among them.
    log : bool
        Whether they lie at equal ratios instead of equal distances.

    Raises
    ------
    InputError
        If the name is unknown, an end breaks the rule of its quantity, or the ends and the count
        make no grid.
    """

    name: str
    low: float | str
    high: float | str
    count: int
    log: bool = False

    def __post_init__(self) -> None:
        quantity = _quantity(self.name)
        for end in ("low", "high"):
            object.__setattr__(self, end, float(quantity.check(getattr(self, end))))
        if not self._ends[0] < self._ends[1]:
            raise InputError(
                f"axis of {self.name} must go from a smaller to a larger value, got "
                f"{self.low:g} to {self.high:g}{_unit(quantity)}; write the smaller end first"
            )
        if self.count < 2:
            raise InputError(
                f"axis of {self.name} must have at least 2 points, got {self.count}; "
                "ask for 2 or more"
            )
        if self.log and not self._ends[0] > 0:
            raise InputError(
                f"axis of {self.name} must start above zero to be logarithmic, got "
                f"{self.low:g}{_unit(quantity)}; raise its lower end or make it linear"
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
        quantity = _quantity(name)
        if quantity.unit and not unit:
            raise InputError(
                f"axis of {name} must carry a unit, got '{text}'; write it like "
                f"'{name}={low}:{high}:{count} {quantity.unit}'"
            )
        return cls(name, f"{low} {unit}".strip(), f"{high} {unit}".strip(), int(count), log)

    @property
    def unit(self) -> str:
        """SI unit; empty for a pure number."""
        return _quantity(self.name).unit

    @property
    def kind(self) -> str:
        """Kind of quantity, a key of `asperity.units.KINDS`."""
        return _quantity(self.name).kind

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


def _quantity(name: str) -> Quantity:
    known = {n: q for n, q in all_quantities().items() if n not in _SWITCHES}
    if name not in known:
        raise InputError(
            f"axis must be a number of an operating point, got '{name}'; {closest(name, known)}"
        )
    return known[name]


def _unit(quantity: Quantity) -> str:
    return f" {quantity.unit}" if quantity.unit else ""
