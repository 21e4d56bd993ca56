"""Search for orbits that can be differentiated, in this process or in another one."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import take
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.gradient.search.direct import DirectSearch
from asperity.orbit.gradient.search.known import KnownOrbits
from asperity.orbit.gradient.search.mesh_orbits import MeshOrbits, SearchedOrbits
from asperity.orbit.gradient.search.whole import whole_search

#: Intervals of the meshes on which orbits are differentiated: each on the first that serves it.
MESHES = (216, 648, 1944)
#: Of the one mesh in a program that is traced, whose shapes are fixed before orbits are known.
TRACED_MESH = 648

#: Time after which an idle process of the search ends (s); to start one takes seconds.
_IDLE = 600


def search_orbits(
    equations: ParametrisedProblem,
    harmonics: int,
    parameters: dict[str, NDArray[np.float64]],
    wanted: NDArray[np.bool_],
    *,
    direct: bool = False,
    known: KnownOrbits | None = None,
    every: bool = False,
    meshes: tuple[int, ...] = MESHES,
) -> SearchedOrbits:
    """Search for the orbits of the points `wanted`.

    Parameters
    ----------
    equations : ParametrisedProblem
    harmonics : int
    parameters : dict of str to array, shape (points,)
    wanted : bool array, shape (points,)
    direct : bool
        Whether only to solve each point by itself, without following branches to it. Multipliers
        are then those of the mesh, unchecked.
    known : KnownOrbits, optional
        Of the first points, for a direct search, which begins there and keeps what it finds.
    every : bool
        Whether a direct search may end at the first point without an orbit.
    meshes : tuple of int
        Numbers of intervals, rising.
    """
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    found = SearchedOrbits.none(len(wanted))
    index = np.flatnonzero(wanted)
    if direct:
        DirectSearch(equations, parameters, problem, harmonics, meshes, found, known, every).run(
            index
        )
        return found
    own = whole_search(take(problem, index), len(index), harmonics, meshes)
    found.outcome[index] = own.outcome
    for part, orbits in own.parts:
        found.add(index[part], orbits)
    return found


def search_in_another_process(*arguments: Any) -> MeshOrbits:
    """`search_on_one_mesh` for a compiled program that waits for it.

    XLA's programs for the CPU may wait for each other for ever where one calls another, so that
    the search has a process of its own, which is started at its first use.
    """
    from loky import get_reusable_executor

    executor = get_reusable_executor(max_workers=1, timeout=_IDLE)
    orbits: MeshOrbits = executor.submit(search_on_one_mesh, *arguments).result()
    return orbits


def search_on_one_mesh(
    equations: ParametrisedProblem,
    harmonics: int,
    parameters: dict[str, NDArray[np.float64]],
    wanted: NDArray[np.bool_],
) -> MeshOrbits:
    """Search for the orbits of the points `wanted`, all on `TRACED_MESH`."""
    found = search_orbits(equations, harmonics, parameters, wanted, meshes=(TRACED_MESH,))
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    return found.laid_out(problem, harmonics, TRACED_MESH)
