"""One operating point as continuation takes it: checked, with an orbit to begin at."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import numpy as np

from asperity.errors import InputError
from asperity.loads import Harmonic, Modulation
from asperity.slider import Slider
from asperity.solve.continuation.parameters import known_name, pair_of
from asperity.solve.continuation.pursuit import MESHES
from asperity.solve.kernels import Problem
from asperity.solve.mesh import Orbit
from asperity.solve.periodic import checked_problem, flatten
from asperity.solve.starts import orbits_along_branches, starting_orbits


def start_of(slider: Slider, parameter: str, span: Any, field: str = "span") -> dict[str, Any]:
    """The start of a span under the name of its parameter.

    Raises
    ------
    InputError
        If there is no such parameter or a span is not a pair.
    """
    return {known_name(type(slider.law), parameter): pair_of(span, parameter, field)[0]}


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
        "velocity": moving.get("velocity", velocity),
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
        radiation_damping=moving.get("radiation_damping", radiation_damping),
    )
    flat, shape = flatten(asked)
    if shape not in ((), (1,)):
        raise InputError(
            f"parameters must be numbers for a continuation, got arrays of shape {shape}; "
            "follow one operating point at a time"
        )
    return flat


def starting_orbit(problem: Problem) -> Orbit | None:
    """An orbit of the one point of `problem`, however far it has to be fetched."""
    on_host = jax.tree.map(np.asarray, problem)
    start = starting_orbits(on_host, 1)
    for mesh in MESHES:
        if not start.found[0]:
            start, _ = orbits_along_branches(on_host, 1, np.arange(1), mesh)
    return start.orbit if start.found[0] else None


def held_parameters(problem: Problem, *moving: str) -> dict[str, float]:
    """Parameters of the operating point, SI, but for those that move."""
    system, load = problem
    law = system.slider.law
    held = {f.name.rstrip("_"): getattr(law, f.name) for f in dataclasses.fields(law)}
    held |= {"K": system.slider.K, "W0": system.slider.W0, "M": system.slider.M}
    held |= {"radiation_damping": system.eta} if hasattr(system, "eta") else {}
    held |= {"velocity": system.V, "frequency": system.omega / (2 * np.pi)}
    held |= {"epsilon": load.amplitude} if isinstance(load, Harmonic) else {}
    return {name: float(np.ravel(a)[0]) for name, a in held.items() if name not in moving}
