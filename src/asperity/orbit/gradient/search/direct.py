"""Direct search: each point by itself, from an orbit known of it, or from one that is soon found.

It solves a point in some milliseconds, where the whole search, which follows branches from steady
sliding, may take a minute. Fits call it at the same points again and again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, take
from asperity.orbit.gradient.parametrised import ParametrisedProblem
from asperity.orbit.gradient.search.known import COARSER, KnownOrbits, followed_orbits
from asperity.orbit.gradient.search.mesh_orbits import SearchedOrbits, converged_orbits
from asperity.orbit.gradient.search.settled import settled_orbits
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.methods.collocation.initial_guess import orbits_from_averaged_limit
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import find_orbits
from asperity.slider.problem import Problem

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
        Numbers of intervals of the meshes that orbits may lie on, rising.
    found : SearchedOrbits
        To be filled.
    known : KnownOrbits or None
        Of the first points; it keeps what is found.
    every : bool
        Whether to give up once a point has no orbit.
    """

    equations: ParametrisedProblem
    parameters: dict[str, Float]
    problem: Problem
    harmonics: int
    meshes: tuple[int, ...]
    found: SearchedOrbits
    known: KnownOrbits | None
    every: bool

    def run(self, wanted: Indices) -> None:
        """Search for the points `wanted`."""
        known = self.known
        if known is not None and known.orbit is not None:
            self._follow(known.orbit, wanted[known.there[wanted]])
        left = self._left(wanted)
        if len(left):
            self._from_averaged_limit(left)
        left = self._left(wanted)
        if len(left) and not (self.every and (self.found.outcome == Outcome.OUT_OF_RANGE).any()):
            self._from_motions(left)

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

    def _from_motions(self, index: Indices) -> None:
        """Until the first motion that does not settle, where every point must have an orbit."""
        guess, settled = settled_orbits(
            self.equations, self.parameters, self.problem, index, COARSER, every=self.every
        )
        wanted = len(index) if self.every else 1
        if len(settled) >= wanted:
            self._follow(guess, settled)
