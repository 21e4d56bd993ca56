"""The table of parameters: every number that an operating point depends on, by name.

``table.toml`` has the parameters of the experiment, those that several laws share, and the outputs
of a periodic response. The file of a law declares the parameters of that law alone;
`law_parameters` reads them from the class, also from the class of a user's law.

Tables, figures and messages use the names of the paper or those of geophysics. Keys of JSON,
columns of files and coordinates always have the names of the table.
"""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from asperity.errors import Argument, InputError, closest, require, symbol
from asperity.parameters.arguments import shown, typed
from asperity.parameters.parameter import Names, Output, Parameter


def _frozen(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Fields with immutable values: tuples for lists, read-only mappings for tables."""
    kinds: dict[type, Any] = {list: tuple, dict: MappingProxyType}
    return {n: kinds[type(v)](v) if type(v) in kinds else v for n, v in fields.items()}


def _parameters(part: str, **shared: Any) -> Mapping[str, Parameter]:
    """The parameters of a part of the table, with the fields that all of them share."""
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

#: The slider, and switches of terms in the equation of motion.
MACHINE = _parameters("machine")

#: Pulling velocity and modulation.
DRIVE = _parameters("drive")

#: Further modulations, 0 if absent: the arguments of `asperity.loads.modulated`. Angles are in
#: rad. Continuation and fits have a harmonic load and accept none of these.
MODULATION = _parameters(
    "modulation", kind="dimensionless", rule="finite", place="drive", default=0.0
)

#: Parameters of the experiment, which belong to no law.
EXPERIMENT: Mapping[str, Parameter] = MappingProxyType({**MACHINE, **DRIVE, **MODULATION})


@typed
def plain_name(name: str) -> str:
    """The name of a parameter without additions: ``lambda`` for ``lambda_``, ``D0`` for ``law.D0``.

    ``lambda`` is a keyword of Python; messages call a parameter of a law ``law.NAME``.
    """
    return name.removeprefix("law.").rstrip("_")


@typed
@cache
def law_parameters(law: type) -> Mapping[str, Parameter]:
    """The parameters of a friction law, as its fields declare them.

    Parameters
    ----------
    law : type of Law
        Registered or not.

    Raises
    ------
    InputError
        If it is no such class, or a field is static or has the name of a parameter of the
        experiment.
    """
    require(dataclasses.is_dataclass(law), "law", "be the class of a law", shown(law))
    parameters: dict[str, Parameter] = {}
    for declared in dataclasses.fields(law):
        name = plain_name(declared.name)
        if name in EXPERIMENT:
            rule = "have a name that is free"
            got = f"'{name}', which is the {EXPERIMENT[name].meaning}"
            raise InputError(f"law.{name}", rule, got, f"rename the field of {law.__name__}")
        if declared.metadata.get("static"):
            rule, got = "be a number, as every field of a law", "a static field"
            advice = (
                f"make it a class attribute of {law.__name__}, and write a class for each value"
            )
            raise InputError(f"law.{name}", rule, got, advice)
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


@typed
def all_parameters(laws: Iterable[Any]) -> dict[str, Parameter]:
    """`point_parameters` of several laws together.

    If two laws have parameters of the same name, the first law's is used.
    """
    parameters: dict[str, Parameter] = {}
    for law in laws:
        parameters = {**law_parameters(law), **parameters}
    return {**parameters, **EXPERIMENT}


def required(law: Any) -> tuple[str, ...]:
    """Names of the parameters without which a point with this law cannot be solved."""
    return tuple(name for name, p in point_parameters(law).items() if p.default is None)


@typed
def canonical_name(name: str, known: Mapping[str, Parameter]) -> str | None:
    """The name in `known` of a parameter, from this name or an alias; None if there is none."""
    if name in known:
        return name
    bare = plain_name(name)
    if bare in known:
        return bare
    return next((p.name for p in known.values() if name in p.aliases), None)


@typed
def known_name(
    name: str, known: Mapping[str, Parameter], label: str | Argument = "parameter"
) -> str:
    """As `canonical_name`, but an unknown name is an error.

    Raises
    ------
    InputError
        If no parameter has that name; the message suggests the nearest one.
    """
    canonical = canonical_name(name, known)
    if canonical is None:
        raise InputError(label, "be a known name", shown(symbol(name)), suggestion(name, known))
    return canonical


@typed
def suggestion(name: str, known: Mapping[str, Parameter], otherwise: str = "") -> str:
    """``did you mean 'x'?`` for a name that is known to mean x; else `otherwise`.

    Without `otherwise` the advice is the nearest known name.
    """
    meant = (parameter_named(name), *(n for n, p in known.items() if name.lower() in p.meant))
    for parameter in filter(known.__contains__, meant):
        return f"did you mean '{symbol(parameter)}'?"
    return otherwise or closest(symbol(name), map(symbol, known))


#: Marks of a formula that plain names do not have.
_DECORATIONS = re.compile(r"\\bar|[\\{}]")
#: Words of an expression; ``[B]``, the recording in ``K[B]/W0``, is one word.
_WORDS = re.compile(r"\[.*?\]|[A-Za-z]\w*")


@typed
def symbol_of(parameter: Parameter, names: Names = "friction") -> str:
    """LaTeX symbol of a parameter in a set of names.

    In geophysics this is the first usual name of the parameter, or its symbol if it has none.
    """
    usual = re.match(r"\$([^$=]+)", parameter.geophysics)
    if names == "friction" or usual is None or usual[1].startswith("1/"):
        return parameter.symbol
    return usual[1].strip()


@typed
def display_name(name: str, names: Names = "friction", *laws: type) -> str:
    """A name, or a quotient or difference of names, as plain text in a set of names.

    Parameters
    ----------
    name : str
        Such as ``D0``, ``K/W0`` or ``A - B``; words that are no parameter are unchanged.
    names : {"friction", "geophysics"}
    *laws : type of Law
        Laws whose parameters are renamed, in addition to those that several laws share.
    """
    if names == "friction":
        return name
    known = plain_names(*laws)
    return _WORDS.sub(lambda word: known.get(plain_name(word[0]), word[0]), name)


def parameter_named(name: str, law: Any = None) -> str:
    """The name of a parameter from its name in geophysics: D0 for ``D_c`` or ``Dc``.

    A name that the law itself has is that of its own parameter, as ``k`` of a law of the user.
    """
    laws = () if law is None else (law,)
    if name in all_parameters(laws):
        return name
    known = {_folded(usual): parameter for parameter, usual in plain_names(*laws).items()}
    return known.get(_folded(name), name)


def _folded(name: str) -> str:
    return name.replace("_", "").casefold()


#: Symbols of geophysics by those of figures, in addition to the symbols of `INTERFACE`.
_SYMBOLS = {"F": r"\tau", "W": r"\sigma_n", "W_0": r"\bar\sigma_n", "K": "k", r"\Phi": r"\theta"}


def in_symbols(text: str) -> str:
    """A label of a figure with the symbols of geophysics in its formulas."""
    known = {p.symbol: symbol_of(p, "geophysics") for p in INTERFACE.values()} | _SYMBOLS
    word = re.compile(r"(?<![\\\w{])(?:[A-Z](?:_0)?|\\Phi)(?![\w}])")

    def formula(match: re.Match[str]) -> str:
        return word.sub(lambda symbol: known.get(symbol[0], symbol[0]), match[0])

    return re.sub(r"\$[^$]*\$", formula, text)


@cache
def plain_names(*laws: Any) -> dict[str, str]:
    """Plain names of geophysics by parameter, for parameters whose name differs there."""
    parameters = {**INTERFACE, **all_parameters(laws)}
    return {
        name: _DECORATIONS.sub("", symbol_of(parameter, "geophysics"))
        for name, parameter in parameters.items()
        if symbol_of(parameter, "geophysics") != parameter.symbol and len(name) < 3
    }
