"""Coefficients of Runge-Kutta methods: explicit of order 8, Rosenbrock of order 5, collocation.

Sources: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.
(Springer, 1993), section II.5; E. Hairer, G. Wanner, Solving Ordinary Differential
Equations II, 2nd ed. (Springer, 1996), sections IV.5 and IV.7;
G. Steinebach, BIT Numer. Math. 63, 27 (2023).
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from jax.tree_util import register_static
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss, legvander

from asperity.arrays import Float


class ExplicitTableau(NamedTuple):
    """The method of order 8 of Dormand and Prince, with dense output of order 7.

    Attributes
    ----------
    A : array, shape (13, 12)
        Row k gives the state at stage k; the last row gives the end of the step.
    C : array, shape (13,)
        Times of the stages in parts of the step.
    E5, E3 : array, shape (13,)
        Weights of the error estimates of orders 5 and 3.
    extra_A : array, shape (3, 16)
        Further stages of the dense output.
    extra_C : array, shape (3,)
    powers : array, shape (8, 16)
        Dense output in rising powers of the share of the step, from all stages.
    """

    A: Float
    C: Float
    E5: Float
    E3: Float
    extra_A: Float
    extra_C: Float
    powers: Float


@cache
def dormand_prince_8() -> ExplicitTableau:
    """The coefficients, from a file, because SciPy's integrators load slowly."""
    table = tomllib.loads(files(__package__).joinpath("dormand_prince_8.toml").read_text())
    change, first, last = _rows([table["B"]], 16)[0], np.eye(16)[0], np.eye(16)[12]
    F = np.vstack([change, first - change, 2 * change - last - first, _rows(table["D"], 16)])
    return ExplicitTableau(
        A=_rows([*table["A"], table["B"]], 12),
        C=np.append(table["C"], 1.0),
        E5=_rows([table["E5"]], 13)[0],
        E3=_rows([table["E3"]], 13)[0],
        extra_A=_rows(table["A_EXTRA"], 16),
        extra_C=np.array(table["C_EXTRA"]),
        powers=_power_basis() @ F,
    )


class RosenbrockTableau(NamedTuple):
    """The method Rodas5P of order 5, with dense output of order 4.

    In the transformed stages u_k of length h of Hairer and Wanner (1996), eq. (7.25):

        (1 / (gamma h) - J) u_k = f(t + nodes_k h, y + sum A_kj u_j) + sum C_kj u_j / h
                                  + h by_time_k df/dt.

    Attributes
    ----------
    gamma : float
    nodes : array, shape (8,)
        Times of the stages in parts of the step.
    A, C : array, shape (8, 8)
        The last state plus the last stage is the end of the step, and this stage estimates the
        error of the solution of order 4.
    by_time : array, shape (8,)
    dense : array, shape (3, 8)
        Dense output y0 + x (y1 - y0 + (1 - x) (d0 + x (d1 + x d2))), of d = dense @ u.
    """

    gamma: float
    nodes: Float
    A: Float
    C: Float
    by_time: Float
    dense: Float


@cache
def rodas_5p() -> RosenbrockTableau:
    """The coefficients, from a file."""
    table = tomllib.loads(files(__package__).joinpath("rodas_5p.toml").read_text())
    return RosenbrockTableau(
        table["gamma"],
        np.array(table["nodes"]),
        _rows(table["A"], 8),
        _rows(table["C"], 8),
        np.array(table["by_time"]),
        np.array(table["dense"]),
    )


def _rows(rows: list[list[float]], columns: int) -> Float:
    """Rows of a table, padded with zeros."""
    table = np.zeros((len(rows), columns))
    for row, values in zip(table, rows, strict=True):
        row[: len(values)] = values
    return table


def _power_basis() -> Float:
    """Dense output y + x (F0 + (1-x) (F1 + x (F2 + (1-x) (F3 + ...)))) in powers of x: (8, 7)."""
    x, rest = Polynomial([0.0, 1.0]), Polynomial([1.0, -1.0])
    matrix, factor = np.zeros((8, 7)), Polynomial([1.0])
    for i in range(7):
        factor = factor * (x if i % 2 == 0 else rest)
        matrix[: len(factor.coef), i] = factor.coef
    return matrix


@register_static
@dataclass(frozen=True, eq=False)
class CollocationScheme:
    """A collocation method on [0, 1].

    Attributes
    ----------
    name : str
    c : array, shape (stages,)
        Collocation points.
    a : array, shape (stages, stages)
        Integrals from 0 to c_j of the polynomials that interpolate at c.
    b : array, shape (stages,)
        The same from 0 to 1.
    monomials : array, shape (stages, stages)
        Coefficients of x^k from values at c.
    top : array, shape (stages,)
        The highest Legendre coefficient from values at c: the remainder of a resolved orbit.
    """

    name: str
    c: Float
    a: Float
    b: Float
    monomials: Float
    top: Float

    @classmethod
    def at(cls, name: str, points: Float) -> CollocationScheme:
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


def gauss_legendre(stages: int) -> CollocationScheme:
    """The method of order 2 `stages`.

    It preserves oscillations, but modes that decay within a step decay too little.
    """
    return CollocationScheme.at("Gauss-Legendre", leggauss(stages)[0])


def radau_iia(stages: int) -> CollocationScheme:
    """The method of order 2 `stages` - 1, in which modes that decay within a step vanish.

    Its points are the zeros of P_s - P_(s-1), of which the last is 1.
    """
    points = np.sort((Legendre.basis(stages) - Legendre.basis(stages - 1)).roots().real)
    points[-1] = 1.0
    return CollocationScheme.at("Radau IIA", points)
