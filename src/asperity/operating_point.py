"""One operating point from numbers by name: law, machine and drive as tables write them.

The names are those of `asperity.parameters`: the parameters of the law, ``K, W0, M, eta`` of the
machine, ``V, epsilon, frequency`` of the drive, ``inertia`` (1 includes the mass), and
`asperity.parameters.MODULATION` where more than a harmonic load is modulated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Bool, Float, Index
from asperity.errors import Argument, InputError, require, symbol, symbols
from asperity.laws import Law, get_law, registered
from asperity.loads.modulation import lowest_load, modulated
from asperity.materials import load_from
from asperity.orbit import PeriodicResponse, periodic_response
from asperity.parameters import (
    MODULATION,
    Parameter,
    all_parameters,
    canonical_name,
    known_name,
    point_parameters,
)
from asperity.parameters.arguments import shown
from asperity.slider.parameters import slider_from

if TYPE_CHECKING:
    from asperity.materials import Material
    from asperity.questions.point import Point


@dataclass(frozen=True)
class SourcedNumber:
    """A value in SI and its source."""

    value: float
    origin: str


def known_parameters(law: str | None = None) -> dict[str, Parameter]:
    """Parameters of an operating point with any registered law.

    Parameters
    ----------
    law : str, optional
        The law that is used where several have a parameter of the same name.
    """
    laws = list(registered().values())
    return all_parameters(laws if law is None else [get_law(law), *laws])


def sourced_numbers(
    given: Mapping[str, Any],
    material: Material | None,
    origin: str = "given",
    law: str | None = None,
) -> dict[str, SourcedNumber]:
    """Numbers by name: the given numbers, completed by those of the material.

    Parameters
    ----------
    given : mapping of str to str, float or SourcedNumber
        Texts with units; numbers are SI.
    material : Material or None
    origin : str
        Name of the source of the given numbers.
    law : str, optional
        The law that they are for.

    Raises
    ------
    InputError
        If a name is unknown or occurs twice, or a value has the wrong unit or sign.
    """
    known = known_parameters(law)
    numbers: dict[str, SourcedNumber] = {}
    for written, value in given.items():
        field = Argument("numbers", key=written)
        name = known_name(written, known, field)
        require(name not in numbers, field, "be given once", f"{symbol(name)} too", "leave one out")
        if isinstance(value, SourcedNumber):
            numbers[name] = value
            continue
        try:
            result = known[name].check(value)
        except InputError as error:
            raise error.about(field) from None
        one = not np.ndim(result)
        require(one, field, "be one number", shown(value), "give a single value")
        numbers[name] = SourcedNumber(float(result), origin)
    if material is None:
        return numbers
    offered = {
        n: SourcedNumber(material[n].si, material.name)
        for n in known
        # A material has no modulation, even if one of its numbers has such a name.
        if n not in MODULATION
        and n in material
        and material[n].value is not None
        and material[n].dimension == known[n].kind
    }
    return offered | numbers


def numbers_for(
    law_name: str,
    numbers: Mapping[str, SourcedNumber],
    among: Mapping[str, Parameter] | None = None,
    needed: tuple[str, ...] = (),
) -> dict[str, SourcedNumber]:
    """The numbers of a point with this law, selected from `numbers`.

    Parameters
    ----------
    law_name : str
    numbers : mapping of str to SourcedNumber
    among : mapping of str to Parameter, optional
        Parameters that count; by default all of a point with this law.
    needed : tuple of str
        Parameters that must be given, in addition to those without a default.

    Raises
    ------
    InputError
        If the law is unknown or numbers are missing; the message lists all of them.
    """
    law = get_law(law_name)
    known = point_parameters(law) if among is None else among
    missing = [
        name
        for name, parameter in known.items()
        if name not in numbers and (parameter.default is None or name in needed)
    ]
    if missing:
        raise without_numbers(law_name, missing, known)
    return {name: numbers[name] for name in known if name in numbers}


def without_numbers(
    law_name: str, missing: Sequence[str], known: Mapping[str, Parameter]
) -> InputError:
    """The mistake of a point whose law lacks numbers; arguments as of `numbers_for`."""
    like = Argument("numbers", missing[0], known[missing[0]].example)
    advice = f"name a material that has them or give each one, like {like}"
    return InputError(law_name, "have all its numbers", f"none for {symbols(missing)}", advice)


def refuse_foreign(law_name: str, given: Iterable[str]) -> None:
    """Raise `InputError` if a given parameter belongs to other laws only."""
    of_law = point_parameters(get_law(law_name))
    for name in given:
        owners = [
            n for n, law in registered().items() if canonical_name(name, point_parameters(law))
        ]
        holds = not owners or canonical_name(name, of_law)
        got = f"'{symbol(name)}', which belongs to {', '.join(owners)}"
        advice = "leave it out or choose another law"
        require(holds, law_name, "be given its own parameters", got, advice)


def point_numbers(
    point: Point,
    origin: str = "given",
    among: Mapping[str, Parameter] | None = None,
    needed: tuple[str, ...] = (),
) -> dict[str, SourcedNumber]:
    """All numbers of a point in SI, with their sources.

    Parameters
    ----------
    point : Point
    origin : str
        Name of the source of `point.parameters`.
    among, needed
        As in `numbers_for`.

    Raises
    ------
    InputError
        If law or material are unknown, a name belongs to other laws or to nothing, a number is
        missing or breaks its rule, or a given number has no influence.
    """
    numbers = numbers_for(point.law, offered_numbers(point, origin), among, needed)
    if among is None or "inertia" in among:
        require_given_influence(numbers, origin)
    return numbers


def require_given_influence(
    numbers: Mapping[str, SourcedNumber], origin: str, varied: Iterable[str] = ()
) -> None:
    """Refuse a number of the user without influence; those of materials may have none.

    Parameters
    ----------
    numbers : mapping of str to SourcedNumber
    origin : str
        Of the user's numbers.
    varied : iterable of str
        Numbers that have several values.

    Raises
    ------
    InputError
        As `require_influence`.
    """
    given = [name for name, number in numbers.items() if number.origin == origin]
    values = {name: number.value for name, number in numbers.items()}
    require_influence(given, {**values, **dict.fromkeys(varied, 1.0)})


def offered_numbers(point: Point, origin: str = "given") -> dict[str, SourcedNumber]:
    """Numbers of a point of which some come from elsewhere; arguments as of `point_numbers`."""
    if not point.law:
        advice = f"choose one of {', '.join(sorted(registered()))}"
        raise InputError("law", "be given", "nothing", advice)
    refuse_foreign(point.law, point.parameters)
    return sourced_numbers(point.parameters, material_of(point), origin, point.law)


def material_of(point: Point) -> Material | None:
    """The material that a point names, if any."""
    return load_from(point.folder, point.material) if point.material else None


def respond(
    law: type[Law],
    values: Mapping[str, Any],
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> PeriodicResponse:
    """Periodic response at one or many points.

    Parameters
    ----------
    law : type of Law
    values : mapping of str to number or array
        SI values by the names of `point_parameters`. Inertia, damping and elastic asperities
        must be present at all points or at none: see `motions`. The load is harmonic unless one of
        `asperity.parameters.MODULATION` is not 0 at some point.
    progress : callable, optional
        See `periodic_response`.
    **options
        ``methods`` and ``workers`` of `periodic_response`.

    Raises
    ------
    InputError
        If the load of a point does not stay positive: see `lowest_loads`.
    """
    harmonic = not _more_modulated(values).any()
    damped = np.any(np.asarray(values.get("eta", 0.0)) > 0)
    inertia, mass = bool(np.any(values.get("inertia", 0.0))), np.asarray(values.get("M", 0.0))
    if inertia and not (mass > 0).all():
        advice = f"give the mass, like {Argument('numbers', 'M', '1.6 kg')}"
        got = f"{mass.min():g} kg" if "M" in values else "nothing"
        raise InputError(Argument("numbers", "M"), "be positive with inertia", got, advice)
    return periodic_response(
        slider_from(law, values),
        velocity=values["V"],
        epsilon=values["epsilon"] if harmonic else None,
        frequency=values["frequency"],
        modulation=None
        if harmonic
        else modulated(
            values["epsilon"],
            load=_further_harmonics(values),
            **{name: values.get(name, 0.0) for name in ("pull", "pull_phase", "tilt")},
        ),
        inertia=inertia,
        radiation_damping=values["eta"] if damped else None,
        progress=progress,
        **options,
    )


def motions(values: Mapping[str, Float]) -> list[Index]:
    """Groups of points with one equation of motion and one kind of load, as indices.

    The load is harmonic, even in time, which the fast method solves too, or any other.

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
    kinds = kinds + 8 * (_more_modulated(values) + 1 * _not_even(values))
    return [np.flatnonzero(kinds == kind) for kind in np.unique(kinds)]


