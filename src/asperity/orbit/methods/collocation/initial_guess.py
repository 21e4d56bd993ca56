"""Initial guesses of Newton's method, and the averaged limit as the first of them.

With inertia or radiation damping the first guess is the quasi-static orbit.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.orbit.batches import Indices, mesh_chunk, points_of, put, run_chunks, take
from asperity.orbit.mesh.mesh import GAUSS, Orbit, evaluate, graded_mesh, scheme_for
from asperity.orbit.mesh.newton import ACCEPTED, solve
from asperity.orbit.mesh.remeshing import FIRST_MESH
from asperity.orbit.outcome import Outcome
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem
from asperity.theory.averaged import averaged_limit

Float = NDArray[np.float64]

#: Grading of the first mesh towards the weakest contact, and Newton steps on it.
_GRADING, _NEWTON_STEPS = 0.5, 30


class InitialGuess(NamedTuple):
    """Orbits on a coarse mesh, and outcomes of the points without an orbit.

    Attributes
    ----------
    orbit : Orbit
    solved : bool array, shape (points,)
        Which points have an orbit.
    outcome : int array, shape (points,)
        `Outcome` of the points without an orbit.
    detail : array, shape (points,)
        The number in its sentence; 0 where nothing is known.
    """

    orbit: Orbit
    solved: NDArray[np.bool_]
    outcome: NDArray[np.int_]
    detail: Float

    @classmethod
    def none(cls, problem: Problem, points: int, intervals: int = FIRST_MESH) -> InitialGuess:
        """No orbit yet."""
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
    index = np.arange(points) if index is None else index
    chunk = mesh_chunk(problem.system.size)
    for part, (first, error) in run_chunks(_first_orbit, (problem,), index, chunk):
        good = error < ACCEPTED
        put(guess.orbit, part[good], take(first, np.flatnonzero(good)))
        guess.solved[part] = good
    return guess


def _first_orbit(problem: Problem) -> tuple[Orbit, Float]:
    """Collocation from the averaged limit, of which only the quasi-static equations are sure."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    centre = np.asarray(_averaged_states(Problem(quasi_static, load)))
    size, points = centre.shape
    bare = Orbit.empty(GAUSS, size, FIRST_MESH, points)
    mesh = graded_mesh(FIRST_MESH, points, _GRADING)
    guess = bare.moved(mesh=mesh, centre=centre)
    result = solve(Problem(quasi_static, load), guess, _NEWTON_STEPS)
    if not isinstance(system, QuasiStatic):
        result = solve(problem, inertial_guess(problem, result.orbit), _NEWTON_STEPS)
    return result.orbit, result.error


@jit_large
def _averaged_states(sliding: Problem) -> Array:
    """The averaged limit, (size, points), from samples where collocation has them."""
    points = points_of(sliding)
    mesh = graded_mesh(FIRST_MESH, 1, _GRADING)
    widths = np.diff(mesh, axis=0)
    theta = mesh[:-1] + GAUSS.c[:, None, None] * widths
    weights = (GAUSS.b[:, None, None] * widths).ravel() / (2 * np.pi)
    at = sliding.load.at(theta.reshape(-1, 1) * jnp.ones(points))
    samples = jax.tree.map(lambda a: a.reshape(-1, points) if jnp.ndim(a) else a, at)
    return jnp.stack(averaged_limit(sliding.system, samples, weights).centre)


@jit_large
def _converted(problem: Problem, states: Array, slopes: Array, theta: Array) -> tuple[Array, Array]:
    """States of the problem from quasi-static ones, (size, ..., points), and their slopes."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)

    def convert(Y: Array, theta: Array) -> Array:
        at = load.at(theta)
        mechanical = system.mechanical_states(
            quasi_static.friction(Y, at),
            quasi_static.slider_velocity(Y, at),
            quasi_static.log_slip(Y, at),
            at,
        )
        return jnp.stack([*mechanical, *quasi_static.law_state(Y)])

    return jax.jvp(convert, (states, theta), (slopes, jnp.ones_like(theta)))


def inertial_guess(problem: Problem, orbit: Orbit) -> Orbit:
    """A quasi-static orbit as a first guess of another equation of motion, NumPy arrays."""
    theta = np.concatenate([orbit.mesh[None, :-1], orbit.stage_phases])
    inside, slopes = evaluate(orbit, theta.reshape(-1, theta.shape[-1]))
    shape = (len(inside), *theta.shape)
    sliding = orbit.centre[:, None, None] + inside.reshape(shape)
    converted = _converted(problem, sliding, slopes.reshape(shape), theta)
    states, slopes = (np.asarray(a) for a in converted)
    nodes = states[:, 0]
    # An interface that sticks has no finite logarithm of its slip rate.
    with np.errstate(invalid="ignore"):
        deviations = nodes - nodes[:, :1]
    scheme = scheme_for(problem.system)
    return Orbit(orbit.mesh, nodes[:, 0], deviations, slopes[:, 1:], scheme)
