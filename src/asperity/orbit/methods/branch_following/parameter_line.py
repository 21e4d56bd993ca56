"""Straight lines through the space of all parameters: what a branch of orbits is followed along.

Every parameter x of the equations and of the load depends on one coordinate t,

    x(t) = (x + a t) e^(g t),

evenly where a is given and by equal factors where g is. Which parameters move is data, not code, so
that one compiled program serves for all of them.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.slider.problem import Problem

Float = NDArray[np.float64]


class ParameterLine(NamedTuple):
    """A line in the parameters of many operating points, NumPy arrays (points,).

    Attributes
    ----------
    origin : Problem
        Parameters at t = 0.
    added, growth : Problem
        The coefficients a and g of each parameter.
    """

    origin: Problem
    added: Problem
    growth: Problem

    def at(self, t: Float) -> Problem:
        """Parameters at the coordinate `t`, shape (points,)."""
        return jax.tree.map(lambda x, a, g: (x + a * t) * np.exp(g * t), *self)

    def slope(self, t: Float) -> Problem:
        """Their derivatives by t."""
        return jax.tree.map(lambda x, a, g: (a + g * (x + a * t)) * np.exp(g * t), *self)


def still(problem: Problem) -> Problem:
    """Coefficients of a line that does not move."""
    return jax.tree.map(np.zeros_like, problem)


def amplitude_line(problem: Problem) -> ParameterLine:
    """From steady sliding at t = 0 to the modulation asked for at t = 1."""
    origin = problem._replace(load=jax.tree.map(np.zeros_like, problem.load))
    added = still(problem)._replace(load=problem.load)
    return ParameterLine(origin, added, still(problem))
