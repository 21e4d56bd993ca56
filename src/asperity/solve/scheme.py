"""Collocation methods: where in an interval the equations are obeyed, and with what weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import Legendre, leggauss, legvander
from numpy.typing import NDArray

from asperity.slider import Motion, RadiatingAsperities, StiffInertial

#: Collocation points in an interval.
STAGES = 4


@dataclass(frozen=True, eq=False)
class Scheme:
    """A collocation method on [0, 1].

    Attributes
    ----------
    name : str
    c : array, shape (STAGES,)
        Collocation points.
    a : array, shape (STAGES, STAGES)
        Integrals from 0 to c_j of the polynomials that interpolate at c.
    b : array, shape (STAGES,)
        The same from 0 to 1.
    monomials : array, shape (STAGES, STAGES)
        Coefficients of x^k from values at c.
    top : array, shape (STAGES,)
        The highest Legendre coefficient from values at c: what is left of a resolved orbit.
    """

    name: str
    c: NDArray[np.float64]
    a: NDArray[np.float64]
    b: NDArray[np.float64]
    monomials: NDArray[np.float64]
    top: NDArray[np.float64]

    @classmethod
    def at(cls, name: str, points: NDArray[np.float64]) -> Scheme:
        """The method that collocates at `points` of [-1, 1]."""
        c = (points + 1) / 2
        powers = np.arange(1, len(c) + 1)
        monomials = np.linalg.inv(np.vander(c, increasing=True))
        return cls(
            name,
            c,
            (c[:, None] ** powers / powers) @ monomials,
            (1 / powers) @ monomials,
            monomials,
            np.linalg.inv(legvander(points, len(c) - 1))[-1],
        )


def _radau_points() -> NDArray[np.float64]:
    """Zeros of P_s - P_{s-1}, of which the last is 1."""
    points = np.sort((Legendre.basis(STAGES) - Legendre.basis(STAGES - 1)).roots().real)
    points[-1] = 1.0
    return points


#: Order 8. Preserves what oscillates and lets what should decay within a step decay too little.
GAUSS = Scheme.at("Gauss-Legendre", leggauss(STAGES)[0])

#: Order 7. What decays within a step is gone after it.
RADAU = Scheme.at("Radau IIA", _radau_points())


def scheme_for(system: Motion) -> Scheme:
    """The method for an equation of motion."""
    return RADAU if isinstance(system, StiffInertial | RadiatingAsperities) else GAUSS
