"""Direct search: each point by itself, from orbits known of it or of points near it.

It solves a point in some milliseconds, where the whole search, which follows branches from steady
sliding, may take a minute. Fits call it at the same points again and again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, take
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.gradient.search.mesh_orbits import (
    SearchedOrbits,
    converged_orbits,
    orbit_of,
)
from asperity.orbit.gradient.search.nearby import (
    KnownOrbits,
    followed_orbits,
    guesses_from_neighbours,
)
from asperity.orbit.gradient.search.whole import whole_search
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.methods.collocation.initial_guess import orbits_from_averaged_limit
from asperity.orbit.methods.registry import METHODS
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import find_orbits
from asperity.slider.problem import Problem

Float = NDArray[np.float64]

#: Methods for the case that no point is solved from the averaged limit, so that there is none from
#: which the others could be reached.
_SLOWER = tuple(m for m in METHODS if not m.follows)


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
        Numbers of intervals of the meshes that orbits may lie on, rising.
    found : SearchedOrbits
        To be filled.
    known : KnownOrbits or None
        Of the first points; it keeps what is found. Without it no point is tried from another.
    """

    equations: ParametrisedProblem
    parameters: dict[str, Float]
    problem: Problem
    harmonics: int
    meshes: tuple[int, ...]
    found: SearchedOrbits
    known: KnownOrbits | None

    def run(self, wanted: Indices) -> None:
        """Search for the points `wanted`."""
        known = self.known
        if known is not None and known.orbit is not None:
            self._follow(known.orbit, wanted[known.there[wanted]])
        left = self._left(wanted)
        if len(left):
            self._from_averaged_limit(left)
        if known is None:
            return
        wanted = wanted[self.found.outcome[wanted] != Outcome.OUT_OF_RANGE]
        if len(wanted) and len(self._left(wanted)) == len(wanted):
            self._by_slower_methods(known, wanted)
        before, left = len(wanted), self._left(wanted)
        while 0 < len(left) < before:
            before = len(left)
            sources = np.setdiff1d(wanted, left)
            guesses = guesses_from_neighbours(
                self.equations, self.parameters, known, left, sources, self._counted
            )
            self._follow(*guesses)
            left = self._left(wanted)

    @property
    def _counted(self) -> int:
        """Harmonics that are computed; the first two are compared between meshes."""
        return max(self.harmonics, 2)

    def _left(self, wanted: Indices) -> Indices:
        """Points that are neither solved nor out of range."""
        done = np.isin(self.found.outcome[wanted], (Outcome.CONVERGED, Outcome.OUT_OF_RANGE))
        return wanted[~done]

    def _follow(self, guess: Orbit, index: Indices) -> None:
        """Solve the points `index` from guesses, which are of all points."""
        for part, orbit, observables in followed_orbits(
            self.problem, guess, index, self._counted, self.meshes
        ):
            self.found.add(part, converged_orbits(orbit, observables, self.harmonics))
            if self.known is not None:
                self.known.keep(self.problem, part, orbit)

    def _from_averaged_limit(self, index: Indices) -> None:
        """But for points out of range."""
        none = find_orbits(
            take(self.problem, index),
            len(index),
            harmonics=1,
            phases=0,
            progress=lambda _: None,
            methods=(),
        )
        self.found.outcome[index] = none.outcome
        index = self._left(index)
        guess = orbits_from_averaged_limit(self.problem, len(self.found.outcome), index)
        self._follow(guess.orbit, index[guess.found[index]])

    def _by_slower_methods(self, known: KnownOrbits, index: Indices) -> None:
        found = whole_search(
            take(self.problem, index), len(index), self.harmonics, self.meshes, _SLOWER
        )
        for part, orbits in found.parts:
            self.found.add(index[part], orbits)
            known.keep(self.problem, index[part], orbit_of(self.problem, orbits))
