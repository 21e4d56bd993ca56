"""The table of parameters: every number that an operating point depends on, by its one name.

The table is ``table.toml``, which has every output of a periodic response, too. The parameters of a
single law are declared in the file of that law; `law_parameters` reads them from the class, so that
a law written elsewhere has its place in the table as well.
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from asperity.errors import Argument, InputError, closest
from asperity.parameters.arguments import shown
from asperity.parameters.parameter import Output, Parameter


def _frozen(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of a frozen record: lists and tables of TOML that cannot be changed."""
    kinds: dict[type, Any] = {list: tuple, dict: MappingProxyType}
    return {n: kinds[type(v)](v) if type(v) in kinds else v for n, v in fields.items()}


def _parameters(part: str, **shared: Any) -> Mapping[str, Parameter]:
    """The parameters of a part of the table, with fields that they share."""
    table: Mapping[str, Mapping[str, Any]] = _TABLE[part]
    return MappingProxyType(
        {name: Parameter(name, **shared | _frozen(fields)) for name, fields in table.items()}
    )


_TABLE = tomllib.loads(files("asperity.parameters").joinpath("table.toml").read_text("utf-8"))

#: Every output. Convention: F/W0 = mean_friction + sum of mu_n cos(n w t + phase_n).
OUTPUTS: Mapping[str, Output] = MappingProxyType(
    {name: Output(name, **_frozen(fields)) for name, fields in _TABLE["output"].items()}
)

#: Columns that a table of operating points gets.
RESULT_COLUMNS = (
    "mean_friction",
    "delta_mu",
    "mu1",
    "mu2",
    "phase1",
    "phase2",
    "floquet_max",
    "stable",
    "converged",
    "result",
)

#: Parameters that several laws share.
INTERFACE = _parameters("interface")

#: The slider, and what of it counts in the equation of motion.
MACHINE = _parameters("machine")

#: Pulling velocity and modulation.
DRIVE = _parameters("drive")

#: What else may be modulated, 0 where it is not: the arguments of `asperity.loads.modulated`.
#: Angles are in rad. Continuation and fits have a harmonic load and take none of them.
MODULATION = _parameters(
    "modulation", kind="dimensionless", rule="finite", place="drive", default=0.0
)

#: Parameters that belong to no law.
EXPERIMENT: Mapping[str, Parameter] = MappingProxyType({**MACHINE, **DRIVE, **MODULATION})


def plain_name(name: str) -> str:
    """The name of a parameter without what Python or a message puts around it.

    ``lambda_`` is how Python has to write ``lambda``; ``law.D0`` is what messages call ``D0``.
    """
    return name.removeprefix("law.").rstrip("_")


@cache
def law_parameters(law: Any) -> Mapping[str, Parameter]:
    """The parameters of a friction law, as its fields declare them.

    Parameters
    ----------
    law : type of Law
        Registered or not.

    Raises
    ------
    InputError
        If a field has the name of a parameter of the experiment.
    """
    parameters = {}
    for declared in dataclasses.fields(law):
        name = plain_name(declared.name)
        if name in EXPERIMENT:
            rule = "have a name that is free"
            got = f"'{name}', which is the {EXPERIMENT[name].meaning}"
            raise InputError(f"law.{name}", rule, got, f"rename the field of {law.__name__}")
        parameter = declared.metadata.get("parameter")
        # A field without declaration is a pure number.
        parameters[name] = parameter or Parameter(
            name, "dimensionless", "finite", label=f"law.{name}"
        )
        path = f"system.slider.law.{declared.name}"
        parameters[name] = dataclasses.replace(parameters[name], name=name, path=path)
    return MappingProxyType(parameters)


def point_parameters(law: Any) -> dict[str, Parameter]:
    """Every parameter of an operating point with this law, in the order of a table's columns."""
    return {**law_parameters(law), **EXPERIMENT}


def all_parameters(laws: Iterable[Any]) -> dict[str, Parameter]:
    """`point_parameters` of several laws together.

    Where two laws have parameters of the same name, that of the first law stands.
    """
    parameters: dict[str, Parameter] = {}
    for law in laws:
        parameters = {**law_parameters(law), **parameters}
    return {**parameters, **EXPERIMENT}


def required(law: Any) -> tuple[str, ...]:
    """Names of the parameters without which a point with this law cannot be solved."""
    return tuple(name for name, p in point_parameters(law).items() if p.default is None)


def canonical_name(name: str, known: Mapping[str, Parameter]) -> str | None:
    """The one name of a parameter of `known`, by that name or an alias; None if it has none."""
    if name in known:
        return name
    bare = plain_name(name)
    if bare in known:
        return bare
    return next((p.name for p in known.values() if name in p.aliases), None)


def known_name(
    name: str, known: Mapping[str, Parameter], label: str | Argument = "parameter"
) -> str:
    """As `canonical_name`.

    Raises
    ------
    InputError
        If no parameter has that name; the message suggests the nearest one.
    """
    canonical = canonical_name(name, known)
    if canonical is None:
        raise InputError(label, "be a known name", shown(name), suggestion(name, known))
    return canonical


def suggestion(name: str, known: Mapping[str, Parameter]) -> str:
    """``did you mean 'x'?``, or the names there are."""
    meant = [p.name for p in known.values() if name.lower() in p.meant]
    return f"did you mean '{meant[0]}'?" if meant else closest(name, known)
