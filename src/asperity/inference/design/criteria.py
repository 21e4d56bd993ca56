"""What a design maximises: concave functions of the information that its readings add up to.

A design is a measure n over candidates: the number of readings of each, whole or not. Readings are
independent, so that the information matrix is the sum of n_i M_i, plus that of priors.

`Determinant` measures parameters (D_s-optimality: the determinant of their covariance matrix, the
others estimated beside them). `Misfit` excludes a law (T-optimality: the smallest chi-squared that
the rival can reach; Atkinson and Fedorov, Biometrika 62, 57, 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

#: Added to the diagonal of an information matrix, relative to its scale, so that it has an inverse.
_RIDGE = 1e-11


class Criterion(Protocol):
    """A concave, increasing function of the numbers of readings.

    Attributes
    ----------
    size : int
        Number of candidates.
    """

    @property
    def size(self) -> int:
        """Number of candidates."""
        ...

    def value(self, n: Float) -> float:
        """Criterion of a design n, shape (candidates,)."""
        ...

    def gradient(self, n: Float) -> Float:
        """Derivatives to the number of readings of each candidate, shape (candidates,)."""
        ...

    def exchanged(self, n: Float) -> Float:
        """Criterion of n with one more reading, for each candidate, shape (candidates,)."""
        ...

    def least_efficiency(self, gap: float, value: float) -> float:
        """Share of the information of the best design that is reached at least.

        Parameters
        ----------
        gap : float
            By how much the best design can exceed `value` at most.
        """
        ...

    def restricted(self, rows: NDArray[np.intp]) -> Criterion:
        """The same for some of the candidates."""
        ...


class Determinant:
    """-ln det of the covariance matrix of some parameters, averaged over draws.

    Parameters
    ----------
    information : array, shape (draws, candidates, p, p)
        Fisher information of one reading.
    prior : array, shape (draws, p, p)
        Information of priors.
    interest : sequence of int
        The parameters to be measured; all of them for D-optimality.
    """

    def __init__(self, information: Float, prior: Float, interest: Sequence[int]) -> None:
        self.information, self.prior = information, prior
        p = information.shape[-1]
        self.interest = list(interest)
        self.others = [i for i in range(p) if i not in self.interest]
        largest = np.einsum("kiaa->ka", information) + np.einsum("kaa->ka", prior)
        ridge = _RIDGE * np.where(largest > 0, largest, 1.0) / max(information.shape[1], 1)
        self._ridge = np.einsum("ka,ab->kab", ridge, np.eye(p))

    @property
    def size(self) -> int:
        """Number of candidates."""
        return int(self.information.shape[1])

    def total(self, n: Float) -> Float:
        """Information matrix of each draw, shape (draws, p, p)."""
        summed = np.einsum("i,kiab->kab", n, self.information)
        return np.asarray(summed + self.prior + self._ridge)

    def value(self, n: Float) -> float:
        """Mean over the draws."""
        return float(self._log_ratio(self.total(n)).mean())

    def _log_ratio(self, total: Float) -> Float:
        """Ln det M - ln det M22, over the leading axes."""
        whole = np.linalg.slogdet(total)[1]
        if not self.others:
            return np.asarray(whole)
        block = total[..., self.others, :][..., self.others]
        return np.asarray(whole - np.linalg.slogdet(block)[1])

    def gradient(self, n: Float) -> Float:
        """Tr(M^-1 M_i) less the same of the other parameters' block, averaged over the draws."""
        total = self.total(n)
        weight = np.linalg.inv(total)
        if self.others:
            pick = np.ix_(self.others, self.others)
            for k in range(len(total)):
                weight[k][pick] -= np.linalg.inv(total[k][pick])
        return np.asarray(np.einsum("kab,kiab->i", weight, self.information) / len(total))

    def exchanged(self, n: Float) -> Float:
        """Criterion with one more reading of each candidate."""
        total = self.total(n)[:, None] + self.information
        return self._log_ratio(total).mean(0)

    def least_efficiency(self, gap: float, value: float) -> float:
        """Of the s-th root of the determinant, which is inverse to a variance."""
        return float(np.exp(-max(gap, 0.0) / len(self.interest)))

    def restricted(self, rows: NDArray[np.intp]) -> Determinant:
        """The same for some of the candidates."""
        part = Determinant(self.information[:, rows], self.prior, self.interest)
        part._ridge = self._ridge
        return part


class Misfit:
    """Smallest chi-squared of a rival law whose predictions are linear in its parameters.

    Parameters
    ----------
    residual : array, shape (candidates, m)
        Rival's prediction less the expected reading, in standard uncertainties, at some values of
        the rival's parameters.
    jacobian : array, shape (candidates, m, p)
        Its derivatives there.
    prior_residual : array, shape (q,)
        Of the rival's priors.
    prior_jacobian : array, shape (q, p)
    """

    def __init__(
        self, residual: Float, jacobian: Float, prior_residual: Float, prior_jacobian: Float
    ) -> None:
        self.residual, self.jacobian = residual, jacobian
        self.prior_residual, self.prior_jacobian = prior_residual, prior_jacobian
        self._square = np.einsum("im,im->i", residual, residual)
        self._slope = np.einsum("imp,im->ip", jacobian, residual)
        self._curvature = np.einsum("imp,imq->ipq", jacobian, jacobian)
        self._prior = (
            float(prior_residual @ prior_residual),
            prior_jacobian.T @ prior_residual,
            prior_jacobian.T @ prior_jacobian,
        )
        largest = np.einsum("iaa->a", self._curvature) + np.diag(self._prior[2])
        self._ridge = np.diag(_RIDGE * np.where(largest > 0, largest, 1.0) / max(len(residual), 1))

    @property
    def size(self) -> int:
        """Number of candidates."""
        return len(self.residual)

    def _sums(self, n: Float) -> tuple[float, Float, Float]:
        square, slope, curvature = self._prior
        return (
            square + float(n @ self._square),
            slope + n @ self._slope,
            curvature + np.einsum("i,ipq->pq", n, self._curvature) + self._ridge,
        )

    def step(self, n: Float) -> Float:
        """Change of the rival's coordinates that minimises chi-squared, shape (p,)."""
        _, slope, curvature = self._sums(n)
        return np.asarray(-np.linalg.solve(curvature, slope))

    def value(self, n: Float) -> float:
        """chi-squared of the refitted rival."""
        square, slope, curvature = self._sums(n)
        return float(square - slope @ np.linalg.solve(curvature, slope))

    def gradient(self, n: Float) -> Float:
        """chi-squared of the refitted rival at each candidate."""
        refitted = self.residual + self.jacobian @ self.step(n)
        return np.asarray(np.einsum("im,im->i", refitted, refitted))

    def exchanged(self, n: Float) -> Float:
        """chi-squared with one more reading of each candidate."""
        square, slope, curvature = self._sums(n)
        slopes = slope + self._slope
        steps = np.linalg.solve(curvature + self._curvature, slopes[..., None])[..., 0]
        return np.asarray(square + self._square - np.einsum("ip,ip->i", slopes, steps))

    def least_efficiency(self, gap: float, value: float) -> float:
        """Of chi-squared."""
        return float(value / (value + max(gap, 0.0))) if value > 0 else 0.0

    def restricted(self, rows: NDArray[np.intp]) -> Misfit:
        """The same for some of the candidates."""
        part = Misfit(
            self.residual[rows], self.jacobian[rows], self.prior_residual, self.prior_jacobian
        )
        part._ridge = self._ridge
        return part
