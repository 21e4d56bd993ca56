"""Orbits from the search, each on a collocation mesh on which it can be differentiated."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, put, run_chunks, take
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.programs import ACCEPTED, refine_orbit
from asperity.orbit.mesh.scheme import STAGES
from asperity.orbit.methods.registry import METHODS
from asperity.orbit.methods.starting_orbits import starting_orbits
from asperity.orbit.multipliers import chunk_size
from asperity.orbit.observables import Observables
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import find_orbits
from asperity.orbit.solution import Solution
from asperity.slider.problem import Problem

#: Intervals of the meshes on which orbits are differentiated: each on the first that serves it.
MESHES = (144, 432, 1296)
#: Of the one mesh in a program that is traced, whose shapes are fixed before orbits are known.
TRACED_MESH = 432

#: Largest difference, relative, of mean and harmonics on a mesh from those of the search, at which
#: it serves. A steep slip pulse that moves along the mesh multiplies the error of the derivatives
#: by the pulse's shift over its width, some thousand times.
_AGREEMENT = 1e-10
#: The same on the last mesh: as good as the values of the search themselves.
_LAST_AGREEMENT = 1e-8

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


def mesh_orbit_shapes(size: int, points: int, harmonics: int, intervals: int) -> MeshOrbits:
    """Shapes and types of the orbits on one mesh."""

    def shape(*axes: int, dtype: Any = float) -> jax.ShapeDtypeStruct:
        return jax.ShapeDtypeStruct((*axes, points), np.dtype(dtype))

    return MeshOrbits(
        shape(intervals + 1),
        shape(size),
        shape(size, intervals),
        shape(size, STAGES, intervals),
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
    meshes: tuple[int, ...] = MESHES,
) -> tuple[MeshOrbits, ...]:
    """Search for the orbits of the points `wanted`.

    Parameters
    ----------
    equations : ParametrisedProblem
    harmonics : int
    parameters : dict of str to array, shape (points,)
    wanted : bool array, shape (points,)
    direct : bool
        Whether only to solve each point by itself, without following branches to it.
    meshes : tuple of int
        Numbers of intervals, rising.

    Returns
    -------
    tuple of MeshOrbits
        One for each mesh that serves any point, at least one. A point is converged in one of them
        at most; why one is converged in none is in the first.
    """
    points = len(wanted)
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    index = np.flatnonzero(wanted)
    found = _found(take(problem, index), len(index), harmonics, direct, meshes)
    return tuple(_laid_out(problem, points, index, orbits) for orbits in found)


def _laid_out(
    problem: Problem, points: int, index: NDArray[np.intp], orbits: MeshOrbits
) -> MeshOrbits:
    """Orbits of the points `index` as those of all points."""
    intervals = len(orbits.mesh) - 1
    shapes = mesh_orbit_shapes(problem.system.size, points, len(orbits.harmonics), intervals)
    result = MeshOrbits(*map(_empty, shapes))
    result.outcome[:] = Outcome.NO_ORBIT
    put(result, index, orbits)
    # States at which the equations are finite, so that points without an orbit harm no other.
    steady = np.broadcast_to(np.asarray(_steady(problem.system)), result.centre.shape)
    lost = np.flatnonzero(result.outcome != Outcome.CONVERGED)
    result.centre[:, lost] = steady[:, lost]
    result.mesh[:, lost] = np.linspace(0, 2 * np.pi, intervals + 1)[:, None]
    for part in (result.nodes, result.slopes):
        part[..., lost] = 0.0
    return result


@jax.jit
def _steady(system: Any) -> Array:
    return system.steady()


def _found(
    problem: Problem, points: int, harmonics: int, direct: bool, meshes: tuple[int, ...]
) -> list[MeshOrbits]:
    """The same for all points of `problem`; orbits that the search found on a mesh are reused."""
    counted, size = max(harmonics, 2), problem.system.size
    if not points:
        return [MeshOrbits(*map(_empty, mesh_orbit_shapes(size, 0, harmonics, meshes[0])))]
    found = find_orbits(
        problem,
        points,
        harmonics=counted,
        phases=0,
        progress=lambda _: None,
        methods=tuple(m for m in METHODS if not (direct and m.follows)),
        intervals=meshes[0],
    )
    orbit = found.orbit
    solved = np.flatnonzero(found.converged)
    # Methods without a mesh, fast ones, leave the orbit to be found on one.
    bare = solved[orbit.mesh[-1, solved] == 0]
    if len(bare):
        start = starting_orbits(take(problem, bare), len(bare), meshes[0])
        put(orbit, bare[start.found], take(start.orbit, np.flatnonzero(start.found)))
    left = solved[orbit.mesh[-1, solved] > 0]
    served: list[MeshOrbits] = []
    for intervals in meshes:
        agreement = _LAST_AGREEMENT if intervals == meshes[-1] else _AGREEMENT
        finer = Orbit.empty(orbit.scheme, size, intervals, points)
        outcome = np.where(found.converged, int(Outcome.NOT_RESOLVED), found.outcome)
        solve = partial(refine_orbit, intervals=intervals, harmonics=counted)
        chunk = chunk_size(intervals, size)
        for part, (fine, reading, error) in run_chunks(solve, (problem, orbit), left, chunk):
            put(finer, part, fine)
            agrees = _gap(found, part, reading) < agreement
            outcome[part[(error < ACCEPTED) & agrees]] = Outcome.CONVERGED
        numbers = found.mean_friction, found.harmonics[:harmonics], found.log_multipliers
        parts = finer.mesh, finer.centre, finer.nodes, finer.slopes
        if not served or (outcome == Outcome.CONVERGED).any():
            served.append(MeshOrbits(*parts, *numbers, outcome))
        # A mesh that serves no point is not returned, but for lack of any.
        if len(served) == 2 and not (served[0].outcome == Outcome.CONVERGED).any():
            del served[0]
        orbit, left = finer, left[outcome[left] != Outcome.CONVERGED]
        if not len(left):
            break
    return served


def _empty(shape: jax.ShapeDtypeStruct) -> NDArray[Any]:
    return np.zeros(shape.shape, shape.dtype)


def _gap(found: Solution, part: Indices, reading: Observables) -> NDArray[np.float64]:
    """Largest relative difference of mean and two harmonics from those that were found."""
    mean, first = found.mean_friction[part], found.harmonics[:2, part]
    scale = np.abs(first) + 1e-9 * np.abs(mean)
    gap = np.abs(reading.harmonics[:2] - first) / np.maximum(scale, np.abs(first[:1]))
    return np.asarray(np.maximum(gap.max(0), np.abs(reading.mean_friction / mean - 1)))


def search_in_another_process(*arguments: Any) -> MeshOrbits:
    """`search_mesh_orbits` on `TRACED_MESH`, for a compiled program that waits for it.

    XLA's programs for the CPU may wait for each other for ever where one calls another, so that
    the search has a process of its own, which is started at its first use.
    """
    from loky import get_reusable_executor

    executor = get_reusable_executor(max_workers=1, timeout=_IDLE)
    search = partial(search_mesh_orbits, meshes=(TRACED_MESH,))
    (orbits,) = executor.submit(search, *arguments).result()
    return orbits
