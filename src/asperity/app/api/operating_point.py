"""The operating point of the Explore and Map tabs: checked values from names and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, PrivateAttr

from asperity.air import AirLayer, effective_modulation, modulation_phase
from asperity.app.api.catalogue import AIR, around, package_material, slider
from asperity.app.endpoints import Question
from asperity.errors import InputError, require
from asperity.laws import get_law, registered
from asperity.materials import Material
from asperity.operating_point import (
    SourcedNumber,
    known_parameters,
    numbers_for,
    refuse_foreign,
    respond,
    sourced_numbers,
)
from asperity.orbit import PeriodicResponse
from asperity.parameters import MODULATION, point_parameters
from asperity.parameters.arguments import one_of
from asperity.units import KINDS

#: A number in a field may exceed the ends of its slider by the first factor; if the slider begins
#: at zero, it may be smaller than the upper end by the second factor. For numbers farther away,
#: searches fail after minutes and numbers overflow.
_BEYOND, _BELOW = 1e4, 1e8

Name = Annotated[str, Field(max_length=60)]
#: SI, or a text with its unit.
Value = bool | Annotated[str, Field(max_length=60)] | float | int


class OperatingPoint(Question):
    """A law, its material, and numbers that replace those of the material.

    Attributes
    ----------
    material : str
        A material of the package.
    law : str
    numbers : mapping of str to number or str
        By the names of `asperity.parameters`; other numbers are those of the material.
    air : mapping of str to number or str, optional
        Numbers of `AIR` that replace those of the material; epsilon is then the applied amplitude,
        of which the air layer bears a share. None: epsilon is the amplitude on the contacts.
    """

    material: Name = "bureau2000"
    law: Name
    numbers: Annotated[dict[Name, Value], Field(max_length=40, default_factory=dict)]
    air: Annotated[dict[Name, Value], Field(max_length=10)] | None = None

    _sourced: dict[str, dict[str, SourcedNumber]] = PrivateAttr(default_factory=dict)

    def chosen_material(self) -> Material:
        """The material, which must be one of the package."""
        return package_material(self.material)

    def sourced(self, law: str | None = None) -> dict[str, SourcedNumber]:
        """Numbers of the point with their sources, for its law or for another law."""
        law = law or self.law
        if law not in self._sourced:
            self._sourced[law] = self._checked(law)
        return self._sourced[law]

    def _checked(self, law: str) -> dict[str, SourcedNumber]:
        known = point_parameters(get_law(law))
        others = {n for result in registered().values() for n in point_parameters(result)}
        given = {n: v for n, v in self.numbers.items() if n in known or n not in others}
        refuse_foreign(law, given)
        for name in given:
            rule, advice = "be left out on the page", "the library and the commands take it"
            require(name not in MODULATION, name, rule, f"{given[name]!r}", advice)
        offered = sourced_numbers(given, self.chosen_material(), "page", law)
        result = numbers_for(law, offered)
        for name in given:
            if name in result:
                self.check_reach(name, result[name].value)
        return result

    def check_reach(self, name: str, value: float) -> None:
        """Refuse a number (SI) that lies too far from the ends of its slider."""
        range_ = slider(name, self.chosen_material())
        if "low" in range_ and known_parameters()[name].rule != "amplitude":
            _check_reach(name, value, range_, known_parameters()[name].kind)

    def values(self, law: str | None = None) -> dict[str, float]:
        """SI values of the numbers."""
        return {name: number.value for name, number in self.sourced(law).items()}

    def air_values(self) -> dict[str, float]:
        """SI values of the air layer's numbers."""
        material = self.chosen_material()
        numbers = dict(self.air or {})
        for name in numbers:
            one_of(name, AIR, "air")
        result = {n: float(p.check(numbers.get(n, material[n].si), n)) for n, p in AIR.items()}
        for name in numbers:
            number = material[name]
            _check_reach(name, result[name], around(number.si), number.dimension)
        return result


def _check_reach(name: str, value: float, range_: Mapping[str, Any], kind: str) -> None:
    low, high = range_["low"] / _BEYOND, range_["high"] * _BEYOND
    low = low or range_["high"] / _BELOW
    if value == 0 or low <= abs(value) <= high:
        return
    low, high, got = (f"{end:.3g} {KINDS[kind].si}".strip() for end in (low, high, value))
    rule = f"be from {low} to {high} on the page"
    raise InputError(name, rule, got, "the library and the commands take others")


def borne_share(point: OperatingPoint, values: Mapping[str, float], frequency: Any) -> Any:
    """The share of the load's modulation that the contacts bear, and its phase (rad)."""
    air = point.air_values()
    layer = AirLayer(P0=air["P0"], h0=air["h0"], eta=air["eta_air"], R=air["R"])
    contact = {"W0": values["W0"], "M": values.get("M", 0.0), "lambda_z": air["lambda_z"]}
    with np.errstate(all="ignore"):  # numbers at the ends of the range have no share
        return (
            effective_modulation(frequency, layer=layer, **contact),
            modulation_phase(frequency, layer=layer, **contact),
        )


def epsilon_on_contacts(point: OperatingPoint, values: Mapping[str, float]) -> float:
    """Relative amplitude of the load on the contacts.

    Raises
    ------
    InputError
        If the amplitude on the contacts is not below 1.
    """
    if point.air is None:
        return values["epsilon"]
    share, _ = borne_share(point, values, values["frequency"])
    result = float(share) * values["epsilon"]
    rule = "have numbers that leave a share of the modulation"
    advice = "bring pressure, gap, radius and viscosity nearer to the material's"
    require(np.isfinite(result), "air", rule, "a share out of range", advice)
    advice = "the air layer and the mass resonate: lower epsilon or change the frequency"
    require(result < 1, "epsilon on the contacts", "be below 1", f"{result:g}", advice)
    return result


def solve(law: str, values: Mapping[str, float], epsilon: Any, **options: Any) -> PeriodicResponse:
    """Periodic response of one point, or of several amplitudes."""
    numbers = {**values, "epsilon": np.asarray(epsilon, dtype=float)}
    return respond(get_law(law), numbers, **options)
