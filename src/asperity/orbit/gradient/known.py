"""Known orbits on collocation meshes, initial guesses at nearby parameters.

A fit calls many times with the same points and slightly changed parameters. From the orbits of the
call before, Newton's method needs a few steps; a search without them takes ten times as long.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, mesh_chunk, put, run_chunks, take
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import ACCEPTED
from asperity.orbit.mesh.remeshing import FIRST_MESH, refined_orbit, remeshed
from asperity.orbit.multipliers import AGREEMENT
from asperity.orbit.observables import Observables
from asperity.orbit.outcome import Outcome
from asperity.slider.problem import Problem


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
    """Orbits of a search.

    Attributes
    ----------
    outcome : int array, shape (points,)
        Outcome of every point; `Outcome.NO_ORBIT` where no orbit was requested.
    parts : list of (array of int, MeshOrbits)
        Indices and orbits of converged points; each part has its number of intervals.
    """

    outcome: NDArray[np.int64]
    parts: list[tuple[Indices, MeshOrbits]]

    @classmethod
    def none(cls, points: int) -> SearchedOrbits:
        """No orbit yet."""
        return cls(np.full(points, int(Outcome.NO_ORBIT)), [])

    def add(self, index: Indices, orbits: MeshOrbits) -> None:
        """Add converged orbits of the points `index`."""
        if len(index):
            self.outcome[index] = Outcome.CONVERGED
            self.parts.append((index, orbits))

    def by_mesh(self) -> list[tuple[Indices, MeshOrbits]]:
        """The parts; parts with the same number of intervals are joined."""
        sizes: dict[int, list[tuple[Indices, MeshOrbits]]] = {}
        for part in self.parts:
            sizes.setdefault(len(part[1].orbit.mesh), []).append(part)
        return [joined(parts) for parts in sizes.values()]


def joined(parts: list[tuple[Indices, MeshOrbits]]) -> tuple[Indices, MeshOrbits]:
    """Parts with the same number of intervals, joined to one."""
    index = np.concatenate([index for index, _ in parts])
    several = [orbits for _, orbits in parts]
    return index, jax.tree.map(lambda *a: np.concatenate(a, axis=-1), *several)


Float = NDArray[np.float64]

#: Largest number of intervals of the meshes of stored orbits.
KEPT = 216
#: Intervals of the mesh that is compared with the first mesh for derivatives.
COARSER = FIRST_MESH
#: Largest relative change of mean and harmonics between two meshes for which the finer one is
#: accurate (its error is smaller by 3^8, for a stiff orbit by 3^4); and this limit for the last
#: mesh, equal to the accuracy of the whole search.
_AGREEMENT, _LAST_AGREEMENT = 1e-8, AGREEMENT


@dataclass
class KnownOrbits:
    """The latest orbit of each point, the initial guess of the next call.

    Attributes
    ----------
    points : int
        Number of points; calls must have as many, in the same order.
    orbit : Orbit or None
        Points along the last axis; None where no orbit is known.
    known : bool array, shape (points,)
        Of which points an orbit is known.
    """

    points: int
    orbit: Orbit | None = None
    known: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        self.known = np.zeros(self.points, bool)

    def keep(self, problem: Problem, index: Indices, orbit: Orbit) -> None:
        """Keep the orbits of the points `index` of a problem, on a mesh of any size."""
        size = problem.system.size
        if self.orbit is None:
            intervals = min(KEPT, len(orbit.mesh) - 1)
            self.orbit = Orbit.empty(orbit.scheme, size, intervals, self.points)
        self.known[index] = True
        if len(orbit.mesh) == len(self.orbit.mesh):
            put(self.orbit, index, orbit)
            return
        remesh = partial(remeshed, intervals=len(self.orbit.mesh) - 1)
        inputs, everyone = (take(problem, index), orbit), np.arange(len(index))
        for part, kept in run_chunks(remesh, inputs, everyone, mesh_chunk(size)):
            put(self.orbit, index[part], kept)

    def picked(self, index: Indices) -> KnownOrbits:
        """The known orbits of the points `index`, which may repeat a point."""
        orbit = None if self.orbit is None else take(self.orbit, index)
        others = KnownOrbits(len(index), orbit)
        others.known[:] = self.known[index]
        return others


def followed_orbits(
    problem: Problem,
    guess: Orbit,
    index: Indices,
    harmonics: int,
    meshes: tuple[int, ...],
) -> list[tuple[Indices, Orbit, Observables]]:
    """Orbits that Newton's method reaches from a guess, checked by a coarser mesh.

    Parameters
    ----------
    problem : Problem
    guess : Orbit
        Of the points of the problem, of meaning for those of `index`.
    index : array of int
    harmonics : int
        At least 2.
    meshes : tuple of int
        Numbers of intervals, rising; an orbit is on the first that agrees with the one before.
        Without any, orbits are on the coarser mesh, unchecked.

    Returns
    -------
    list of (array of int, Orbit, Observables)
        For each mesh that serves any point: the points, their orbits and observables.
    """
    parts = []
    size, points = guess.centre.shape
    before = np.full((1 + harmonics, points), np.nan + 0j)
    for intervals in (COARSER, *meshes):
        solve = partial(refined_orbit, intervals=intervals, harmonics=harmonics)
        finer = Orbit.empty(guess.scheme, size, intervals, points)
        good, left = [], []
        chunk = mesh_chunk(size)
        for part, (fine, reading, error) in run_chunks(solve, (problem, guess), index, chunk):
            put(finer, part, fine)
            change = largest_change(before[:, part], reading)
            before[:, part] = np.vstack([reading.mean_friction, reading.harmonics])
            solved = error < ACCEPTED
            agreement = _LAST_AGREEMENT if (intervals,) == meshes[-1:] else _AGREEMENT
            served = solved & (change < agreement) if meshes else solved
            if served.any():
                kept = np.flatnonzero(served)
                good.append((part[kept], take(fine, kept), take(reading, kept)))
            left.append(part[solved & ~served])
        if good:
            parts += good
        index, guess = np.concatenate([np.zeros(0, int), *left]), finer
        if not len(index):
            break
    return parts


def largest_change(before: NDArray[np.complex128], reading: Observables) -> Float:
    """Largest relative difference of mean and first two harmonics from those before, (points,).

    Parameters
    ----------
    before : complex array, shape (1 + harmonics, points)
        The mean, then the harmonics.
    reading : Observables
    """
    mean, first = before[0].real, before[1:3]
    scale = np.abs(first) + 1e-9 * np.abs(mean)
    change = np.abs(reading.harmonics[:2] - first) / np.maximum(scale, np.abs(first[:1]))
    return np.asarray(np.maximum(change.max(0), np.abs(reading.mean_friction / mean - 1)))