#: Numbers that count only with another one that is not 0.
_COUNTS_WITH = {
    "M": "inertia",
    **{f"{name}_phase": name for name in ("epsilon2", "epsilon3", "pull")},
}


def lacking(name: str, numbers: Mapping[str, Any]) -> str:
    """The number without which this one has no influence; empty if it has one, or is 0."""
    other = _COUNTS_WITH.get(name, "")
    return other if numbers.get(name) and not numbers.get(other) else ""


def require_influence(names: Iterable[str], numbers: Mapping[str, Any], field: str = "") -> None:
    """Refuse a number on which no response depends, such as M without inertia.

    Parameters
    ----------
    names : iterable of str
        Numbers that vary, or that the user has given.
    numbers : mapping of str to float
        All numbers; one that varies has any value but 0.
    field : str
        A number in messages, of which ``{}`` is the name; by default an argument of its own.

    Raises
    ------
    InputError
    """
    for name in names:
        other = lacking(name, numbers)
        if other:
            like = Argument("numbers", other, "1" if other == "inertia" else "0.1")
            rule, got = (
                f"have an influence, which it has with {symbol(other)}",
                f"{symbol(other)} = 0",
            )
            about = field.format(symbol(name)) if field else Argument("numbers", name)
            raise InputError(about, rule, got, f"add {like}, or leave {symbol(name)} out")


