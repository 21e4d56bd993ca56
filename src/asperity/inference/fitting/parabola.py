"""Chi-squared about a minimum, to second order: what data say of each parameter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as chi_squared

from asperity.inference.objective import Objective, Residuals

Float = NDArray[np.float64]

#: A standard deviation of a coordinate, in factors of e, beyond which data say nothing.
UNDETERMINED = 1.0
#: A delay that is nearer to its bound, as a share of its range, is there.
_AT_BOUND = 1e-3
#: Standard deviations from a bound within which a gradient towards it is held by the bound.
_NEAR_BOUND = 0.1
#: Decrease of chi-squared that must not be left at a minimum: a third of a standard error.
_STOPPED = 0.1


@dataclass(frozen=True)
class Parabola:
    """Chi-squared about a minimum.

    Attributes
    ----------
    u : array, shape (n,)
        Coordinates of the minimum.
    chi2 : float
    data : tuple of Residuals
        Of each term.
    covariance : array, shape (n, n)
        Of the coordinates, under noise that is known.
    missing : bool array, shape (n,)
        Coordinates that nothing bounds.
    total : array, shape (n, n)
        The covariance with what noise adds that is estimated from the same data.
    freedom : array, shape (n,)
        Degrees of freedom of its diagonal.
    unbounded : array, shape (n,)
        Minimum of the parabola without the bounds that hold coordinates of the minimum.
    undetermined : tuple of str
        Parameters of which the data say nothing.
    stopped : bool
        Whether chi-squared still falls where the law has no orbit.
    fitted, priors : int
        Numbers that were fitted, those of the noise included, and of priors.
    """

    u: Float
    chi2: float
    data: tuple[Residuals, ...]
    covariance: Float
    missing: NDArray[np.bool_]
    total: Float
    freedom: Float
    unbounded: Float
    undetermined: tuple[str, ...]
    stopped: bool
    fitted: int
    priors: int

    @property
    def sd(self) -> Float:
        """Standard deviations of the coordinates under known noise."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def se(self) -> Float:
        """Their standard errors, with what estimated noise adds."""
        return np.asarray(np.sqrt(np.diag(self.total)))

    @property
    def readings(self) -> int:
        """Number of data."""
        return sum(d.values.size for d in self.data)

    @property
    def dof(self) -> int:
        """Degrees of freedom."""
        return self.readings + self.priors - self.fitted

    @property
    def p_value(self) -> float:
        """Probability of as large a chi-squared by chance; NaN without degrees of freedom."""
        return float(chi_squared.sf(self.chi2, self.dof)) if self.dof > 0 else math.nan


def parabola_of(objective: Objective, u: Float, chi2: float) -> Parabola | None:
    """The parabola at a minimum; None where the law has no solution after all."""
    r, J = objective.residuals(u)
    data = objective.data_residuals(u)
    if data is None:
        return None
    # A delay whose range the pieces of the drive leave no room in is as good as known.
    J = np.where(_held(objective, u), 0.0, J)
    covariance, missing = inverse_information(J.T @ J)
    total, freedom = _with_estimated_noise(objective, u, covariance, missing)
    of_data = np.sum([d.jacobian.T @ d.jacobian for d in data], axis=0)
    # What is known of the instrument belongs to the data.
    prior_slopes = objective.prior_residuals(u)[1]
    with_prior = [v for v in objective.unknowns if v.prior is not None]
    nuisance = [v.nuisance for v in with_prior]
    informed = inverse_information(of_data + prior_slopes[nuisance].T @ prior_slopes[nuisance])[0]
    undetermined = tuple(
        unknown.name
        for i, unknown in enumerate(objective.unknowns)
        if not unknown.nuisance
        and (missing[i] or math.sqrt(max(informed[i, i], 0.0)) > UNDETERMINED)
    )
    return Parabola(
        u=u,
        chi2=chi2,
        data=tuple(data),
        covariance=covariance,
        missing=missing,
        total=total,
        freedom=freedom,
        unbounded=u - covariance @ _pressure(objective, u, covariance, J.T @ r),
        undetermined=undetermined,
        stopped=objective.noise_is_known and objective.expected_decrease(u) > _STOPPED,
        fitted=len(objective.unknowns) + sum(term.profiled for term in objective.terms),
        priors=len(with_prior),
    )


def _held(objective: Objective, u: Float) -> NDArray[np.bool_]:
    """Delays and offsets at a bound, which others do not follow beyond it.

    A stiffness at its bound is none: the data bound it on the other side.
    """
    low, high = np.array([k.bounds for k in objective.unknowns]).reshape(-1, 2).T
    linear = np.array([k.nuisance and not k.logarithmic for k in objective.unknowns], bool)
    room = np.where(np.isfinite(high - low), high - low, 1.0)
    return np.asarray(linear & (np.minimum(u - low, high - u) < _AT_BOUND * room))


def _pressure(objective: Objective, u: Float, covariance: Float, gradient: Float) -> Float:
    """The gradient in coordinates that a bound holds, 0 in others.

    There it is zero at a minimum. In a valley that is all but flat a minimisation leaves some,
    which says nothing about where the minimum is.
    """
    low, high = np.array([k.bounds for k in objective.unknowns]).reshape(-1, 2).T
    sd = np.sqrt(np.diag(covariance))
    at_low = (gradient > 0) & (u - low < _NEAR_BOUND * sd)
    at_high = (gradient < 0) & (high - u < _NEAR_BOUND * sd)
    return np.where(at_low | at_high, gradient, 0.0)


def _with_estimated_noise(
    objective: Objective, u: Float, covariance: Float, missing: NDArray[np.bool_]
) -> tuple[Float, Float]:
    """The covariance with what estimated noise adds, and degrees of freedom of its diagonal."""
    known = np.where(missing[:, None] | missing, 0.0, covariance)
    values = objective.named(u)
    slopes = np.array([float(k.slope(values[k.name])) for k in objective.unknowns])
    total, variance = covariance.copy(), np.zeros(u.size)
    for term in objective.terms:
        added, spread = term.uncertainty_of_noise(values, slopes, known)
        total += nowhere_negative(added, known)
        variance += spread
    freedom = 2 * np.diag(known) ** 2 / np.where(variance > 0, variance, 1.0)
    return total, np.where(variance > 0, np.maximum(freedom, 1.0), np.inf)


def nowhere_negative(added: Float, covariance: Float) -> Float:
    """What is added to a covariance, without what is negative by rounding.

    Where data hardly tell parameters apart, it is the difference of two numbers of many more digits
    than there are.
    """
    sd = np.sqrt(np.where(np.diag(covariance) > 0, np.diag(covariance), 1.0))
    values, vectors = np.linalg.eigh(added / np.outer(sd, sd))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(sd, sd))


def inverse_information(information: Float) -> tuple[Float, NDArray[np.bool_]]:
    """Inverse of an information matrix, and which coordinates it leaves without bound."""
    if not information.size:
        return information, np.zeros(0, bool)
    scale = np.sqrt(np.diag(information))
    blind = ~(scale > 0)
    scale = np.where(blind, 1.0, scale)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    null = values < 1e-13 * max(values.max(), 1.0)
    loose = (np.abs(vectors[:, null]) > 1e-3).any(1) | blind
    inverse = (vectors / np.where(null, np.inf, values)) @ vectors.T
    covariance = inverse / np.outer(scale, scale)
    return covariance + np.diag(np.where(loose, 1e12, 0.0)), loose
