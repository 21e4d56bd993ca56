"""One operating point as continuation takes it: checked, with an orbit to begin at."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np

from asperity.branches.parameters import continued_name, pair_of
from asperity.errors import InputError
from asperity.loads import Modulation
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.methods.starting_orbits import starting_orbits
from asperity.slider import Slider
from asperity.slider.named import equation_parameters, value_of
from asperity.slider.problem import Problem, checked_problem, flatten


def start_of(slider: Slider, parameter: str, span: Any, field: str = "span") -> dict[str, Any]:
    """The start of a span under the name of its parameter.

    Raises
    ------
    InputError
        If there is no such parameter or a span is not a pair.
    """
    return {continued_name(type(slider.law), parameter): pair_of(span, parameter, field)[0]}


def one_problem(
    slider: Slider,
    moving: dict[str, Any],
    *,
    velocity: Any,
    epsilon: Any,
    frequency: Any,
    modulation: Modulation | None,
    inertia: bool,
    radiation_damping: Any,
) -> Problem:
    """Equations and load of one operating point, parameters of shape (1,).

    `moving` has values for those of velocity, epsilon, frequency and damping that are continued.

    Raises
    ------
    InputError
        If a value breaks its rule, one is missing, or there are arrays.
    """
    given = {
        "velocity": moving.get("V", velocity),
        "frequency": moving.get("frequency", frequency),
    }
    for name, value in given.items():
        if value is None:
            raise InputError(f"{name} must be given, got None; or continue in it")
    if not slider.law.rate_dependent:
        raise InputError(
            f"law must depend on the velocity to have a branch with bifurcations, got "
            f"{slider.law.name}; its force is mu W, whatever the parameters"
        )
    amplitude = moving.get("epsilon", epsilon)
    asked = checked_problem(
        slider,
        **given,
        epsilon=amplitude if modulation is None else epsilon,
        modulation=modulation,
        inertia=inertia,
        radiation_damping=moving.get("eta", radiation_damping),
    )
    flat, shape = flatten(asked)
    if shape not in ((), (1,)):
        raise InputError(
            f"parameters must be numbers for a continuation, got arrays of shape {shape}; "
            "follow one operating point at a time"
        )
    return flat


def starting_orbit(problem: Problem, intervals: int) -> Orbit | None:
    """An orbit of the one point of `problem` on a mesh of `intervals`; None where there is none."""
    guess = starting_orbits(jax.tree.map(np.asarray, problem), 1, intervals)
    return guess.orbit if guess.found[0] else None


def held_parameters(problem: Problem, *moving: str) -> dict[str, float]:
    """Parameters of the operating point, SI, but for those that move."""
    named = equation_parameters(*problem)
    values = {name: value_of(problem, p) for name, p in named.items() if name not in moving}
    return {name: float(np.ravel(value)[0]) for name, value in values.items()}
