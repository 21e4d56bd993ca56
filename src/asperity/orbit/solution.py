"""The record of a search: observables and outcome of every operating point."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.algebra.runge_kutta import CollocationScheme
from asperity.arrays import Bool, Complex, Float, Index
from asperity.orbit.batches import put, take
from asperity.orbit.mesh.mesh import GAUSS, Orbit, scheme_for
from asperity.orbit.observables import Observables
from asperity.orbit.outcome import Outcome
from asperity.slider.problem import Problem


class Solution(NamedTuple):
    """Results of a method or of the whole search, points along the last axis.

    Attributes
    ----------
    mean_friction, harmonics, log_multipliers, start, waveform, reversal_margin : array
        As in `Observables`; NaN where there is no orbit.
    iterations : int array, shape (points,)
        Steps of Fourier collocation, or steps or intervals of the last division of the period.
    outcome : int array, shape (points,)
        `Outcome` of each point.
    detail : array, shape (points,)
        Number in the sentence of the outcome; 0 where no method has a result.
    method : str array, shape (points,)
        Name of the method that gave the outcome; "" for none.
    orbit : Orbit
        Orbits of the converged points on `SearchOptions.intervals` intervals; the mesh of the other
        points is 0 throughout.
    """

    mean_friction: Float
    harmonics: Complex
    log_multipliers: Complex
    start: Float
    waveform: Float
    reversal_margin: Float
    iterations: NDArray[np.int64]
    outcome: NDArray[np.int64]
    detail: Float
    method: NDArray[np.str_]
    orbit: Orbit

    @classmethod
    def unsolved(cls, problem: Problem, options: SearchOptions) -> Solution:
        """A solution of a problem in which every point is unsolved."""
        system = problem.system
        return cls.empty(system.size, system.V.shape[-1], options, scheme_for(system))

    @classmethod
    def empty(
        cls,
        size: int,
        points: int,
        options: SearchOptions,
        scheme: CollocationScheme = GAUSS,
    ) -> Solution:
        """A solution with `size` states in which every point is unsolved."""
        return cls(
            np.full(points, np.nan),
            np.full((options.harmonics, points), np.nan + 0j),
            np.full((size, points), np.nan + 0j),
            np.full((size, points), np.nan),
            np.full((2, options.phases, points), np.nan),
            np.full(points, np.nan),
            np.zeros(points, dtype=np.int64),
            np.full(points, int(Outcome.NO_ORBIT)),
            np.zeros(points),
            np.full(points, "", dtype="<U16"),
            Orbit.empty(scheme, size, options.intervals, points),
        )

    @property
    def converged(self) -> Bool:
        """Which points are solved."""
        return np.asarray(self.outcome == Outcome.CONVERGED)

    @property
    def numbers(self) -> Complex:
        """Mean, then harmonics, shape (1 + count, points)."""
        return np.concatenate([self.mean_friction[None], self.harmonics])

    @property
    def informed(self) -> Bool:
        """Points at which a method found an orbit, or the reason why there is none."""
        return (self.outcome != Outcome.NO_ORBIT) | (self.detail > 0)

    def store(self, rows: Index, observables: Observables, logs: Complex | None = None) -> None:
        """Write converged points; `logs` take the place of the observables' multipliers.

        Waveforms are sampled later, when an orbit is final.
        """
        self.mean_friction[rows] = observables.mean_friction
        self.harmonics[:, rows] = observables.harmonics
        self.log_multipliers[:, rows] = observables.log_multipliers if logs is None else logs
        self.start[:, rows] = observables.start
        self.reversal_margin[rows] = observables.reversal_margin
        self.outcome[rows] = Outcome.CONVERGED

    def discard(self, rows: Index) -> None:
        """Set the numbers of failed points to NaN, which cannot be mistaken for answers."""
        for values in self[:6]:
            values[..., rows] = np.nan

    def merge(self, rows: Index, attempt: Solution, method: str = "") -> None:
        """Write another attempt at the points `rows`; a failed one keeps the earlier outcome."""
        better = np.flatnonzero(attempt.informed)
        if len(better) < len(rows):
            rows, attempt = rows[better], take(attempt, better)
        put(self, rows, attempt)
        if method:
            self.method[rows] = method


def _no_report(_: int) -> None:
    """No report of progress."""


class SearchOptions(NamedTuple):
    """Requested observables, and progress.

    Attributes
    ----------
    harmonics, phases : int
        Numbers of harmonics and of waveform samples.
    progress : callable
        Called with the number of points finished since the last call.
    intervals : int
        Number of intervals of the meshes on which orbits are stored, by methods on meshes alone; 0
        to store none.
    """

    harmonics: int
    phases: int = 0
    progress: Callable[[int], None] = _no_report
    intervals: int = 0


class Method(ABC):
    """A method that finds periodic orbits.

    A search goes through a list of methods; each method gets the points that earlier methods left
    unsolved and that it may solve. To add a method, implement this class and put an instance into
    `asperity.orbit.search`.

    Class attributes
    ----------------
    name : str
        Name in results.
    choice : str
        Name in the argument `methods` of `periodic_response`; methods may share a name.
    block : int
        Largest number of points in a call of `solve`, which bounds the memory.
    on_mesh : bool
        Whether its orbits lie on meshes, so that they can be kept.
    """

    name: ClassVar[str]
    choice: ClassVar[str]
    block: ClassVar[int] = 2048
    on_mesh: ClassVar[bool] = True

    def suits(self, problem: Problem) -> bool:
        """Whether the method can solve these equations under this load; by default it can any."""
        return True

    def candidates(self, solution: Solution) -> Index:
        """Points that the method may solve, by their outcome so far; by default all unsolved."""
        return np.flatnonzero(~solution.converged)

    @abstractmethod
    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """Look for the orbits of all points of `problem`.

        Parameters
        ----------
        problem : Problem
            NumPy arrays with the points along the last axis.
        options : SearchOptions

        Returns
        -------
        Solution
            Converged points have passed the checks of the method; `outcome` and `detail` of the
            other points say why they have not.
        """
