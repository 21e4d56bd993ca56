"""The plane of a map, and the responses at positions on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from asperity.errors import InputError
from asperity.laws import Law
from asperity.operating_point import without_mass
from asperity.sweep.crossing import STABILITY
from asperity.sweep.map.axis import Axis
from asperity.sweep.outcome import Answers
from asperity.sweep.points import Float
from asperity.sweep.responses import answers_of_law

#: Outputs that are kept of each point.
OUTPUTS = ("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2", *STABILITY)


@dataclass(frozen=True)
class MapPlane:
    """Two axes, and the fixed numbers.

    Attributes
    ----------
    law : type of Law
    fixed : mapping of str to float
        SI numbers by name: all parameters of the operating point that are not on an axis.
    x, y : Axis
    """

    law: type[Law]
    fixed: Mapping[str, float]
    x: Axis
    y: Axis

    outputs = OUTPUTS

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        return self.y.count, self.x.count

    def nodes(self) -> Float:
        """Positions of the grid's points, shape (rows x columns, 2), row by row."""
        u = np.linspace(0.0, 1.0, self.x.count)
        v = np.linspace(0.0, 1.0, self.y.count)
        return np.stack([a.ravel() for a in np.meshgrid(u, v)], axis=-1)

    def values(self, where: Float) -> dict[str, Float]:
        """Numbers of the operating points at some positions, in SI.

        Parameters
        ----------
        where : array, shape (points, 2)
            Fractions of the x and of the y axis.
        """
        points = len(where)
        values = {name: np.full(points, float(value)) for name, value in self.fixed.items()}
        values[self.x.name] = self.x.at(where[:, 0])
        values[self.y.name] = self.y.at(where[:, 1])
        if without_mass(values).any():
            raise InputError(
                "M must be positive where inertia is asked for, got 0 kg; give the mass, as "
                "M='1.6 kg'"
            )
        return values

    def solve(self, where: Float, progress: Callable[[int], None] | None = None) -> Answers:
        """Responses at some positions.

        Parameters
        ----------
        where : array, shape (points, 2)
            As for `values`.
        progress : callable, optional
            Called with the number of points finished since the last call.
        """
        return answers_of_law(self.law, self.values(where), OUTPUTS, progress)
