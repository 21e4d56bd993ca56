"""Control parameters by name, and the lines on which one or two of them move."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import numpy as np

from asperity.errors import InputError, closest
from asperity.laws import Law, law_parameters
from asperity.loads import Harmonic
from asperity.slider import Motion
from asperity.solve.continuation.line import Line, still
from asperity.solve.kernels import Problem
from asperity.units import KINDS, to_si

#: Parameters that are not of the law: what they are called, and their kind of quantity.
_KINDS = {
    "epsilon": "dimensionless",
    "frequency": "frequency",
    "velocity": "velocity",
    "K": "stiffness",
    "W0": "force",
    "M": "mass",
    "radiation_damping": "damping",
}
_SYNONYMS = {"V": "velocity", "f": "frequency", "eta": "radiation_damping", "eps": "epsilon"}

#: Spans of a larger ratio than this are walked by equal factors.
_LOGARITHMIC = 2.0


@dataclass(frozen=True)
class Parameter:
    """A parameter that moves from `start` to `end` as the coordinate t goes from 0 to 1.

    Attributes
    ----------
    name : str
    unit : str
        SI unit of the values; "" for none.
    start, end : float
    logarithmic : bool
        Whether it moves by equal factors.
    """

    name: str
    unit: str
    start: float
    end: float
    logarithmic: bool

    def value(self, t: Any) -> Any:
        """Values at the coordinates `t`."""
        if self.logarithmic:
            return self.start * (self.end / self.start) ** np.asarray(t)
        return self.start + (self.end - self.start) * np.asarray(t)

    def coordinate(self, value: Any) -> Any:
        """The inverse of `value`."""
        if self.logarithmic:
            return np.log(np.asarray(value) / self.start) / np.log(self.end / self.start)
        return (np.asarray(value) - self.start) / (self.end - self.start)

    def slope(self, t: Any) -> Any:
        """Derivative of the value by the coordinate."""
        if self.logarithmic:
            return self.value(t) * np.log(self.end / self.start)
        return (self.end - self.start) * np.ones_like(t)


def moving_parameter(problem: Problem, name: str, span: Any, field: str = "span") -> Parameter:
    """A parameter of `problem` with the span it shall move over.

    Raises
    ------
    InputError
        If there is no such parameter, or the span is not two different values it may have.
    """
    name = known_name(type(problem.system.slider.law), name)
    known = _known(problem)
    if name not in known:
        raise InputError(
            f"parameter must be one that the equations have, got '{name}'; {closest(name, known)}"
        )
    kind = _kind(problem, name)
    ends = _ends(name, span, field, kind)
    for end in ends:
        _check(problem, name, end, field)
    unit = KINDS[kind].si
    start, end = ends
    if start == end:
        raise InputError(
            f"{field} must have two different ends, got {start:g} twice; give (start, end)"
        )
    ratio = max(start, end) / min(start, end) if min(start, end) > 0 else 0.0
    return Parameter(name, unit, start, end, name != "epsilon" and ratio > _LOGARITHMIC)


def known_name(law: type[Law], name: str) -> str:
    """The name by which a parameter is known here, synonyms and the like resolved.

    Raises
    ------
    InputError
        If neither the law nor the experiment has one of that name.
    """
    bare = _SYNONYMS.get(name, name).removeprefix("law.").rstrip("_")
    known = [*_KINDS, *law_parameters(law)]
    if bare not in known:
        raise InputError(f"parameter must be a known one, got '{name}'; {closest(name, known)}")
    return bare


def pair_of(span: Any, name: str, field: str) -> tuple[Any, Any]:
    """The two ends of a span.

    Raises
    ------
    InputError
        If there are not two.
    """
    if isinstance(span, str) or np.size(span) != 2:
        raise InputError(f"{field} must be two values of {name}, got {span!r}; give (start, end)")
    return span[0], span[1]


def line_through(
    problem: Problem, parameters: tuple[Parameter, ...], at: Any, direction: Any
) -> Line:
    """The line on which the coordinates of `parameters` are `at` + t `direction`.

    Parameters
    ----------
    problem : Problem
        The other parameters, NumPy arrays of shape (1,).
    parameters : tuple of Parameter
        Different ones.
    at, direction : sequence of float
    """
    origin, added, growth = problem, still(problem), still(problem)
    for parameter, start, step in zip(parameters, at, direction, strict=True):
        scale = _scale(problem, parameter.name)
        value = np.array([parameter.value(float(start)) * scale])
        rate = np.array([step * (parameter.end - parameter.start) * scale])
        if parameter.logarithmic:
            rate = np.array([step * np.log(parameter.end / parameter.start)])
            growth = _placed(growth, parameter.name, rate)
        else:
            added = _placed(added, parameter.name, rate)
        origin = _placed(origin, parameter.name, value)
    return Line(origin, added, growth)


def _scale(problem: Problem, name: str) -> float:
    return 2 * np.pi if name == "frequency" else 1.0


def _known(problem: Problem) -> list[str]:
    system, load = problem
    names = ["velocity", "frequency", "K", "W0"]
    names += ["epsilon"] if isinstance(load, Harmonic) else []
    names += ["M"] if "inertial" in system.name else []
    names += ["radiation_damping"] if hasattr(system, "eta") else []
    return names + [f.name.rstrip("_") for f in dataclasses.fields(system.slider.law)]


def _law_field(system: Motion, name: str) -> Any:
    fields = {f.name.rstrip("_"): f for f in dataclasses.fields(system.slider.law)}
    return fields[name]


def _kind(problem: Problem, name: str) -> str:
    if name in _KINDS:
        return _KINDS[name]
    unit = _law_field(problem.system, name).metadata.get("unit", "")
    return next(kind for kind, k in KINDS.items() if k.si == unit and kind != "angular_frequency")


def _check(problem: Problem, name: str, value: float, field: str) -> None:
    """Whether the parameter may have a value."""
    if name not in _KINDS:
        law = problem.system.slider.law
        dataclasses.replace(law, **{_law_field(problem.system, name).name: value})
    elif name == "epsilon" and not 0 <= value < 1:
        raise InputError(
            f"{field} must stay within 0 <= epsilon < 1, so that contact is never lost, "
            f"got {value:g}; give a span inside"
        )
    elif name != "epsilon" and not value > 0:
        unit = KINDS[_KINDS[name]].si
        raise InputError(
            f"{field} must be positive for {name}, got {value:g} {unit}; give a span above zero"
        )


def _ends(name: str, span: Any, field: str, kind: str) -> tuple[float, float]:
    first, last = (float(np.asarray(to_si(e, kind, field))) for e in pair_of(span, name, field))
    return first, last


def _placed(problem: Problem, name: str, value: Any) -> Problem:
    """The problem with another value of one parameter (omega for the frequency)."""
    system, load = problem
    if name == "epsilon":
        return problem._replace(load=eqx.tree_at(lambda q: q.epsilon, load, value))
    attribute = {"frequency": "omega", "velocity": "V", "radiation_damping": "eta"}.get(name)
    if attribute:
        return problem._replace(system=eqx.tree_at(lambda q: getattr(q, attribute), system, value))
    if name in ("K", "W0", "M"):
        moved = eqx.tree_at(lambda q: getattr(q.slider, name), system, value)
    else:
        field = _law_field(system, name).name
        moved = eqx.tree_at(lambda q: getattr(q.slider.law, field), system, value)
    return problem._replace(system=moved)
