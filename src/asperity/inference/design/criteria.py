"""Criteria of a design: how well its readings measure parameters, or exclude a law.

A design gives each candidate a number of readings n_i, which need not be whole. Readings are
independent: with the derivatives J_i of a reading in standard uncertainties, the information matrix
is the sum of n_i J_i^T J_i, plus that of priors. It is R^T R with the triangle R of the rows J_i
times sqrt(n_i). With the parameters of interest last, the criterion, -ln det of their covariance
matrix, is the sum of ln R_aa^2 over them. Its derivatives follow from the rows J_i R^-1.

`Determinant` measures parameters (D_s-optimality: the determinant of their covariance matrix, the
others being estimated too). `Misfit` excludes a law (T-optimality: the smallest chi-squared that
the rival can reach; Atkinson and Fedorov, Biometrika 62, 57, 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np

from asperity.arrays import Float, Index

#: Relative addition to the diagonal of an information matrix, which makes it invertible.
_RIDGE = 1e-11
#: Relative round-off of a sum of squares.
_ROUND_OFF = 1e-30


class Determinant:
    """-ln det of the covariance matrix of some parameters, averaged over draws.

    Parameters
    ----------
    jacobian : array, shape (draws, candidates, m, p)
        Derivatives of the m observables of one reading, in standard uncertainties.
    prior : array, shape (q, p)
        Derivatives of the residuals of priors.
    interest : sequence of int
        Indices of the parameters to be measured; all indices for D-optimality.
    ridge : array, shape (p,), optional
        Relative addition to the diagonal of the information matrix.
    """

    def __init__(
        self,
        jacobian: Float,
        prior: Float,
        interest: Sequence[int],
        ridge: Float | float = _RIDGE,
    ) -> None:
        p = jacobian.shape[-1]
        others = [i for i in range(p) if i not in interest]
        order = [*others, *interest]
        self.interest = slice(len(others), p)
        self.parameters = len(interest)
        squares = np.einsum("kima,kima->ka", jacobian, jacobian) + np.sum(prior**2, axis=0)
        squares = np.where(squares > 0, squares, 1.0) / max(jacobian.shape[1], 1)
        diagonal = np.sqrt(ridge * squares)[:, None] * np.eye(p)
        known = np.broadcast_to(prior, (len(jacobian), *prior.shape))
        self._prior = np.concatenate([known, diagonal], axis=1)[..., order]
        self._jacobian = jacobian[..., order]

    @property
    def size(self) -> int:
        """Number of candidates."""
        return int(self._jacobian.shape[1])

    def _triangle(self, n: Float) -> Float:
        """The triangle R of each draw, shape (draws, p, p)."""
        rows = self._jacobian[:, n > 0] * np.sqrt(n[n > 0])[:, None, None]
        rows = rows.reshape(len(rows), -1, rows.shape[-1])
        return np.asarray(np.linalg.qr(np.concatenate([rows, self._prior], axis=1), mode="r"))

    def value(self, n: Float) -> float:
        """The criterion: mean over the draws."""
        diagonal = np.diagonal(self._triangle(n), axis1=-2, axis2=-1)[:, self.interest]
        return float(2 * np.log(np.abs(diagonal)).sum(-1).mean())

    def gradient(self, n: Float) -> Float:
        """Derivatives of the criterion with respect to the numbers of readings."""
        rows = self._jacobian @ np.linalg.inv(self._triangle(n))[:, None]
        return np.asarray((rows[..., self.interest] ** 2).sum((-2, -1)).mean(0))

    def second_order(self, n: Float, at: Index) -> tuple[Float, Float]:
        """The quadratic approximation about n, of the numbers x of readings of some candidates.

        Parameters
        ----------
        n : array, shape (candidates,)
        at : array of int, shape (some,)
            Candidates that may have readings.

        Returns
        -------
        matrix, array of shape (rows, some), and target, array of shape (rows,)
            The criterion is constant less half of the squares of matrix @ x - target.

        Notes
        -----
        With Z_i = J_i R^-1, the first derivatives are the traces of Z_i^T Z_i over the parameters
        of interest. The second derivatives are minus the inner products of these matrices without
        the block of the other parameters.
        """
        inverse = np.linalg.inv(self._triangle(n))
        rows, prior = self._jacobian[:, at] @ inverse[:, None], self._prior @ inverse
        # The sum over the readings n and priors is the unit matrix.
        target = 2 * np.eye(inverse.shape[-1]) - prior.swapaxes(1, 2) @ prior
        products = np.einsum("kima,kimb->kabi", rows[..., self.interest], rows)
        # The matrices are symmetric: elements next to the block count twice.
        twice = np.where(np.arange(inverse.shape[-1]) < self.interest.start, np.sqrt(2), 1.0)
        scale = twice / np.sqrt(len(rows))
        matrix = (products * scale[:, None]).reshape(-1, len(at))
        return matrix, (target[:, self.interest] * scale).ravel()

    def exchanged(self, n: Float) -> Float:
        """Criterion with one more reading of each candidate."""
        triangle = self._triangle(n)
        rows = self._jacobian @ np.linalg.inv(triangle)[:, None]

        def gain(part: Float) -> Float:
            products = part @ part.swapaxes(-1, -2)
            return np.asarray(np.linalg.slogdet(np.eye(part.shape[-2]) + products)[1].mean(0))

        return self.value(n) + gain(rows) - gain(rows[..., : self.interest.start])

    def least_efficiency(self, weights: Float, slope: Float) -> float:
        """Lower bound of the efficiency of design weights, by the general equivalence theorem.

        The efficiency is the inverse variance over that of the best design: of the root of the
        determinant whose order is the number of parameters of interest, which is a concave function
        of the weights.

        Parameters
        ----------
        weights, slope : array, shape (candidates,)
            Weights, and derivatives of the criterion with respect to these.
        """
        gap = max(float(slope.max() - weights @ slope), 0.0)
        return 1 / (1 + gap / self.parameters)

    def restricted(self, rows: Index) -> Self:
        """The criterion for some of the candidates."""
        part = copy(self)
        part._jacobian = self._jacobian[:, rows]
        return part


class Misfit(Determinant):
    """Logarithm of the smallest chi-squared of a rival law with linear predictions.

    The residuals are one more column of the Jacobian. The last element of the triangle is the root
    of chi-squared of the refitted rival.

    Parameters
    ----------
    residual : array, shape (candidates, m)
        Rival's prediction less the expected reading, in standard uncertainties, at some values of
        the rival's parameters.
    jacobian : array, shape (candidates, m, p)
        Derivatives of the residual at these values.
    prior_residual : array, shape (q,)
        Residuals of the rival's priors.
    prior_jacobian : array, shape (q, p)
    """

    def __init__(
        self, residual: Float, jacobian: Float, prior_residual: Float, prior_jacobian: Float
    ) -> None:
        self.residual, self.jacobian = residual, jacobian
        self.prior_residual, self.prior_jacobian = prior_residual, prior_jacobian
        columns = np.concatenate([jacobian, residual[..., None]], axis=-1)
        prior = np.column_stack([prior_jacobian, prior_residual])
        p = jacobian.shape[-1]
        # What is added to the squares of the residuals counts as chi-squared: only their round-off.
        ridge = np.append(np.full(p, _RIDGE), _ROUND_OFF)
        super().__init__(columns[None], prior, [p], ridge)
