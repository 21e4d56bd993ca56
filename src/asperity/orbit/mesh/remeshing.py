"""Equidistribution of the collocation error: new meshes, and orbits solved on them.

The meshes of all methods are one ladder, each with three times the intervals of the one before.
"""

from __future__ import annotations

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.orbit.mesh.equations import collocated
from asperity.orbit.mesh.mesh import Orbit, equidistributed
from asperity.orbit.mesh.newton import ACCEPTED, least_swing, solve
from asperity.orbit.mesh.reading import read_orbit
from asperity.orbit.observables import Observables
from asperity.slider.pointwise import PointValues
from asperity.slider.problem import Problem

Float = NDArray[np.float64]

#: Numbers of intervals.
MESHES = (72, 216, 648, 1944)
FIRST_MESH = MESHES[0]

#: Largest number of attempts: a new mesh, and Newton's method on it.
_ROUNDS = 4
_NEWTON_STEPS = 15


def remeshed(problem: Problem, orbit: Orbit, intervals: int) -> Orbit:
    """The orbit on an equidistributed mesh of `intervals` intervals, NumPy arrays."""
    with np.errstate(all="ignore"):
        scales = _error_scales(problem, orbit, collocated(problem, orbit))
        return equidistributed(orbit, scales, intervals)


def _error_scales(problem: Problem, orbit: Orbit, values: PointValues) -> Float:
    """Weight of each state's error, shape (size, intervals, points): what it does to the slip."""
    system = problem.system
    scales = np.abs(values.slip_gradient).mean(1)
    swing = np.abs(orbit.nodes).max(1) + least_swing(system, orbit.nodes.shape[-1])
    for i in range(len(scales)):
        if i in system.linear:
            # A force or velocity without influence on slip: errors relative to its range.
            scales[i] = np.where(scales[i] > 0, scales[i], 1 / swing[i])
        else:
            # Errors of logarithmic states count directly, not only by their effect on slip.
            scales[i] = np.maximum(scales[i], 1.0)
    return scales


def refined_orbit(
    problem: Problem, guess: Orbit, *, intervals: int, harmonics: int
) -> tuple[Orbit, Observables, Float]:
    """The orbit on an equidistributed mesh of `intervals`, its observables and last Newton change.

    Where Newton's method failed, the orbit is the guess on the new mesh, a better initial guess for
    a finer one than the last iterate.
    """
    first = mesh = remeshed(problem, guess, intervals)
    result = solve(problem, mesh, _NEWTON_STEPS)
    best, error = result.orbit, result.error
    for _ in range(_ROUNDS - 1):
        if (error < ACCEPTED).all():
            break
        # A failed attempt still improves the mesh where the orbit is steep.
        mesh = remeshed(problem, _where(np.isfinite(error), best, mesh), intervals)
        result = solve(problem, mesh, _NEWTON_STEPS)
        done = error < ACCEPTED
        best = _where(done, best, result.orbit)
        error = np.where(done, error, result.error)
    orbit = _where(error < ACCEPTED, best, first)
    return orbit, read_orbit(problem, orbit, harmonics), error


def _where(condition: NDArray[np.bool_], yes: Orbit, no: Orbit) -> Orbit:
    return jax.tree.map(lambda a, b: np.where(condition, a, b), yes, no)
