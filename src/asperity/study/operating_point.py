"""One operating point from numbers by name: law, machine and drive as tables write them.

The names are those of the table's columns: the parameters of the law, ``K, W0, M`` of the machine,
``V, epsilon, frequency`` of the drive.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from asperity.errors import InputError, closest
from asperity.laws import Law, get_law, registered
from asperity.laws.parameter import checked
from asperity.slider import Slider
from asperity.solve import PeriodicResponse, periodic_response
from asperity.solve.periodic import checked_epsilon
from asperity.units import KINDS

if TYPE_CHECKING:
    from asperity.materials import Material


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A number that describes an operating point.

    Attributes
    ----------
    kind : str
        A key of `KINDS`.
    check : callable
        Text with a unit, number or array to SI; raises `InputError` if the value breaks the rule.
    """

    kind: str
    check: Callable[[Any], Any]

    @property
    def unit(self) -> str:
        """SI unit; empty for a pure number."""
        return KINDS[self.kind].si

    @property
    def example(self) -> str:
        """A text that the command line accepts."""
        return KINDS[self.kind].example.split(" or ")[0]


@dataclasses.dataclass(frozen=True)
class Sourced:
    """A value in SI and where it comes from."""

    value: float
    origin: str


def _quantity(name: str, kind: str, rule: str) -> Quantity:
    return Quantity(kind, partial(checked, name=name, kind=kind, rule=rule))


_MACHINE = {
    "K": _quantity("slider.K", "stiffness", "positive"),
    "W0": _quantity("slider.W0", "force", "positive"),
    "M": _quantity("slider.M", "mass", "not negative"),
}
_DRIVE = {
    "V": _quantity("velocity", "velocity", "positive"),
    "epsilon": Quantity("dimensionless", checked_epsilon),
    "frequency": _quantity("frequency", "frequency", "positive"),
}
#: The quasi-static equations do not contain the mass.
_OPTIONAL = frozenset({"M"})


def quantities(law: type[Law]) -> dict[str, Quantity]:
    """Every number that a point with this law can have, in the order of the table's columns."""
    own = {f.name.rstrip("_"): _of_field(f) for f in dataclasses.fields(law)}
    return own | _MACHINE | _DRIVE


def all_quantities() -> dict[str, Quantity]:
    """`quantities` of all registered laws together."""
    found: dict[str, Quantity] = {}
    for law in registered().values():
        found = quantities(law) | found
    return found


def required(law: type[Law]) -> tuple[str, ...]:
    """Names of the numbers without which a point with this law cannot be solved."""
    return tuple(name for name in quantities(law) if name not in _OPTIONAL)


def _of_field(field: dataclasses.Field[Any]) -> Quantity:
    """What `asperity.laws.parameter` declared; a field without declaration is a pure number."""
    check = field.metadata.get("converter")
    if not isinstance(check, partial):
        return _quantity(f"law.{field.name.rstrip('_')}", "dimensionless", "finite")
    return Quantity(check.keywords["kind"], check)


def sourced_numbers(
    given: Mapping[str, str], material: Material | None, origin: str = "given"
) -> dict[str, Sourced]:
    """Numbers by name: those given, and the material's for the rest.

    Parameters
    ----------
    given : mapping of str to str
        Texts with units.
    material : Material or None
    origin : str
        What the result calls the source of the given numbers.

    Raises
    ------
    InputError
        If a name is unknown, or a value has the wrong unit or sign.
    """
    known = all_quantities()
    for name in given:
        if name not in known:
            raise InputError(
                f"parameter must be a known name, got '{name}'; {closest(name, known)}"
            )
    numbers = {n: Sourced(float(known[n].check(text)), origin) for n, text in given.items()}
    if material is None:
        return numbers
    offered = {
        n: Sourced(material[n].si, material.name)
        for n in known
        if n in material and material[n].value is not None
    }
    return offered | numbers


def numbers_for(law_name: str, numbers: Mapping[str, Sourced]) -> dict[str, Sourced]:
    """The numbers that a point with this law has, of those there are.

    Raises
    ------
    InputError
        If the law is unknown or numbers are missing; the message lists all of them.
    """
    law = get_law(law_name)
    missing = [name for name in required(law) if name not in numbers]
    if missing:
        example = f"{missing[0]}={quantities(law)[missing[0]].example}"
        raise InputError(
            f"{law_name} must have all its numbers, got none for {', '.join(missing)}; "
            f"name a material that has them or give each one, like '{example}'"
        )
    return {name: numbers[name] for name in quantities(law) if name in numbers}


def refuse_foreign(law_name: str, given: Mapping[str, str]) -> None:
    """Raise `InputError` if a given parameter belongs to other laws only."""
    own = quantities(get_law(law_name))
    for name in given:
        owners = [n for n, law in registered().items() if name in quantities(law)]
        if name not in own and owners:
            raise InputError(
                f"{law_name} must be given its own parameters, got '{name}', which belongs to "
                f"{', '.join(owners)}; leave it out or choose another law"
            )


def respond(
    law: type[Law],
    values: Mapping[str, Any],
    progress: Callable[[int], None] | None = None,
) -> PeriodicResponse:
    """Periodic response at one or many points.

    Parameters
    ----------
    law : type of Law
    values : mapping of str to number or array
        SI values by the names of `quantities`.
    progress : callable, optional
        See `periodic_response`.
    """
    fields = {f.name: values[f.name.rstrip("_")] for f in dataclasses.fields(law)}
    mass = {"mass": values["M"]} if "M" in values else {}
    slider = Slider(law(**fields), spring=values["K"], load=values["W0"], **mass)
    return periodic_response(
        slider,
        velocity=values["V"],
        epsilon=values["epsilon"],
        frequency=values["frequency"],
        progress=progress,
    )
