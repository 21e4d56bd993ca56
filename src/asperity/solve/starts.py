"""Where Newton's method starts: the averaged limit, and paths to points that it does not reach."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, put, run_chunks, take
from asperity.solve.continuation.pursuit import PursuitMesh, pursue
from asperity.solve.homotopy import LONG, along_amplitude, along_frequency, along_rest, follow
from asperity.solve.kernels import (
    ACCEPTED,
    Problem,
    first_orbit,
    stiffness_of_steady_sliding,
)
from asperity.solve.mesh import Orbit
from asperity.solve.multipliers import chunk_size
from asperity.solve.outcome import Outcome
from asperity.solve.refinement import FIRST_MESH
from asperity.solve.scheme import scheme_for

Float = NDArray[np.float64]

_INTERVALS = FIRST_MESH
#: Stiffness of steady sliding at which the averaged limit is close enough to start from.
_FAST_MODULATION = 0.02


class Start(NamedTuple):
    """Orbits to begin with.

    Attributes
    ----------
    orbit : Orbit
    found : bool array, shape (points,)
        Which of them were found.
    outcome : int array, shape (points,)
        What to say of the others.
    detail : array, shape (points,)
        The number in it.
    """

    orbit: Orbit
    found: NDArray[np.bool_]
    outcome: NDArray[np.int_]
    detail: Float

    @classmethod
    def none(cls, problem: Problem, points: int, intervals: int) -> Start:
        """Nothing found yet."""
        system = problem.system
        return cls(
            Orbit.empty(scheme_for(system), system.size, intervals, points),
            np.zeros(points, dtype=bool),
            np.full(points, int(Outcome.NO_ORBIT)),
            np.zeros(points),
        )


def starting_orbits(problem: Problem, points: int) -> Start:
    """Find an orbit of every point, from the averaged limit or along a path.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    points : int
    """
    start = near_orbits(problem, points)
    lost = np.flatnonzero(~start.found)
    if len(lost):
        _from_high_frequency(problem, start, lost)
    return start


def near_orbits(problem: Problem, points: int) -> Start:
    """Orbits near the averaged limit, or not far along the path from steady sliding."""
    start = Start.none(problem, points, _INTERVALS)
    _from_averaged(problem, start, np.arange(points))
    lost = np.flatnonzero(~start.found)
    if len(lost):
        _from_steady(problem, start, lost)
    return start


def orbits_from_high_frequency(problem: Problem, points: int, index: Indices) -> Start:
    """Orbits of the points `index` at the end of a path from fast modulation."""
    start = Start.none(problem, points, _INTERVALS)
    _from_high_frequency(problem, start, index)
    return start


def orbits_along_branches(
    problem: Problem, points: int, index: Indices, mesh: PursuitMesh
) -> tuple[Start, NDArray[np.bool_]]:
    """Orbits of the points `index` at the end of their branch from steady sliding.

    Where the branch does not get there, `outcome` says what becomes of it. Returned beside it is
    whether a finer mesh would say the same.
    """
    branch = pursue(problem, index, mesh)
    start = Start.none(problem, points, mesh.intervals)._replace(orbit=branch.orbit)
    start.detail[:] = branch.farthest
    amplitude = np.broadcast_to(problem.load.amplitude, (points,))
    for which, outcome, share in (
        (branch.folded, Outcome.FOLDED, branch.fold),
        (branch.ran_away, Outcome.RUNAWAY, branch.end),
        (branch.sensitive, Outcome.SENSITIVE, branch.farthest),
    ):
        rows = index[(which & (amplitude > 0))[index]]
        start.outcome[rows] = outcome
        start.detail[rows] = share[rows] * amplitude[rows]
    arrived = index[branch.arrived[index]]
    if len(arrived):
        reached = follow(problem, along_rest(branch.share), start.orbit, arrived, first_step=0.5)
        start.found[arrived] = reached[arrived] >= 1
    return start, branch.settled


def _from_averaged(problem: Problem, start: Start, index: Indices) -> None:
    solve = partial(first_orbit, intervals=_INTERVALS)
    for part, (first, error) in run_chunks(
        solve, problem, index, chunk_size(_INTERVALS, problem.system.size)
    ):
        good = error < ACCEPTED
        put(start.orbit, part[good], take(first, np.flatnonzero(good)))
        start.found[part] = good


def _from_steady(problem: Problem, start: Start, index: Indices) -> None:
    """Amplitude path from epsilon = 0; the detail is the share of epsilon reached."""
    orbit = start.orbit
    steady = np.asarray(jax.jit(lambda s: s.steady())(problem.system))
    orbit.mesh[:, index] = np.linspace(0, 2 * np.pi, _INTERVALS + 1)[:, None]
    orbit.centre[:, index] = np.broadcast_to(steady, orbit.centre.shape)[:, index]
    orbit.nodes[..., index] = 0.0
    orbit.slopes[..., index] = 0.0
    reached = follow(problem, along_amplitude, orbit, index, first_step=0.05)
    start.detail[index] = reached[index]
    start.found[index] = reached[index] >= 1


def _from_high_frequency(problem: Problem, start: Start, index: Indices) -> None:
    """Frequency path from where the averaged limit holds."""
    stiffness = np.zeros(len(start.found))
    for part, value in run_chunks(stiffness_of_steady_sliding, problem, index, 4096):
        stiffness[part] = value
    omega = np.asarray(problem.system.omega)
    path = along_frequency(omega * np.maximum(stiffness / _FAST_MODULATION, 1.0))
    _from_averaged(path(problem, np.zeros_like(omega)), start, index)
    begun = index[start.found[index]]
    reached = follow(problem, path, start.orbit, begun, first_step=0.02, patience=LONG)
    start.found[index] = reached[index] >= 1
