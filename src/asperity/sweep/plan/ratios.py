"""Dimensionless numbers that a plan may vary in place of a parameter.

Each determines one parameter from the others of the same point, after all of them have their
values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from asperity.parameters import Parameter

Float = NDArray[np.float64]
Values = Mapping[str, Float]


@dataclass(frozen=True)
class Ratio:
    """A dimensionless number and the parameter that it determines.

    Attributes
    ----------
    parameter : Parameter
        Name, meaning and rule of the number itself.
    target : str
        The parameter that it determines.
    needs : tuple of str
        Parameters that enter.
    solve : callable
        From the values of the point, the number among them, to the target in SI.
    """

    parameter: Parameter
    target: str
    needs: tuple[str, ...]
    solve: Callable[[Values], Float]


def _ratio(
    name: str,
    written: tuple[str, ...],
    meaning: str,
    symbol: str,
    target: str,
    needs: tuple[str, ...],
    solve: Callable[[Values], Float],
) -> Ratio:
    parameter = Parameter(
        name, "dimensionless", "positive", meaning, symbol, "drive", label=name, aliases=written
    )
    return Ratio(parameter, target, needs, solve)


#: By name. A plan may also write the formula.
RATIOS: Mapping[str, Ratio] = MappingProxyType(
    {
        ratio.parameter.name: ratio
        for ratio in (
            _ratio(
                "stiffness_ratio",
                ("K/Kc", "K/K_c"),
                "spring stiffness over the critical one of rigid asperities, K/((B - A) W0/D0)",
                "K/K_c",
                "K",
                ("A", "B", "D0", "W0"),
                lambda p: p["stiffness_ratio"] * (p["B"] - p["A"]) * p["W0"] / p["D0"],
            ),
            _ratio(
                "slip_ratio",
                ("V/(f D0)", "V T/D0"),
                "slip in a period over the memory length, V/(f D0)",
                "V/(f D_0)",
                "frequency",
                ("V", "D0"),
                lambda p: p["V"] / (p["slip_ratio"] * p["D0"]),
            ),
        )
    }
)
