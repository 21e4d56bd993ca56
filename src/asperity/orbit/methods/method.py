"""What every method that finds periodic orbits has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from asperity.orbit.batches import Indices
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem


class Method(ABC):
    """A method that finds periodic orbits.

    A search goes through a list of methods; each is given the points that the ones before it left
    and that it may help. To add one, implement it and put it into
    `asperity.orbit.search`.

    Class attributes
    ----------------
    name : str
        What results call it.
    choice : str
        What a user calls it in the `methods` of `periodic_response`; several may share one.
    block : int
        Points that it is given at a time, which bounds its memory.
    on_mesh : bool
        Whether its orbits lie on meshes, so that they can be kept.
    """

    name: ClassVar[str]
    choice: ClassVar[str]
    block: ClassVar[int] = 2048
    on_mesh: ClassVar[bool] = True

    @abstractmethod
    def suits(self, problem: Problem) -> bool:
        """Whether the method knows these equations under this load."""

    def candidates(self, solution: Solution) -> Indices:
        """Points that it may help, by their outcome so far: all that are not solved."""
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
            Converged points have passed the method's own checks; of the others `outcome` and
            `detail` say what was learnt.
        """
