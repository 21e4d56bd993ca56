"""The interface of a method that finds periodic orbits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from asperity.orbit.batches import Indices
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem


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

    @abstractmethod
    def suits(self, problem: Problem) -> bool:
        """Whether the method can solve these equations under this load."""

    def candidates(self, solution: Solution) -> Indices:
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
            Converged points have passed the checks of the method; for the others `outcome` and
            `detail` say what was learnt.
        """