def without_mass(values: Mapping[str, Float]) -> Bool:
    """Points with inertia and no mass."""
    return (np.asarray(values["inertia"]) > 0) & ~(np.asarray(values["M"]) > 0)


def lowest_loads(values: Mapping[str, Float]) -> Float:
    """Lowest W/W0 over the period at each point; the contact is lost where it is not positive."""
    harmonics = _further_harmonics(values)
    # A harmonic load stays positive by the rule of epsilon.
    return lowest_load(values["epsilon"], harmonics) if harmonics else np.ones(len(values["V"]))


def _more_modulated(values: Mapping[str, Any]) -> Bool:
    """Points with a modulation beyond the first harmonic of the load."""
    amplitudes = ("epsilon2", "epsilon3", "pull", "tilt")
    return sum((np.asarray(values.get(n, 0.0)) != 0 for n in amplitudes), np.asarray(False))


def _not_even(values: Mapping[str, Any]) -> Bool:
    """Points at which one of the modulated quantities is not even in time."""
    pairs = [(np.asarray(values.get(n, 0.0)), np.asarray(values.get(f"{n}_phase", 0.0)))
             for n in ("epsilon2", "epsilon3", "pull")]  # fmt: skip
    return sum(((size != 0) & (phase != 0) for size, phase in pairs), np.asarray(False))


def _further_harmonics(values: Mapping[str, Any]) -> dict[int, tuple[Any, Any]]:
    """Harmonics of the load from the second on that any point has."""
    return {
        n: (values[f"epsilon{n}"], values.get(f"epsilon{n}_phase", 0.0))
        for n in (2, 3)
        if np.any(values.get(f"epsilon{n}", 0.0))
    }
