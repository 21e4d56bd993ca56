"""Equations of motion and load of many operating points, from checked numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np

from asperity.errors import InputError
from asperity.loads import Harmonic, Modulation
from asperity.loads.consistency import checked_modulation
from asperity.parameters import DRIVE, MACHINE, obeying
from asperity.parameters.arguments import instance, switch
from asperity.slider.formulation import equation_of_motion
from asperity.slider.slider import Slider


class Problem(NamedTuple):
    """Equations and load of many operating points, parameters along the last axis."""

    system: Any
    load: Any


def checked_problem(
    slider: Slider,
    *,
    velocity: Any,
    epsilon: Any,
    frequency: Any,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: Any = None,
) -> Problem:
    """Equations and load of what is asked, parameters of any shapes.

    Raises
    ------
    InputError
        If a value breaks its rule; as `equation_of_motion`.
    """
    checked_slider(slider)
    inertia = switch(inertia, "inertia")
    V = DRIVE["V"].check(velocity)
    f = DRIVE["frequency"].check(frequency)
    load = chosen_modulation(epsilon, modulation)
    eta = None
    if radiation_damping is not None:
        # Zero is no damping in a table; as an argument it would be a mistake.
        eta = obeying(radiation_damping, MACHINE["eta"].label, "damping", "positive")
    return Problem(equation_of_motion(slider, V, 2 * np.pi * f, inertia=inertia, eta=eta), load)


def checked_slider(slider: Any) -> Slider:
    """A slider, and nothing in its place.

    Raises
    ------
    InputError
        For anything else.
    """
    return instance(slider, Slider, "slider", "build one as asperity.Slider(law, spring=, load=)")


def chosen_modulation(epsilon: Any, modulation: Modulation | None) -> Modulation:
    """The modulation asked for, as an amplitude or as a programme.

    Raises
    ------
    InputError
        Unless exactly one of the two is given, or where the amplitude breaks its rule or the
        modulation one of `checked_modulation`.
    """
    if (epsilon is None) == (modulation is None):
        given = "neither" if epsilon is None else "both"
        raise InputError(
            f"exactly one of epsilon and modulation must be given, got {given}; "
            "give epsilon for a harmonic load and modulation for any other"
        )
    if modulation is None:
        return Harmonic(DRIVE["epsilon"].check(epsilon))
    return checked_modulation(modulation)


def flatten(problem: Problem) -> tuple[Problem, tuple[int, ...]]:
    """Broadcast all parameters against each other and lay the points out along one axis."""
    leaves = jax.tree.leaves(problem)
    try:
        shape = np.broadcast_shapes(*(np.shape(leaf) for leaf in leaves))
    except ValueError:
        shapes = sorted({str(np.shape(leaf)) for leaf in leaves if np.shape(leaf)})
        raise InputError(
            f"parameters must have shapes that broadcast, got {', '.join(shapes)}; "
            "give arrays of one shape, or add axes of length 1"
        ) from None
    return (
        jax.tree.map(lambda a: np.ravel(np.broadcast_to(np.asarray(a, float), shape)), problem),
        shape,
    )
