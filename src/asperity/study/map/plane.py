"""The plane of a map: two axes, the fixed numbers, and responses at positions on the plane."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.arrays import Float, between
from asperity.errors import InputError, require, symbol
from asperity.laws import Law
from asperity.operating_point import known_parameters, require_influence, without_mass
from asperity.parameters import Parameter, canonical_name, suggestion
from asperity.parameters.arguments import number, shown, typed
from asperity.study.crossings import STABILITY
from asperity.study.points import Answers
from asperity.study.responses import answers_of_law

#: Names of the numbers on the grid that a figure can show.
SHOWN = (
    *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"),
    *("floquet_max", "log_multiplier", "mode_frequency", "growth_rate"),
)
#: Outputs of each point that a map keeps.
OUTPUTS = tuple(dict.fromkeys((*SHOWN, *STABILITY)))

#: Most points of an axis.
_MOST = 100_000_000

_AXIS = re.compile(r"\s*([\w]+)\s*=\s*([^:\s]+)\s*:\s*([^:\s]+)\s*:\s*(\d{1,99})(?:\s+|(?=%))(.*)")


@typed
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
        Number of points with both ends, at least 2.
    log : bool
        Whether the points lie at equal ratios instead of equal distances.

    Raises
    ------
    InputError
        If the name is unknown, an end breaks the rule of its parameter, or the ends or the count
        are invalid.
    """

    name: str
    low: float | str
    high: float | str
    count: int
    log: bool = False

    def __post_init__(self) -> None:
        parameter = _parameter(self.name)
        object.__setattr__(self, "name", parameter.name)
        label = f"axis of {symbol(self.name)}"
        for end in ("low", "high"):
            # An angle is also a text in degrees.
            value = parameter.check(getattr(self, end), label)
            object.__setattr__(self, end, number(value, label, parameter.kind, parameter.rule))
        low, high = self._ends
        unit = f" {parameter.unit}" if parameter.unit else ""
        rule, got = "go from a smaller to a larger value", f"{low:g} to {high:g}{unit}"
        require(low < high, label, rule, got, "write the smaller end first")
        rule, advice = f"have 2 to {_MOST:,} points", "write another number"
        require(2 <= self.count <= _MOST, label, rule, shown(self.count), advice)
        rule, advice = "start above zero to be logarithmic", "raise its lower end or make it linear"
        require(not self.log or low > 0, label, rule, f"{low:g}{unit}", advice)

    @classmethod
    @typed
    def parse(cls, text: str, log: bool = False, label: str = "axis") -> Axis:
        """Read ``NAME=LOW:HIGH:COUNT UNIT``, as ``K=0.05:0.5:200 N/um``; messages call it `label`.

        Raises
        ------
        InputError
            If the text has another form, or as for `Axis`.
        """
        match = _AXIS.fullmatch(text + " ")
        if match is None:
            advice = f"write it like '{symbol('K')}=0.05:0.5:200 N/um' or 'epsilon=0.01:0.5:200'"
            raise InputError(label, "be NAME=LOW:HIGH:COUNT UNIT", f"'{text}'", advice)
        name, low, high, count, unit = (part.strip() for part in match.groups())
        parameter = _parameter(name)
        advice = f"write it like '{symbol(name)}={low}:{high}:{count} {parameter.unit}'"
        field = f"axis of {symbol(name)}"
        require(not parameter.unit or unit, field, "carry a unit", f"'{text}'", advice)
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
        # Rounding may leave the interval by a unit in the last place.
        return np.clip(between(low, high, np.asarray(u, dtype=float), log=self.log), low, high)

    @property
    def _ends(self) -> tuple[float, float]:
        return float(self.low), float(self.high)


def _parameter(name: str) -> Parameter:
    # A switch such as inertia cannot vary along an axis.
    known = {n: p for n, p in known_parameters().items() if p.rule != "switch"}
    name_in_table = canonical_name(str(name), known)
    if name_in_table is None:
        rule = "be a number of an operating point"
        raise InputError("axis", rule, shown(symbol(name)), suggestion(str(name), known))
    return known[name_in_table]


@dataclass(frozen=True)
class MapPlane:
    """Two axes and the fixed numbers of a map.

    Attributes
    ----------
    law : type of Law
    fixed : mapping of str to float
        SI numbers by name: all parameters of the operating point that are not on an axis.
    x, y : Axis
    """

    law: type[Law]
    fixed: Mapping[str, float]
    x: Axis
    y: Axis

    def __post_init__(self) -> None:
        axes = (self.x.name, self.y.name)
        require_influence(axes, {**self.fixed, **dict.fromkeys(axes, 1.0)}, "axis of {}")

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        return self.y.count, self.x.count

    def nodes(self) -> Float:
        """Positions of the grid's points, shape (rows x columns, 2), row by row."""
        u = np.linspace(0.0, 1.0, self.x.count)
        v = np.linspace(0.0, 1.0, self.y.count)
        return np.stack([a.ravel() for a in np.meshgrid(u, v)], axis=-1)

    def values(self, where: Float) -> dict[str, Float]:
        """Numbers of the operating points at positions on the plane, in SI.

        Parameters
        ----------
        where : array, shape (points, 2)
            Fractions of the x and of the y axis.
        """
        points = len(where)
        values = {name: np.full(points, float(value)) for name, value in self.fixed.items()}
        values[self.x.name] = self.x.at(where[:, 0])
        values[self.y.name] = self.y.at(where[:, 1])
        rule = "be positive where inertia is included"
        require(not without_mass(values).any(), "M", rule, "0 kg", "give the mass, as M='1.6 kg'")
        return values

    def solve(self, where: Float, progress: Callable[[int], None] | None = None) -> Answers:
        """Responses at positions on the plane.

        Parameters
        ----------
        where : array, shape (points, 2)
            As for `values`.
        progress : callable, optional
            Called with the number of points finished since the last call.
        """
        return answers_of_law(self.law, self.values(where), OUTPUTS, progress)
