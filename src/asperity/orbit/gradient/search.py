"""Orbits from the search, each on a collocation mesh on which it can be differentiated."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.orbit.batches import put, run_chunks, take
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.mesh.programs import ACCEPTED, refine_orbit
from asperity.orbit.mesh.scheme import STAGES
from asperity.orbit.methods.registry import METHODS
from asperity.orbit.methods.starting_orbits import starting_orbits
from asperity.orbit.multipliers import chunk_size
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import find_orbits
from asperity.slider.problem import Problem

#: Intervals of the mesh on which orbits are differentiated.
INTERVALS = 144

#: Largest difference, relative, of mean and harmonics on that mesh from those of the search.
_AGREEMENT = 1e-7


#: Time after which an idle process of the search ends (s); to start one takes seconds.
_IDLE = 600


class MeshOrbits(NamedTuple):
    """Orbits of all points, those that were not asked for included, points along the last axis.

    Attributes
    ----------
    mesh, centre, nodes, slopes : array
        As in `Orbit`; of no meaning where `outcome` is not `Outcome.CONVERGED`.
    mean_friction : array, shape (points,)
    harmonics : complex array, shape (count, points)
    log_multipliers : complex array, shape (states, points)
    outcome : int array, shape (points,)
    """

    mesh: Array
    centre: Array
    nodes: Array
    slopes: Array
    mean_friction: Array
    harmonics: Array
    log_multipliers: Array
    outcome: Array


def mesh_orbit_shapes(equations: Any, size: int, points: int, harmonics: int) -> MeshOrbits:
    """Shapes and types of what `search_mesh_orbits` returns."""

    def shape(*axes: int, dtype: Any = float) -> jax.ShapeDtypeStruct:
        return jax.ShapeDtypeStruct((*axes, points), np.dtype(dtype))

    return MeshOrbits(
        shape(INTERVALS + 1),
        shape(size),
        shape(size, INTERVALS),
        shape(size, STAGES, INTERVALS),
        shape(),
        shape(harmonics, dtype=complex),
        shape(size, dtype=complex),
        shape(dtype=np.int64),
    )


def search_mesh_orbits(
    equations: ParametrisedProblem,
    harmonics: int,
    parameters: dict[str, NDArray[np.float64]],
    wanted: NDArray[np.bool_],
    direct: bool = False,
) -> MeshOrbits:
    """Search for the orbits of the points `wanted`.

    Parameters
    ----------
    equations : ParametrisedProblem
    harmonics : int
    parameters : dict of str to array, shape (points,)
    wanted : bool array, shape (points,)
    direct : bool
        Whether only to solve each point by itself, without following branches to it.
    """
    points = len(wanted)
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    size = problem.system.size
    shapes = mesh_orbit_shapes(equations, size, points, harmonics)
    result = MeshOrbits(*(np.zeros(s.shape, s.dtype) for s in shapes))
    even = np.linspace(0, 2 * np.pi, INTERVALS + 1)
    result.mesh[:] = even[:, None]
    result.outcome[:] = Outcome.NO_ORBIT
    index = np.flatnonzero(wanted)
    if len(index):
        put(result, index, _found(take(problem, index), len(index), harmonics, direct))
    # States at which the equations are finite, so that points without an orbit harm no other.
    steady = np.broadcast_to(np.asarray(_steady(problem.system)), result.centre.shape)
    lost = np.flatnonzero(result.outcome != Outcome.CONVERGED)
    result.centre[:, lost] = steady[:, lost]
    result.mesh[:, lost] = even[:, None]
    for part in (result.nodes, result.slopes):
        part[..., lost] = 0.0
    return result


@jax.jit
def _steady(system: Any) -> Array:
    return system.steady()


def _found(problem: Problem, points: int, harmonics: int, direct: bool) -> MeshOrbits:
    """The same for all points of `problem`; orbits that the search found on a mesh are reused."""
    counted = max(harmonics, 2)
    found = find_orbits(
        problem,
        points,
        harmonics=counted,
        phases=0,
        progress=lambda _: None,
        methods=tuple(m for m in METHODS if not (direct and m.follows)),
        intervals=INTERVALS,
    )
    orbit, outcome = found.orbit, found.outcome.copy()
    solved = np.flatnonzero(found.converged)
    outcome[solved] = Outcome.NOT_RESOLVED
    # Methods without a mesh, fast ones, leave the orbit to be found on one.
    bare = solved[orbit.mesh[-1, solved] == 0]
    if len(bare):
        start = starting_orbits(take(problem, bare), len(bare), INTERVALS)
        put(orbit, bare[start.found], take(start.orbit, np.flatnonzero(start.found)))
    solve = partial(refine_orbit, intervals=INTERVALS, harmonics=counted)
    rows = solved[orbit.mesh[-1, solved] > 0]
    chunk = chunk_size(INTERVALS, problem.system.size)
    for part, (fine, reading, error) in run_chunks(solve, (problem, orbit), rows, chunk):
        put(orbit, part, fine)
        mean, first = found.mean_friction[part], found.harmonics[:, part]
        scale = np.abs(first) + 1e-9 * np.abs(mean)
        gap = np.abs(reading.harmonics - first) / np.maximum(scale, np.abs(first[:1]))
        gap = np.maximum(gap[:2].max(0), np.abs(reading.mean_friction / mean - 1))
        outcome[part[(error < ACCEPTED) & (gap < _AGREEMENT)]] = Outcome.CONVERGED
    return MeshOrbits(
        orbit.mesh,
        orbit.centre,
        orbit.nodes,
        orbit.slopes,
        found.mean_friction,
        found.harmonics[:harmonics],
        found.log_multipliers,
        outcome,
    )


def search_in_another_process(*arguments: Any) -> MeshOrbits:
    """`search_mesh_orbits` for a compiled program that waits for it.

    XLA's programs for the CPU may wait for each other for ever where one calls another, so that
    the search has a process of its own, which is started at its first use.
    """
    from loky import get_reusable_executor

    executor = get_reusable_executor(max_workers=1, timeout=_IDLE)
    return executor.submit(search_mesh_orbits, *arguments).result()
