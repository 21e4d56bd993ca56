"""Equations of motion and load of many operating points, from checked numbers.

The equation of motion follows from law, inertia and damping.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import jax
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.arrays import Float
from asperity.errors import InputError, require
from asperity.laws import Law
from asperity.laws.uneven_track import POSITION
from asperity.loads import Harmonic, Modulation
from asperity.loads.consistency import checked_modulation
from asperity.parameters import DRIVE, MACHINE, obeying
from asperity.parameters.arguments import broadcast_shape, typed
from asperity.slider.inertial import Inertial, RadiatingAsperities, StiffInertial
from asperity.slider.motion import Motion
from asperity.slider.quasi_static import QuasiStatic
from asperity.slider.radiation_damping import Radiating
from asperity.slider.slider import Slider

T = TypeVar("T")


def motion_type(*, inertia: bool, damped: bool, elastic: bool) -> type[Motion]:
    """Equation of motion with inertia or not, with radiation damping or not, by its asperities."""
    if inertia:
        return Inertial if elastic else StiffInertial
    if damped:
        return RadiatingAsperities if elastic else Radiating
    return QuasiStatic


@typed
def equation_of_motion(
    slider: Slider,
    V: ArrayLike,
    omega: ArrayLike,
    *,
    inertia: bool = False,
    eta: Array | Float | float | None = None,
) -> Motion:
    """The equation of motion with or without inertia and radiation damping.

    Parameters
    ----------
    slider : Slider
    V, omega : array
        Pulling velocity (m/s) and angular frequency of the modulation (rad/s).
    inertia : bool
        Whether the mass of the slider counts.
    eta : array, optional
        Radiation damping (N s/m), or None.

    Returns
    -------
    Motion

    Raises
    ------
    InputError
        If inertia is included without a mass; if damping without inertia is not positive; if some
        points have elastic asperities and others have none; or if inertia or damping is combined
        with a law that does not depend on the velocity.
    """
    if not inertia and eta is None:
        return QuasiStatic(slider, V, omega)
    rule, got = "depend on the velocity with inertia or radiation damping", slider.law.name
    require(slider.law.rate_dependent, "law", rule, got, "leave both out or choose another law")
    if inertia:
        _require_positive("slider.mass", slider.M, "kg", "give the mass, as mass='1.6 kg'")
    else:
        _require_positive("radiation_damping", eta, "N s/m", "leave it out where there is none")
    kind: Any = motion_type(inertia=inertia, damped=True, elastic=_elastic(slider))
    return kind(slider, V, omega, 0.0 if eta is None else eta)


def _require_positive(name: str, value: ArrayLike | None, unit: str, remedy: str) -> None:
    array = np.asarray(value, float)
    bad = array[~(array > 0)]
    if bad.size:
        raise InputError(name, "be positive", f"{bad.flat[0]:g} {unit}", remedy)


def _elastic(slider: Slider) -> bool:
    """Whether the asperities are elastic; an error if they are at some points only."""
    length = np.asarray(slider.law.elastic_length)
    rule = "be positive at all points or 0 at all points with inertia or radiation damping"
    got, advice = "both: the states differ", "solve the two groups separately"
    require(not np.any(length > 0) or not np.any(length == 0), "law.lambda", rule, got, advice)
    return bool(np.all(length > 0))


def require_even_track(law: Law, motion: str) -> None:
    """Refuse a law whose mu0 varies along the track: it has no steady sliding and no period."""
    rule, got = f"be the same everywhere for {motion}", "one on an uneven track"
    holds = POSITION not in law.state_names
    require(holds, "slider.law", rule, got, "integrate it as a transient")


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
    """Equations and load from the arguments of a response, parameters of any shapes.

    Raises
    ------
    InputError
        If a value breaks its rule; as `equation_of_motion`.
    """
    require_even_track(slider.law, "a periodic response")
    V = DRIVE["V"].check(velocity)
    f = DRIVE["frequency"].check(frequency)
    load = chosen_modulation(epsilon, modulation)
    eta = None
    if radiation_damping is not None:
        # In a table 0 means no damping; as an argument 0 is a mistake.
        eta = obeying(radiation_damping, MACHINE["eta"].label, "damping", "positive")
    return Problem(equation_of_motion(slider, V, 2 * np.pi * f, inertia=inertia, eta=eta), load)


def chosen_modulation(epsilon: Any, modulation: Modulation | None) -> Modulation:
    """The modulation of an amplitude `epsilon`, or the checked `modulation`.

    Raises
    ------
    InputError
        If both or neither are given, or if a value breaks its rule.
    """
    if (epsilon is None) == (modulation is None):
        given = "neither" if epsilon is None else "both"
        advice = "give epsilon for a harmonic load and modulation for any other"
        raise InputError("exactly one of epsilon and modulation", "be given", given, advice)
    if modulation is None:
        return Harmonic(DRIVE["epsilon"].check(epsilon))
    return checked_modulation(modulation)


def flatten(problem: T, name: str = "parameters") -> tuple[T, tuple[int, ...]]:
    """Broadcast all arrays of a problem against each other, the points along one axis.

    Parameters
    ----------
    problem : pytree of arrays
    name : str
        Name of the arrays in messages.

    Returns
    -------
    flat : as `problem`
        With arrays of shape (points,).
    shape : tuple of int

    Raises
    ------
    InputError
        If the shapes do not broadcast, or there is no point.
    """
    shape = broadcast_shape(name, *jax.tree.leaves(problem))
    require(0 not in shape, name, "have a point", f"an array of shape {shape}", "give a value")
    return (
        jax.tree.map(lambda a: np.ravel(np.broadcast_to(np.asarray(a, float), shape)), problem),
        shape,
    )
