"""Operating points of a chunk, and the dimensionless ratios from which parameters may follow."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.laws import get_law
from asperity.parameters import Parameter, point_parameters

Float = NDArray[np.float64]
Index = NDArray[np.intp]

#: Memory of a point while it is solved (bytes): measured 1.6 kB for periodic responses and 1.2 kB
#: for stiffness thresholds (largest resident memory, 1e5 to 4e5 points of rice-ruina).
POINT_BYTES = 2000.0


@dataclass(frozen=True)
class Points:
    """Operating points of a chunk, as one-dimensional columns.

    Attributes
    ----------
    laws : str array, shape (points,)
    values : dict of str to array, shape (points,)
        SI numbers by name, NaN where a point has no value.
    data : str array, shape (points,), or None
        Data file of each point; None where no axis varies it.
    """

    laws: NDArray[np.object_]
    values: dict[str, Float]
    data: NDArray[np.object_] | None = None

    def __len__(self) -> int:
        return len(self.laws)

    def take(self, index: Any) -> Points:
        """The points `index`."""
        data = None if self.data is None else self.data[index]
        return Points(self.laws[index], {n: v[index] for n, v in self.values.items()}, data)

    def of_law(self, law: str) -> dict[str, Float]:
        """Values of all parameters of one law, with defaults where a point has no value."""
        of_law = {}
        for name, parameter in point_parameters(get_law(law)).items():
            default = math.nan if parameter.default is None else parameter.default
            values = self.values.get(name, np.full(len(self), default))
            of_law[name] = np.where(np.isnan(values), default, values)
        return of_law

    def by_law(self) -> Iterator[tuple[str, Index]]:
        """The laws of the points, each with the indices of its points."""
        for law in dict.fromkeys(self.laws):
            yield str(law), np.flatnonzero(self.laws == law)


@dataclass(frozen=True)
class Ratio:
    """A dimensionless ratio, and the parameter that it determines with others of the same point.

    Attributes
    ----------
    parameter : Parameter
        Name, meaning and rule of the ratio.
    target : str
        The parameter that the ratio determines.
    needs : tuple of str
        The other parameters in the definition of the ratio.
    solve : callable
        Maps the values of the point, with the ratio, to the target in SI.
    """

    parameter: Parameter
    target: str
    needs: tuple[str, ...]
    solve: Callable[[Mapping[str, Float]], Float]


def _dimensionless(name: str, aliases: tuple[str, ...], meaning: str, symbol: str) -> Parameter:
    return Parameter(
        name, "dimensionless", "positive", meaning, symbol, "drive", label=name, aliases=aliases
    )


#: Ratios by name; their formulas are aliases that a plan may write too.
RATIOS: Mapping[str, Ratio] = MappingProxyType(
    {
        "stiffness_ratio": Ratio(
            _dimensionless(
                "stiffness_ratio",
                ("K/Kc", "K/K_c"),
                "spring stiffness over the critical one of rigid asperities, K/((B - A) W0/D0)",
                "K/K_c",
            ),
            "K",
            ("A", "B", "D0", "W0"),
            lambda p: p["stiffness_ratio"] * (p["B"] - p["A"]) * p["W0"] / p["D0"],
        ),
        "slip_ratio": Ratio(
            _dimensionless(
                "slip_ratio",
                ("V/(f D0)", "V T/D0"),
                "slip in a period over the memory length, V/(f D0)",
                "V/(f D_0)",
            ),
            "frequency",
            ("V", "D0"),
            lambda p: p["V"] / (p["slip_ratio"] * p["D0"]),
        ),
    }
)
