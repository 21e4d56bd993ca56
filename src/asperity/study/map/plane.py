"""The plane of a map: from positions on it to responses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.laws import Law
from asperity.solve.floquet import kind_of_crossing
from asperity.study.map.axis import Axis
from asperity.study.operating_point import motions, respond, without_mass

Float = NDArray[np.float64]

#: What is kept of the response at a point, besides `converged` and `result`.
NUMBERS = (
    "mean_friction",
    "delta_mu",
    "mu1",
    "mu2",
    "phase1",
    "phase2",
    "log_multiplier",
    "multiplier_argument",
)


@dataclass
class Points:
    """Responses at some positions.

    Attributes
    ----------
    numbers : array, shape (len(NUMBERS), points)
        NaN where not converged. ``log_multiplier`` is ln|m| of the leading multiplier, -inf
        for a law without dynamics, and ``multiplier_argument`` its arg m (rad).
    converged : bool array, shape (points,)
    result : object array, shape (points,)
        "converged", or why not.
    """

    numbers: Float
    converged: NDArray[np.bool_]
    result: NDArray[np.object_]

    @classmethod
    def empty(cls, count: int) -> Points:
        """Room for `count` points, none of them solved."""
        return cls(
            np.full((len(NUMBERS), count), np.nan),
            np.zeros(count, dtype=bool),
            np.full(count, "", dtype=object),
        )

    def __getitem__(self, name: str) -> Float:
        return self.numbers[NUMBERS.index(name)]

    @property
    def stable(self) -> NDArray[np.bool_]:
        """All multipliers inside the unit circle; False where not converged."""
        return self.converged & (self["log_multiplier"] < 0)

    @property
    def mode(self) -> NDArray[np.object_]:
        """Bifurcation that the leading multiplier stands for; "" where not known."""
        return kind_of_crossing(self["log_multiplier"] + 1j * self["multiplier_argument"])

    def take(self, index: NDArray[Any]) -> Points:
        """The points `index`, by number or by a mask."""
        return Points(self.numbers[:, index], self.converged[index], self.result[index])

    def put(self, index: NDArray[np.intp], others: Points) -> None:
        """Take over `others` at the places `index`."""
        self.numbers[:, index] = others.numbers
        self.converged[index] = others.converged
        self.result[index] = others.result


@dataclass(frozen=True)
class Plane:
    """Two axes, and the numbers that stay the same.

    Attributes
    ----------
    law : type of Law
    fixed : mapping of str to float
        SI numbers by name: all of `quantities` that are not on an axis.
    x, y : Axis
    """

    law: type[Law]
    fixed: Mapping[str, float]
    x: Axis
    y: Axis

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
        """Every number of the operating points at some positions, in SI.

        Parameters
        ----------
        where : array, shape (points, 2)
            Fractions of the x and of the y axis.
        """
        points = len(where)
        found = {name: np.full(points, float(value)) for name, value in self.fixed.items()}
        found[self.x.name] = self.x.at(where[:, 0])
        found[self.y.name] = self.y.at(where[:, 1])
        if without_mass(found).any():
            raise InputError(
                "M must be positive where inertia is asked for, got 0 kg; give the mass, as "
                "M='1.6 kg'"
            )
        return found

    def solve(self, where: Float, progress: Callable[[int], None] | None = None) -> Points:
        """Responses at some positions.

        Parameters
        ----------
        where : array, shape (points, 2)
            As for `values`.
        progress : callable, optional
            Told the number of points finished since the last call.
        """
        return (
            solve_points(self.law, self.values(where), progress) if len(where) else Points.empty(0)
        )


def solve_points(
    law: type[Law], values: dict[str, Float], progress: Callable[[int], None] | None = None
) -> Points:
    """Responses at operating points, each group with one equation of motion on its own.

    Parameters
    ----------
    law : type of Law
    values : dict of str to array, shape (points,)
        All numbers in SI.
    progress : callable, optional
        Told the number of points finished since the last call.
    """
    points = Points.empty(len(values["V"]))
    for group in motions(values):
        some = {name: value[group] for name, value in values.items()}
        points.put(group, _solve(law, some, progress))
    return points


def _solve(
    law: type[Law], values: dict[str, Float], progress: Callable[[int], None] | None
) -> Points:
    response = respond(law, values, progress)
    logs = response.log_multipliers
    leading = logs[..., 0] if logs.shape[-1] else np.full(len(logs), -np.inf + 0j)
    own = {"log_multiplier": leading.real, "multiplier_argument": leading.imag}
    numbers = [own[n] if n in own else getattr(response, n) for n in NUMBERS]
    # A phase of a point that failed may be 0 where its modulus is NaN.
    kept = np.where(response.converged, np.stack(numbers), np.nan)
    return Points(kept, response.converged, response.result)
