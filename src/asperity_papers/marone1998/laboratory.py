"""The paper's interfaces on its springs: what the checks and the figures compute with."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from asperity.experiment import Holds, hold_response
from asperity.laws import RiceRuina
from asperity.materials import Material
from asperity.parameters import typed

Float = NDArray[np.float64]
Numbers = dict[str, float]

#: The paper's laws by the names of the library, with its letters for them.
AGEING, SLIP, PRZ = "rice-ruina", "ruina-slip", "perrin-rice-zheng"
LAWS = {AGEING: "D", SLIP: "R", PRZ: "PRZ"}
DECADE = float(np.log(10))


def by_law(value: Callable[[str], Any]) -> Numbers:
    """A number of each law, under the paper's letter for it."""
    return {letter: float(value(name)) for name, letter in LAWS.items()}


def by_time(times: Float, values: Float, prefix: str = "") -> Numbers:
    """Numbers at several times (s), under names such as ``"10 s"``."""
    return {f"{prefix}{t:g} s": float(v) for t, v in zip(times, values, strict=True)}


@cache
def scans() -> dict[str, Any]:
    """Readings of the printed figures."""
    return tomllib.loads(files(__package__).joinpath("scans.toml").read_text(encoding="utf-8"))


def scan(figure: str, name: str, *index: float) -> Any:
    """A reading of a printed figure."""
    reading = scans()[figure][name]
    for n in index:
        reading = reading[int(n)]
    return reading


@typed
class Laboratory:
    """The interfaces of Figures 2, 3 and 5 with the paper's numbers.

    Parameters
    ----------
    numbers : Material
    """

    #: Names for formulas of claims.toml.
    terms: ClassVar = {"scan": scan}

    def __init__(self, numbers: Material) -> None:
        self.numbers = numbers
        self.soft = numbers.k_soft, numbers.V_soft
        self.stiff = numbers.k_stiff, numbers.V_stiff

    def pair(self, name: str) -> tuple[float, float]:
        """Two values, or the ends of a range, of one of the paper's numbers."""
        number = self.numbers[name]
        first, second = number.si_values or number.si_range or ()
        return first, second

    def granite(self, name: str, **changes: Any) -> RiceRuina:
        """Bare granite of Figure 3."""
        law = self.numbers.law(name, **changes)
        assert isinstance(law, RiceRuina)  # all three laws share its parameters
        return law

    def illustration(self, name: str) -> RiceRuina:
        """The interface of Figure 2."""
        p = self.numbers
        return self.granite(name, A=p.A_2, B=p.B_2, D0=p.D0_2)

    def gouge(self) -> RiceRuina:
        """Quartz gouge of Figure 5, with the memory length of granite: its own is not printed."""
        p = self.numbers
        return self.granite(AGEING, A=p.B_5 - p.B_less_A_5, B=p.B_5)

    def holds(self, name: str, k: Any, V: Any, time: Any, **changes: Any) -> Holds:
        """Holds of granite at stiffness (1/m), velocity (m/s) and hold times (s), as arrays."""
        law = self.granite(name, **changes)
        return hold_response(law, hold_time=time, velocity=V, stiffness=k, settling=False)

    def healing(self, name: str, k: Any, V: Any, time: Any, **changes: Any) -> Float:
        """Static friction above the level of sliding."""
        return self.holds(name, k, V, time, **changes).healing

    def slope(self, name: str, k: Any, V: Any, low: float, high: float, **changes: Any) -> Float:
        """Healing per decade between two hold times (s), one slope for each `k` and `V`."""
        pair = self.healing(name, np.asarray(k)[..., None], V, np.array([low, high]), **changes)
        return np.asarray(np.diff(pair)[..., 0] / np.log10(high / low))
