"""Initial guesses of Newton's method, and the averaged limit as the first of them."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.orbit.batches import Indices, points_of, put, run_chunks, take
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import averaged_orbit
from asperity.orbit.mesh.programs import ACCEPTED, solve_on_mesh
from asperity.orbit.mesh.scheme import scheme_for
from asperity.orbit.methods.collocation.inertial_guess import inertial_guess
from asperity.orbit.methods.collocation.refinement import FIRST_MESH
from asperity.orbit.multipliers import chunk_size
from asperity.orbit.outcome import Outcome
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem

Float = NDArray[np.float64]


class InitialGuess(NamedTuple):
    """Orbits on a coarse mesh, and what is known of the points without one.

    Attributes
    ----------
    orbit : Orbit
    found : bool array, shape (points,)
        Which points have an orbit.
    outcome : int array, shape (points,)
        `Outcome` of the others.
    detail : array, shape (points,)
        The number in its sentence; 0 where nothing is known.
    """

    orbit: Orbit
    found: NDArray[np.bool_]
    outcome: NDArray[np.int_]
    detail: Float

    @classmethod
    def none(cls, problem: Problem, points: int, intervals: int = FIRST_MESH) -> InitialGuess:
        """No orbit found yet."""
        system = problem.system
        return cls(
            Orbit.empty(scheme_for(system), system.size, intervals, points),
            np.zeros(points, dtype=bool),
            np.full(points, int(Outcome.NO_ORBIT)),
            np.zeros(points),
        )


def orbits_from_averaged_limit(
    problem: Problem, points: int, index: Indices | None = None
) -> InitialGuess:
    """Orbits by Newton's method from the averaged limit.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    points : int
    index : array of int, optional
        Points to work on; all by default.
    """
    guess = InitialGuess.none(problem, points)
    solve = partial(first_orbit, intervals=FIRST_MESH)
    index = np.arange(points) if index is None else index
    for part, (first, error) in run_chunks(
        solve, problem, index, chunk_size(FIRST_MESH, problem.system.size)
    ):
        good = error < ACCEPTED
        put(guess.orbit, part[good], take(first, np.flatnonzero(good)))
        guess.found[part] = good
    return guess


@partial(jit_large, static_argnames=("intervals",))
def first_orbit(problem: Problem, *, intervals: int) -> tuple[Orbit, Array]:
    """Collocation from the averaged limit, of which only the quasi-static equations are sure."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    guess = averaged_orbit(quasi_static, load, points_of(problem), intervals=intervals, grading=0.5)
    result = solve_on_mesh(Problem(quasi_static, load), guess, 30)
    if not isinstance(system, QuasiStatic):
        result = solve_on_mesh(
            problem, inertial_guess(quasi_static, system, load, result.orbit), 30
        )
    return result.orbit, result.error
