"""Where Newton's method starts: the averaged limit, and paths to points that it does not reach."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, put, run_chunks, take
from asperity.solve.homotopy import along_amplitude, along_frequency, follow
from asperity.solve.kernels import ACCEPTED, Problem, first_orbit, stiffness_of_steady_sliding
from asperity.solve.mesh import Orbit
from asperity.solve.refinement import MESHES, chunk_size
from asperity.solve.scheme import scheme_for

Float = NDArray[np.float64]

_INTERVALS = MESHES[0]
#: Stiffness of steady sliding at which the averaged limit is close enough to start from.
_FAST_MODULATION = 0.02


class Start(NamedTuple):
    """Orbits on the first mesh, which of them were found, and the share of epsilon reached."""

    orbit: Orbit
    found: NDArray[np.bool_]
    reached: Float


def starting_orbits(problem: Problem, points: int) -> Start:
    """Find an orbit of every point, from the averaged limit or along a path.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    points : int
    """
    system = problem.system
    orbit = Orbit.empty(scheme_for(system), system.size, _INTERVALS, points)
    solved = _from_averaged(problem, orbit, np.arange(points))
    reached = solved.astype(float)
    lost = np.flatnonzero(~solved)
    if len(lost):
        reached[lost] = _from_steady(problem, orbit, lost)[lost]
        solved = reached >= 1
    lost = np.flatnonzero(~solved)
    if len(lost):
        solved[lost] = _from_high_frequency(problem, orbit, lost)[lost]
    return Start(orbit, solved, reached)


def _from_averaged(problem: Problem, orbit: Orbit, index: Indices) -> NDArray[np.bool_]:
    solved = np.zeros(orbit.centre.shape[-1], dtype=bool)
    solve = partial(first_orbit, intervals=_INTERVALS)
    for part, (first, error) in run_chunks(
        solve, problem, index, chunk_size(_INTERVALS, problem.system.size)
    ):
        good = error < ACCEPTED
        put(orbit, part[good], take(first, np.flatnonzero(good)))
        solved[part] = good
    return solved


def _from_steady(problem: Problem, orbit: Orbit, index: Indices) -> Float:
    """Amplitude path from epsilon = 0; returns the share of epsilon reached."""
    steady = np.asarray(jax.jit(lambda s: s.steady())(problem.system))
    orbit.mesh[:, index] = np.linspace(0, 2 * np.pi, _INTERVALS + 1)[:, None]
    orbit.centre[:, index] = np.broadcast_to(steady, orbit.centre.shape)[:, index]
    orbit.nodes[..., index] = 0.0
    orbit.slopes[..., index] = 0.0
    return follow(problem, along_amplitude, orbit, index, first_step=0.05)


def _from_high_frequency(problem: Problem, orbit: Orbit, index: Indices) -> NDArray[np.bool_]:
    """Frequency path from where the averaged limit holds; returns whether the end was reached."""
    stiffness = np.zeros(orbit.centre.shape[-1])
    for part, value in run_chunks(stiffness_of_steady_sliding, problem, index, 4096):
        stiffness[part] = value
    omega = np.asarray(problem.system.omega)
    path = along_frequency(omega * np.maximum(stiffness / _FAST_MODULATION, 1.0))
    started = _from_averaged(path(problem, np.zeros_like(omega)), orbit, index)
    reached = follow(
        problem,
        path,
        orbit,
        index[started[index]],
        first_step=0.02,
    )
    return reached >= 1
