"""Search for orbits that can be differentiated."""

from __future__ import annotations

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import take
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.gradient.search.direct import DirectSearch
from asperity.orbit.gradient.search.known import KnownOrbits
from asperity.orbit.gradient.search.mesh_orbits import SearchedOrbits
from asperity.orbit.gradient.search.whole import whole_search

#: Intervals of the meshes on which orbits are differentiated: each on the first that serves it.
MESHES = (216, 648, 1944)


def search_orbits(
    equations: ParametrisedProblem,
    harmonics: int,
    parameters: dict[str, NDArray[np.float64]],
    wanted: NDArray[np.bool_],
    *,
    direct: bool = False,
    known: KnownOrbits | None = None,
    every: bool = False,
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
    """
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    found = SearchedOrbits.none(len(wanted))
    index = np.flatnonzero(wanted)
    if direct:
        DirectSearch(equations, parameters, problem, harmonics, MESHES, found, known, every).run(
            index
        )
        return found
    own = whole_search(take(problem, index), len(index), harmonics, MESHES)
    found.outcome[index] = own.outcome
    for part, orbits in own.parts:
        found.add(index[part], orbits)
    return found
