"""The search for orbits to differentiate: each orbit on the coarsest mesh that is accurate enough.

The whole search takes the orbits of `asperity.orbit.search`. A direct search solves each point by
itself, from an orbit known of it or from one that is soon computed: it takes some milliseconds a
point, where the whole search, which follows branches from steady sliding, may take a minute. Fits
call it at the same points again and again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, mesh_chunk, put, run_chunks, take
from asperity.orbit.gradient.known import (
    COARSER,
    KnownOrbits,
    MeshOrbits,
    SearchedOrbits,
    converged_orbits,
    followed_orbits,
    largest_change,
)
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.gradient.settled import settled_orbits
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import ACCEPTED
from asperity.orbit.mesh.remeshing import refined_orbit
from asperity.orbit.methods.collocation.initial_guess import orbits_from_averaged_limit
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import find_orbits
from asperity.slider.problem import Problem

#: Largest difference, relative, of mean and harmonics on a mesh from those of the search, at which
#: it serves. A steep slip pulse that moves along the mesh multiplies the error of the derivatives
#: by the pulse's shift over its width, some thousand times.
_AGREEMENT = 1e-10
#: Limit on the last mesh, equal to the accuracy of the search.
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
    solution = find_orbits(
        problem,
        points,
        harmonics=counted,
        phases=0,
        progress=lambda _: None,
        intervals=meshes[0],
    )
    orbit = solution.orbit
    left = np.flatnonzero(solution.converged)
    result.outcome[:] = np.where(solution.converged, int(Outcome.NOT_RESOLVED), solution.outcome)
    for intervals in meshes:
        agreement = _LAST_AGREEMENT if intervals == meshes[-1] else _AGREEMENT
        finer = Orbit.empty(orbit.scheme, size, intervals, points)
        solve = partial(refined_orbit, intervals=intervals, harmonics=counted)
        chunk = mesh_chunk(size)
        for part, (fine, reading, error) in run_chunks(solve, (problem, orbit), left, chunk):
            put(finer, part, fine)
            numbers = np.vstack([solution.mean_friction[part], solution.harmonics[:, part]])
            served = (error < ACCEPTED) & (largest_change(numbers, reading) < agreement)
            kept = np.flatnonzero(served)
            orbits = MeshOrbits(
                take(fine, kept),
                solution.mean_friction[part[kept]],
                solution.harmonics[:harmonics, part[kept]],
                solution.log_multipliers[:, part[kept]],
            )
            result.add(part[kept], orbits)
        orbit, left = finer, left[result.outcome[left] != Outcome.CONVERGED]
        if not len(left):
            break
    return result


Float = NDArray[np.float64]


@dataclass(frozen=True)
class DirectSearch:
    """Search for the orbits of some points.

    Attributes
    ----------
    equations : ParametrisedProblem
    parameters : dict of str to array, shape (points,)
    problem : Problem
        Of all points.
    harmonics : int
    meshes : tuple of int
        Numbers of intervals of the meshes that orbits may lie on, rising; without any, orbits lie
        on the coarser mesh, unchecked, and no transients are computed.
    result : SearchedOrbits
        To be filled.
    known : KnownOrbits or None
        Of the first points; it keeps the orbits.
    every : bool
        Whether to give up once a point has no orbit.
    """

    equations: ParametrisedProblem
    parameters: dict[str, Float]
    problem: Problem
    harmonics: int
    meshes: tuple[int, ...]
    result: SearchedOrbits
    known: KnownOrbits | None
    every: bool

    def run(self, wanted: Indices) -> None:
        """Search for the orbits of the points `wanted`."""
        known = self.known
        if known is not None and known.orbit is not None:
            self._follow(known.orbit, wanted[known.known[wanted]])
        left = self._left(wanted)
        if len(left):
            self._from_averaged_limit(left)
        left = self._left(wanted)
        if not self.meshes:
            return
        if len(left) and not (self.every and (self.result.outcome == Outcome.OUT_OF_RANGE).any()):
            self._from_motions(left)

    @property
    def _counted(self) -> int:
        """Harmonics that are computed; the first two are compared between meshes."""
        return max(self.harmonics, 2)

    def _left(self, wanted: Indices) -> Indices:
        """Points that are neither solved nor out of range."""
        done = np.isin(self.result.outcome[wanted], (Outcome.CONVERGED, Outcome.OUT_OF_RANGE))
        return wanted[~done]

    def _follow(self, guess: Orbit, index: Indices) -> None:
        """Solve the points `index`; `guess` has an orbit for every point."""
        for part, orbit, observables in followed_orbits(
            self.problem, guess, index, self._counted, self.meshes
        ):
            self.result.add(part, converged_orbits(orbit, observables, self.harmonics))
            if self.known is not None:
                self.known.keep(self.problem, part, orbit)

    def _from_averaged_limit(self, index: Indices) -> None:
        """Solve the points `index` in range from the averaged limit."""
        none = find_orbits(
            take(self.problem, index),
            len(index),
            harmonics=1,
            phases=0,
            progress=lambda _: None,
            methods=(),
        )
        self.result.outcome[index] = none.outcome
        index = self._left(index)
        guess = orbits_from_averaged_limit(self.problem, len(self.result.outcome), index)
        self._follow(guess.orbit, index[guess.solved[index]])

    def _from_motions(self, index: Indices) -> None:
        """Solve the points `index` from motions, up to the first motion without convergence."""
        guess, periodic = settled_orbits(
            self.equations, self.parameters, self.problem, index, COARSER, every=self.every
        )
        wanted = len(index) if self.every else 1
        if len(periodic) >= wanted:
            self._follow(guess, periodic)


#: Numbers of intervals of the meshes for derivatives; an orbit uses the first that is accurate.
MESHES = (216, 648, 1944)


def search_orbits(
    equations: ParametrisedProblem,
    harmonics: int,
    parameters: dict[str, NDArray[np.float64]],
    wanted: NDArray[np.bool_],
    *,
    direct: bool = False,
    coarse: bool = False,
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
        Whether only to solve each point independently, without following branches. Multipliers
        are then those of the mesh, unchecked.
    coarse : bool
        Whether a direct search takes orbits on the coarsest mesh, unchecked, and no transients.
    known : KnownOrbits, optional
        Of the first points, for a direct search, which begins there and keeps what it finds.
    every : bool
        Whether a direct search may end at the first point without an orbit.
    """
    problem = jax.tree.map(np.asarray, equations.problem(parameters))
    result = SearchedOrbits.none(len(wanted))
    index = np.flatnonzero(wanted)
    if direct:
        meshes = () if coarse else MESHES
        DirectSearch(equations, parameters, problem, harmonics, meshes, result, known, every).run(
            index
        )
        return result
    searched = whole_search(take(problem, index), len(index), harmonics, MESHES)
    result.outcome[index] = searched.outcome
    for part, orbits in searched.parts:
        result.add(index[part], orbits)
    return result
