"""Records of the orbits that a search found, each on a collocation mesh."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, put
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.scheme import STAGES, scheme_for
from asperity.orbit.observables import Observables
from asperity.orbit.outcome import Outcome
from asperity.slider.problem import Problem


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


def orbit_of(problem: Problem, orbits: MeshOrbits) -> Orbit:
    """The orbits alone."""
    return Orbit(*orbits[:4], scheme_for(problem.system))


def converged_orbits(orbit: Orbit, observables: Observables, harmonics: int) -> MeshOrbits:
    """Converged orbits as `MeshOrbits`."""
    outcome = np.full(len(observables.mean_friction), int(Outcome.CONVERGED))
    logs = observables.log_multipliers
    numbers = observables.mean_friction, observables.harmonics[:harmonics], logs
    return MeshOrbits(orbit.mesh, orbit.centre, orbit.nodes, orbit.slopes, *numbers, outcome)


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

    def laid_out(self, problem: Problem, harmonics: int, intervals: int) -> MeshOrbits:
        """All points on one mesh; all parts must have so many intervals."""
        points = len(self.outcome)
        shapes = mesh_orbit_shapes(problem.system.size, points, harmonics, intervals)
        result = MeshOrbits(*(np.zeros(s.shape, s.dtype) for s in shapes))
        for index, orbits in self.parts:
            put(result, index, orbits)
        result.outcome[:] = self.outcome
        # States at which the equations are finite, so that points without an orbit harm no other.
        steady = np.broadcast_to(np.asarray(_steady(problem.system)), result.centre.shape)
        lost = np.flatnonzero(self.outcome != Outcome.CONVERGED)
        result.centre[:, lost] = steady[:, lost]
        result.mesh[:, lost] = np.linspace(0, 2 * np.pi, intervals + 1)[:, None]
        return result


@jax.jit
def _steady(system: Any) -> Array:
    return system.steady()
