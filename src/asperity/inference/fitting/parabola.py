"""The parabola of chi-squared about a minimum: covariance, and parameters without information."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from asperity.arrays import Bool, Float
from asperity.inference.objective import Objective, Residuals
from asperity.inference.tables.residuals import leverages

#: A logarithmic coordinate with a larger standard deviation (a factor of e) is not determined.
UNDETERMINED = 1.0
#: A delay that is closer to its bound than this share of its range is at the bound.
_AT_BOUND = 1e-3
#: A coordinate closer to a bound than this many standard deviations is stopped by the bound.
_NEAR_BOUND = 0.1
#: If chi-squared can still decrease by more (a third of a standard error), the point is no minimum.
_STOPPED = 0.1


@dataclass(frozen=True)
class Parabola:
    """The quadratic approximation of chi-squared about a minimum.

    Attributes
    ----------
    u : array, shape (n,)
        Coordinates of the minimum.
    chi2 : float
        Chi-squared at the minimum.
    data : tuple of Residuals
        Residuals of each term.
    covariance : array, shape (n, n)
        Covariance of the coordinates if the noise is known.
    missing : bool array, shape (n,)
        Coordinates on which neither data nor priors have any information.
    total : array, shape (n, n)
        Covariance of the coordinates, including the uncertainty of noise that is estimated from
        the same data.
    freedom : array, shape (n,)
        Degrees of freedom of the diagonal of `total`.
    unbounded : array, shape (n,)
        Minimum of the parabola without the bounds that stop coordinates.
    undetermined : tuple of str
        Parameters that the data do not determine.
    stopped : bool
        Whether chi-squared still falls towards values at which the law has no orbit.
    fitted : float
        Number of parameters, including those of the noise, that the data determine: the trace of
        I (I + P)^-1, with the information I of the data and P of the priors.
    priors : int
        Number of priors.
    judging : float
        Chi-squared of the data with given uncertainties and of priors; of all data if all noise is
        estimated.
    dof : int
        Degrees of freedom of `judging`.
    """

    u: Float
    chi2: float
    data: tuple[Residuals, ...]
    covariance: Float
    missing: Bool
    total: Float
    freedom: Float
    unbounded: Float
    undetermined: tuple[str, ...]
    stopped: bool
    fitted: float
    priors: int
    judging: float
    dof: int

    @property
    def sd(self) -> Float:
        """Standard deviations of the coordinates under known noise."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def se(self) -> Float:
        """Standard errors of the coordinates, including the uncertainty of estimated noise."""
        return np.asarray(np.sqrt(np.diag(self.total)))

    @property
    def readings(self) -> int:
        """Number of data."""
        return sum(d.values.size for d in self.data)

    @property
    def p_value(self) -> float:
        """Probability of as large a chi-squared by chance; NaN without degrees of freedom."""
        return float(chdtrc(self.dof, self.judging)) if self.dof > 0 else math.nan


def parabola_of(objective: Objective, u: Float, chi2: float) -> Parabola | None:
    """The parabola at a minimum; None if the law has no solution at the minimum."""
    r, J = objective.residuals(u)
    data = objective.data_residuals(u)
    if data is None:
        return None
    # A delay at its bound, which the segments of the drive set, counts as known.
    J = np.where(_known_at_bound(objective, u), 0.0, J)
    covariance, missing = inverse_information(J.T @ J)
    total, freedom = _with_estimated_noise(objective, u, covariance, missing)
    of_data = np.sum([d.jacobian.T @ d.jacobian for d in data], axis=0)
    # Priors of nuisance parameters describe the instrument, and count as data.
    prior_slopes = objective.prior_residuals(u)[1]
    with_prior = [v for v in objective.unknowns if v.prior is not None]
    nuisance = [v.nuisance for v in with_prior]
    informed = inverse_information(of_data + prior_slopes[nuisance].T @ prior_slopes[nuisance])[0]
    undetermined = tuple(
        unknown.name
        for i, unknown in enumerate(objective.unknowns)
        if not unknown.nuisance
        and (missing[i] or math.sqrt(max(informed[i, i], 0.0)) > unknown.widest(u[i]))
    )
    parameters = len(objective.unknowns) + sum(term.profiled for term in objective.terms)
    judging, dof = chi2, r.size - parameters
    given = [term.profiled == 0 for term in objective.terms]
    if any(given) and not all(given):
        # Innovations have unit variance by their estimated noise, and would hide a misfit.
        of_data = np.repeat(given, [d.values.size for d in data])
        judges = np.concatenate([of_data, ~np.array(nuisance, bool)])
        judging = float(np.sum(r[judges] ** 2))
        dof = round(float(np.sum(1 - leverages(J[judges], J.T @ J))))
    return Parabola(
        u=u,
        chi2=chi2,
        data=tuple(data),
        covariance=covariance,
        missing=missing,
        total=total,
        freedom=freedom,
        unbounded=u - covariance @ _gradient_at_bounds(objective, u, covariance, J.T @ r),
        undetermined=undetermined,
        stopped=objective.noise_is_known and objective.expected_decrease(u) > _STOPPED,
        fitted=parameters - float(leverages(J[r.size - len(with_prior) :], J.T @ J).sum()),
        priors=len(with_prior),
        judging=judging,
        dof=dof,
    )


def _known_at_bound(objective: Objective, u: Float) -> Bool:
    """Delays and offsets at a bound: other parameters do not depend on a value beyond the bound.

    A stiffness at its bound is not among them, because the data bound it on the other side.
    """
    low, high = objective.bounds
    linear = np.array([k.nuisance and not k.logarithmic for k in objective.unknowns], bool)
    room = np.where(np.isfinite(high - low), high - low, 1.0)
    return np.asarray(linear & (np.minimum(u - low, high - u) < _AT_BOUND * room))


def _gradient_at_bounds(
    objective: Objective, u: Float, covariance: Float, gradient: Float
) -> Float:
    """The gradient of coordinates that a bound stops; 0 for all other coordinates.

    The gradient of other coordinates is zero at the exact minimum. In a nearly flat valley a
    minimisation leaves a small gradient, which says nothing about the position of the minimum.
    """
    low, high = objective.bounds
    sd = np.sqrt(np.diag(covariance))
    at_low = (gradient > 0) & (u - low < _NEAR_BOUND * sd)
    at_high = (gradient < 0) & (high - u < _NEAR_BOUND * sd)
    return np.where(at_low | at_high, gradient, 0.0)


def _with_estimated_noise(
    objective: Objective, u: Float, covariance: Float, missing: Bool
) -> tuple[Float, Float]:
    """The covariance including the uncertainty of estimated noise, and its degrees of freedom."""
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
    """An addition to a covariance, without eigenvalues that are negative by rounding.

    If the data hardly tell parameters apart, the addition is a small difference of large numbers.
    """
    sd = np.sqrt(np.where(np.diag(covariance) > 0, np.diag(covariance), 1.0))
    values, vectors = np.linalg.eigh(added / np.outer(sd, sd))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(sd, sd))


def inverse_information(information: Float) -> tuple[Float, Bool]:
    """Inverse of an information matrix, and a mask of coordinates without information."""
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
