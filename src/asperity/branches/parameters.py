"""Continued parameters by name, and the lines on which one or two of them move.

The operating point of a continuation is checked here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.arrays import between
from asperity.errors import InputError, closest, require
from asperity.laws import Law
from asperity.orbit.mesh.arclength import ParameterLine, still
from asperity.parameters import MODULATION, Parameter, known_name, point_parameters
from asperity.parameters.arguments import number
from asperity.slider import QuasiStatic, Slider
from asperity.slider.parameters import (
    equation_parameters,
    equation_values,
    slider_from,
    slider_values,
    with_value,
)
from asperity.slider.problem import Problem, checked_problem, flatten

#: Spans with a larger ratio of their ends than this are continued on a logarithmic scale.
_LOGARITHMIC = 2.0

#: Arguments that say what the operating point is.
_POINT = ("velocity", "epsilon", "frequency", "modulation", "inertia", "radiation_damping")


@dataclass(frozen=True)
class ContinuedParameter:
    """A parameter that moves from `start` to `end` as the coordinate t goes from 0 to 1.

    Attributes
    ----------
    name : str
    unit : str
        SI unit of the values; "" for a pure number.
    start, end : float
    logarithmic : bool
        Whether the scale is logarithmic.
    """

    name: str
    unit: str
    start: float
    end: float
    logarithmic: bool

    def value(self, t: Any) -> Any:
        """Values at the coordinates `t`."""
        return between(self.start, self.end, np.asarray(t), log=self.logarithmic)


def moving_parameter(
    problem: Problem, name: str, span: Any, field: str = "span"
) -> ContinuedParameter:
    """A parameter of `problem` with its span.

    Raises
    ------
    InputError
        If there is no such parameter, or the span is not two different valid values.
    """
    name = continued_name(type(problem.system.slider.law), name)
    known = equation_parameters(*problem)
    if name not in known:
        rule = "be one that the equations have"
        raise InputError("parameter", rule, f"'{name}'", closest(name, known))
    parameter = known[name]
    # With inertia or damping rigid asperities have other equations than elastic ones.
    one_equation = isinstance(problem.system, QuasiStatic)
    positive = name in ("M", "eta") or (name == "lambda" and not one_equation)
    start, end = (_end(parameter, end, field, positive) for end in span)
    require(start != end, field, "have two different ends", f"{start:g} twice", "give (start, end)")
    ratio = max(start, end) / min(start, end) if min(start, end) > 0 else 0.0
    return ContinuedParameter(
        name, parameter.unit, start, end, name != "epsilon" and ratio > _LOGARITHMIC
    )


def continued_name(law: type[Law], name: str) -> str:
    """The canonical name of a parameter that can be continued.

    Raises
    ------
    InputError
        If neither the law nor the experiment has a parameter of that name.
    """
    rule = "be one that continuation can change"
    advice = "give it as modulation=asperity.loads.modulated(...) and continue in another one"
    require(name not in MODULATION, "parameter", rule, f"'{name}'", advice)
    known = {n: p for n, p in point_parameters(law).items() if p.path}
    return known_name(name, known)


def line_through(
    problem: Problem, parameters: tuple[ContinuedParameter, ...], at: Any, direction: Any
) -> ParameterLine:
    """The line on which the coordinates of `parameters` are `at` + t `direction`.

    Parameters
    ----------
    problem : Problem
        The other parameters, NumPy arrays of shape (1,).
    parameters : tuple of ContinuedParameter
        Different parameters.
    at, direction : sequence of float
    """
    known = equation_parameters(*problem)
    origin, added, growth = problem, still(problem), still(problem)
    for moving, start, step in zip(parameters, at, direction, strict=True):
        parameter = known[moving.name]
        if moving.logarithmic:
            rate = np.array([step * np.log(moving.end / moving.start)])
            # A rate of the logarithm, the same for omega as for the frequency.
            growth = with_value(growth, parameter, rate / parameter.scale)
        else:
            rate = np.array([step * (moving.end - moving.start)])
            added = with_value(added, parameter, rate)
        origin = with_value(origin, parameter, np.array([moving.value(float(start))]))
    return ParameterLine(origin, added, growth)


def _end(parameter: Parameter, value: Any, field: str, positive: bool) -> float:
    """An end of a span, checked by the rule of the parameter."""
    checked = number(value, field, parameter.kind, parameter.rule)
    # 0 in a table means "not included"; a continued parameter must be part of the equations.
    holds, got = not positive or checked > 0, f"{checked:g} {parameter.unit}"
    require(holds, field, f"be positive for {parameter.name}", got, "give a span above zero")
    return checked


def one_problem(arguments: Mapping[str, Any], spans: Mapping[str, Any]) -> Problem:
    """Equations and load of one operating point, parameters of shape (1,).

    Parameters
    ----------
    arguments : dict
        Arguments of `continuation`; further ones are ignored.
    spans : dict
        Spans by the name of the parameter; a continued velocity, epsilon, frequency, damping, mass
        or elastic length has the value at the start of its span.

    Raises
    ------
    InputError
        If a value breaks its rule, one is missing, there are arrays, or there is no parameter of a
        name.
    """
    slider: Slider = arguments["slider"]
    law = type(slider.law)
    point = {name: arguments[name] for name in _POINT}
    moving = {continued_name(law, name): span[0] for name, span in spans.items()}
    # The equations of motion follow from these two.
    starts = {name: moving[name] for name in ("lambda", "M") if name in moving}
    if starts:
        slider = slider_from(law, slider_values(slider) | starts)
    for name, symbol in (("velocity", "V"), ("frequency", "frequency")):
        point[name] = moving.get(symbol, point[name])
        if point[name] is None:
            raise InputError(name, "be given", "None", "or continue in it")
    rule, got = "depend on the velocity to have a branch with bifurcations", law.name
    require(law.rate_dependent, "law", rule, got, "its force is mu W for all parameters")
    if point["modulation"] is None:
        point["epsilon"] = moving.get("epsilon", point["epsilon"])
    point["radiation_damping"] = moving.get("eta", point["radiation_damping"])
    flat, shape = flatten(checked_problem(slider, **point))
    rule, got = "be numbers for a continuation", f"arrays of shape {shape}"
    require(shape in ((), (1,)), "parameters", rule, got, "follow one operating point at a time")
    return flat


def fixed_parameters(problem: Problem, *moving: str) -> dict[str, float]:
    """Parameters of the operating point, SI, without those that move."""
    values = equation_values(*problem).items()
    return {name: float(np.ravel(value)[0]) for name, value in values if name not in moving}
