"""The whole search, and the meshes on which its orbits can be differentiated."""

from __future__ import annotations

from functools import partial

import numpy as np

from asperity.orbit.batches import mesh_chunk, put, run_chunks, take
from asperity.orbit.gradient.search.known import largest_change
from asperity.orbit.gradient.search.mesh_orbits import MeshOrbits, SearchedOrbits
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import ACCEPTED
from asperity.orbit.mesh.remeshing import refined_orbit
from asperity.orbit.methods.starting_orbits import starting_orbits
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import find_orbits
from asperity.slider.problem import Problem

#: Largest difference, relative, of mean and harmonics on a mesh from those of the search, at which
#: it serves. A steep slip pulse that moves along the mesh multiplies the error of the derivatives
#: by the pulse's shift over its width, some thousand times.
_AGREEMENT = 1e-10
#: The same on the last mesh: as good as the values of the search themselves.
_LAST_AGREEMENT = 1e-8


def whole_search(
    problem: Problem,
    points: int,
    harmonics: int,
    meshes: tuple[int, ...],
) -> SearchedOrbits:
    """Search for the orbits of all points of `problem`, and solve them again on a mesh.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    points, harmonics : int
    meshes : tuple of int
        Numbers of intervals, rising; an orbit is on the first that agrees with the search.
    """
    counted, size = max(harmonics, 2), problem.system.size
    result = SearchedOrbits.none(points)
    if not points:
        return result
    found = find_orbits(
        problem,
        points,
        harmonics=counted,
        phases=0,
        progress=lambda _: None,
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
    result.outcome[:] = np.where(found.converged, int(Outcome.NOT_RESOLVED), found.outcome)
    for intervals in meshes:
        agreement = _LAST_AGREEMENT if intervals == meshes[-1] else _AGREEMENT
        finer = Orbit.empty(orbit.scheme, size, intervals, points)
        solve = partial(refined_orbit, intervals=intervals, harmonics=counted)
        chunk = mesh_chunk(size)
        for part, (fine, reading, error) in run_chunks(solve, (problem, orbit), left, chunk):
            put(finer, part, fine)
            numbers = np.vstack([found.mean_friction[part], found.harmonics[:, part]])
            served = (error < ACCEPTED) & (largest_change(numbers, reading) < agreement)
            kept = np.flatnonzero(served)
            orbits = MeshOrbits(
                take(fine, kept),
                found.mean_friction[part[kept]],
                found.harmonics[:harmonics, part[kept]],
                found.log_multipliers[:, part[kept]],
            )
            result.add(part[kept], orbits)
        orbit, left = finer, left[result.outcome[left] != Outcome.CONVERGED]
        if not len(left):
            break
    return result
