"""One operating point from numbers by name: law, machine and drive as tables write them.

The names are those of the table's columns: the parameters of the law, ``K, W0, M, eta`` of the
machine, ``V, epsilon, frequency`` of the drive, and ``inertia``, 1 where the mass counts.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

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
    default : float or None
        What holds where nothing is given; None where something must be.
    words : mapping of str to float
        Texts that stand for numbers.
    """

    kind: str
    check: Callable[[Any], Any]
    default: float | None = None
    words: Mapping[str, float] = dataclasses.field(default_factory=dict)

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


def _quantity(name: str, kind: str, rule: str, default: float | None = None) -> Quantity:
    return Quantity(kind, partial(checked, name=name, kind=kind, rule=rule), default)


_WORDS = {"true": 1.0, "yes": 1.0, "false": 0.0, "no": 0.0}


def _switch(value: Any) -> Any:
    """1 or 0, or a word for it."""
    array = np.asarray(
        _WORDS.get(value.strip().lower(), value) if isinstance(value, str) else value
    )
    try:
        numbers = array.astype(float)
    except ValueError:
        numbers = np.array(np.nan)
    bad = array[~np.isin(numbers, (0.0, 1.0))]
    if bad.size:
        raise InputError(
            f"inertia must be 1 or 0, got {bad.flat[0]}; write 1 where the mass counts, 0 elsewhere"
        )
    return numbers


_MACHINE = {
    "K": _quantity("slider.K", "stiffness", "positive"),
    "W0": _quantity("slider.W0", "force", "positive"),
    "M": _quantity("slider.M", "mass", "not negative", 0.0),
    "eta": _quantity("radiation_damping", "damping", "not negative", 0.0),
}
_DRIVE = {
    "V": _quantity("velocity", "velocity", "positive"),
    "epsilon": Quantity("dimensionless", checked_epsilon),
    "frequency": _quantity("frequency", "frequency", "positive"),
    "inertia": Quantity("dimensionless", _switch, 0.0, _WORDS),
}


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
    return tuple(name for name, q in quantities(law).items() if q.default is None)


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
        SI values by the names of `quantities`. Inertia, damping and elastic asperities
        must count at all points or at none: see `motions`.
    progress : callable, optional
        See `periodic_response`.
    """
    fields = {f.name: values[f.name.rstrip("_")] for f in dataclasses.fields(law)}
    slider = Slider(law(**fields), spring=values["K"], load=values["W0"], mass=values.get("M", 0.0))
    damped = np.any(np.asarray(values.get("eta", 0.0)) > 0)
    return periodic_response(
        slider,
        velocity=values["V"],
        epsilon=values["epsilon"],
        frequency=values["frequency"],
        inertia=bool(np.any(values.get("inertia", 0.0))),
        radiation_damping=values["eta"] if damped else None,
        progress=progress,
    )


def motions(values: Mapping[str, NDArray[np.float64]]) -> list[NDArray[np.intp]]:
    """Groups of points with one equation of motion, as indices.

    Parameters
    ----------
    values : mapping of str to array, shape (points,)
        As for `respond`.
    """
    rows = len(values["V"])
    traits = [np.asarray(values.get(n, np.zeros(rows))) > 0 for n in ("inertia", "eta", "lambda")]
    kinds = sum(trait * 2**i for i, trait in enumerate(traits))
    # Without inertia and damping elastic and rigid asperities share their equation.
    kinds = np.where(kinds % 4 == 0, 0, kinds)
    return [np.flatnonzero(kinds == kind) for kind in np.unique(kinds)]


def without_mass(values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.bool_]:
    """Points that ask for inertia and have no mass."""
    return (np.asarray(values["inertia"]) > 0) & ~(np.asarray(values["M"]) > 0)
