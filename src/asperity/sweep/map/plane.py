"""The plane of a map, and the responses at positions on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.laws import Law
from asperity.operating_point import motions, respond, without_contact, without_mass
from asperity.orbit.floquet import kind_of_crossing
from asperity.parameters.arguments import increments
from asperity.sweep.map.axis import Axis

Float = NDArray[np.float64]

#: Numbers kept of the response at a point, besides `converged` and `result`.
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
class PointResponses:
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
    def empty(cls, count: int) -> PointResponses:
        """Arrays for `count` points, none of them solved."""
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
        """Bifurcation of the leading multiplier at the unit circle; "" where not known."""
        return kind_of_crossing(self["log_multiplier"] + 1j * self["multiplier_argument"])

    def take(self, index: NDArray[Any]) -> PointResponses:
        """The points `index`, by number or by a mask."""
        return PointResponses(self.numbers[:, index], self.converged[index], self.result[index])

    def put(self, index: NDArray[np.intp], others: PointResponses) -> None:
        """Replace the points `index` by `others`."""
        self.numbers[:, index] = others.numbers
        self.converged[index] = others.converged
        self.result[index] = others.result


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

    def solve(self, where: Float, progress: Callable[[int], None] | None = None) -> PointResponses:
        """Responses at some positions.

        Parameters
        ----------
        where : array, shape (points, 2)
            As for `values`.
        progress : callable, optional
            Called with the number of points finished since the last call.
        """
        return (
            solve_points(self.law, self.values(where), progress)
            if len(where)
            else PointResponses.empty(0)
        )


def solve_points(
    law: type[Law], values: dict[str, Float], progress: Callable[[int], None] | None = None
) -> PointResponses:
    """Responses at operating points, each group with one equation of motion on its own.

    A point at which the contact is lost within the period has no response; `result` says why.

    Parameters
    ----------
    law : type of Law
    values : dict of str to array, shape (points,)
        All numbers in SI.
    progress : callable, optional
        Called with the number of points finished since the last call.
    """
    points = PointResponses.empty(len(values["V"]))
    reasons = np.array(without_contact(values), dtype=object)
    points.result[:] = reasons
    kept = np.flatnonzero(reasons == "")
    if progress is not None and len(kept) < len(reasons):
        progress(len(reasons) - len(kept))
    for group in motions({name: value[kept] for name, value in values.items()}):
        index = kept[group]
        some = {name: value[index] for name, value in values.items()}
        points.put(index, _solve(law, some, progress))
    return points


def _solve(
    law: type[Law], values: dict[str, Float], progress: Callable[[int], None] | None
) -> PointResponses:
    response = respond(law, values, increments(progress))
    logs = response.log_multipliers
    leading = logs[..., 0] if logs.shape[-1] else np.full(len(logs), -np.inf + 0j)
    own = {"log_multiplier": leading.real, "multiplier_argument": leading.imag}
    numbers = [own[n] if n in own else getattr(response, n) for n in NUMBERS]
    # A phase of a point that failed may be 0 where its modulus is NaN.
    kept = np.where(response.converged, np.stack(numbers), np.nan)
    return PointResponses(kept, response.converged, response.result)
