"""Records of the orbits that a search found, each on a collocation mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import Indices
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.observables import Observables
from asperity.orbit.outcome import Outcome


class MeshOrbits(NamedTuple):
    """Converged orbits on one mesh, NumPy arrays with the points along the last axis.

    Attributes
    ----------
    orbit : Orbit
    mean_friction : array, shape (points,)
    harmonics : complex array, shape (count, points)
    log_multipliers : complex array, shape (states, points)
    """

    orbit: Orbit
    mean_friction: NDArray[np.float64]
    harmonics: NDArray[np.complex128]
    log_multipliers: NDArray[np.complex128]


def converged_orbits(orbit: Orbit, observables: Observables, harmonics: int) -> MeshOrbits:
    """Converged orbits as `MeshOrbits`."""
    return MeshOrbits(
        orbit,
        np.asarray(observables.mean_friction),
        np.asarray(observables.harmonics[:harmonics]),
        observables.log_multipliers,
    )


class SearchedOrbits(NamedTuple):
    """What a search has found.

    Attributes
    ----------
    outcome : int array, shape (points,)
        Of all points; those that were not asked for have `Outcome.NO_ORBIT`.
    parts : list of (array of int, MeshOrbits)
        Converged points with their orbits, each point once, each part on a mesh of its own.
    """

    outcome: NDArray[np.int64]
    parts: list[tuple[Indices, MeshOrbits]]

    @classmethod
    def none(cls, points: int) -> SearchedOrbits:
        """Nothing found yet."""
        return cls(np.full(points, int(Outcome.NO_ORBIT)), [])

    def add(self, index: Indices, orbits: MeshOrbits) -> None:
        """Note converged orbits of the points `index`."""
        if len(index):
            self.outcome[index] = Outcome.CONVERGED
            self.parts.append((index, orbits))
