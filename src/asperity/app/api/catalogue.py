"""The catalogue of the page: materials, laws with their equations, parameters with units.

Names, units, rules and defaults come from `asperity.parameters`, values from the materials.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert

from asperity import materials
from asperity._version import __version__
from asperity.air.layer import LAYER
from asperity.air.normal_contact import LAMBDA_Z
from asperity.app.words import LABELS
from asperity.errors import require_known
from asperity.laws import registered
from asperity.materials import Material
from asperity.materials.material import packaged
from asperity.operating_point import known_parameters
from asperity.outputs.json import to_json
from asperity.parameters import (
    MODULATION,
    OUTPUTS,
    Parameter,
    display_name,
    point_parameters,
    required,
    symbol_of,
)
from asperity.parameters.parameter import plain_text
from asperity.units import KINDS, to_si

#: The documentation of a clone, once ``make docs`` has built it.
DOCS = Path(__file__).parents[4] / "docs" / "_build" / "html"

#: Numbers of the air layer and of the contacts, by their names in materials.
AIR = {**LAYER, "lambda_z": LAMBDA_Z}

#: Range of a slider whose material has no range for its number: the first factor on both sides of a
#: pure number, the second on both sides of a quantity with a unit. A slider that begins at zero
#: ends at the third factor times its number.
_PURE, _WITH_UNIT, _FROM_ZERO = 10.0, 100.0, 4.0


@cache
def as_json() -> str:
    """The catalogue."""
    return to_json(
        {
            "version": __version__,
            "docs": DOCS.is_dir(),
            "labels": LABELS,
            "kinds": {
                name: {"si": kind.si, "ladder": kind.ladder, "example": kind.example}
                for name, kind in KINDS.items()
            },
            "materials": {name: _material(materials.load(name)) for name in sorted(packaged())},
            "laws": {name: _law(name) for name in registered()},
            "geophysics": {
                name: usual
                for name in known_parameters()
                if (usual := display_name(name, "geophysics")) != name
            },
            "outputs": {
                name: {"unit": o.unit, "meaning": o.meaning, "symbol": mathml(o.symbol)}
                for name, o in OUTPUTS.items()
            },
        }
    )


@cache
def package_material(name: str, field: str = "material") -> Material:
    """A material of the package; a request cannot name another file."""
    require_known(name, packaged(), field, "be a known material")
    return materials.load(name)


def mathml(latex: str, *, display: bool = False) -> str:
    """A formula as a ``<math>`` element; empty for an empty formula."""
    if not latex:
        return ""
    result: str = convert(latex, display="block" if display else "inline")
    return result


def _law(name: str) -> dict[str, Any]:
    law = registered()[name]
    known = point_parameters(law)
    return {
        "title": (law.__doc__ or name).strip().splitlines()[0].split(";")[0].rstrip("."),
        # Of the class itself: a law derived from another law states different equations.
        "equations": [mathml(e, display=True) for e in vars(law).get("equations", ())],
        "source": [key.strip() for key in law.source.split(",") if key.strip()],
        "rate_dependent": law.rate_dependent,
        "required": required(law),
        "parameters": [_parameter(p) for p in known.values() if p.name not in MODULATION],
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "kind": parameter.kind,
        "rule": parameter.rule,
        "meaning": plain_text(parameter.meaning),
        "symbol": mathml(parameter.symbol),
        "geophysics": mathml(symbol_of(parameter, "geophysics")),
        "place": parameter.place,
        "default": parameter.default,
        "example": to_si(parameter.example, parameter.kind, parameter.name),
    }


def _material(material: Material) -> dict[str, Any]:
    numbers = {n: material[n] for n in material.numbers if material[n].value is not None}
    return {
        "title": material.title,
        "source": material.source,
        "numbers": {
            name: {"value": number.si, "kind": number.dimension, "shown": str(number),
                   "origin": number.kind, "place": number.place}
            for name, number in numbers.items()
        },
        "sliders": {
            name: slider(name, material)
            for name in known_parameters()
            if name not in MODULATION
        },
        "air": [
            {"name": name, "kind": number.kind, "rule": number.rule,
             "symbol": mathml(number.symbol), "meaning": number.meaning, "value": material[name].si,
             "slider": around(material[name].si)}
            for name, number in AIR.items()
            if name in numbers
        ],
    }  # fmt: skip


def slider(name: str, material: Material) -> dict[str, Any]:
    """Start value and ends of the slider of a parameter, and whether its scale is logarithmic."""
    parameter = known_parameters()[name]
    kind = parameter.kind
    value = to_si(parameter.example, kind, name) if parameter.default is None else parameter.default
    if name in material and material[name].dimension == kind and material[name].value is not None:
        value = material[name].si
    span = None
    if f"{name}_range" in material and material[f"{name}_range"].dimension == kind:
        span = material[f"{name}_range"].si_range
    if parameter.rule == "switch":
        return {"value": value}
    if parameter.rule == "amplitude":
        return {"value": value, "low": 0.0, "high": span[1] if span else 0.9, "log": False}
    if parameter.rule == "positive":
        factor = _WITH_UNIT if parameter.unit else _PURE
        result = {"low": span[0], "high": span[1], "log": True} if span else around(value, factor)
        return {"value": value, **result}
    size = abs(value) or to_si(parameter.example, kind, name)
    return {"value": value, "low": 0.0, "high": _FROM_ZERO * size, "log": False}


def around(value: float, factor: float = _WITH_UNIT) -> dict[str, Any]:
    """Ends of a slider by a factor on both sides of a value."""
    return {"low": value / factor, "high": value * factor, "log": True}
