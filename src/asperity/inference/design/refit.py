"""Least squares of many sets of readings at once, each from a start of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.inference.design.plan import Hypothesis
from asperity.inference.design.predictions import PointModel, Whitened, rows_of
from asperity.inference.tables.table import LockInTable

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]

_ITERATIONS = 60
#: Damping of Levenberg and Marquardt: at the start, after a success, after a failure, at most.
_DAMPING, _LESS, _MORE, _MOST = 1e-3, 0.2, 5.0, 1e9
#: Largest change of a coordinate in one step: a factor of e where the coordinate is a logarithm.
_STEP = 1.0
_CHANGE = 1e-9


class Refitted(NamedTuple):
    """Minima of chi-squared.

    Attributes
    ----------
    coordinates : array, shape (sets, p)
    chi2 : array, shape (sets,)
        Infinite where the start has no response.
    converged : bool array, shape (sets,)
    """

    coordinates: Float
    chi2: Float
    converged: Bool


def refit(
    model: PointModel,
    readings: LockInTable,
    weights: Float,
    start: Float,
    *,
    prior_noise: Float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Refitted:
    """Fit a hypothesis to sets of readings at the same points.

    Parameters
    ----------
    model : PointModel
        Of the points.
    readings : LockInTable
        The sets below each other: sets x points rows.
    weights : array, shape (points,)
        Number of readings that each row stands for; uncertainties are those of one reading.
    start : array, shape (sets, p)
    prior_noise : array, shape (sets, q), optional
        By how many standard deviations the mean of each prior differs from the given one.
    progress : callable, optional
        Called with the number of sets that are done and of all.
    """
    unknowns = model.hypothesis.unknowns
    low, high = np.array([u.bounds for u in unknowns]).T
    u = np.clip(start, low + 1e-10, high - 1e-10)
    sets, p = u.shape
    chi2 = np.full(sets, np.inf)
    slope, curvature = np.zeros((sets, p)), np.zeros((sets, p, p))
    damping, converged = np.full(sets, _DAMPING), np.zeros(sets, bool)
    noise = np.zeros((sets, p)) if prior_noise is None else prior_noise

    def normal(u: Float, chosen: NDArray[np.intp]) -> tuple[Float, Float, Float]:
        return _normal(model, readings, weights, u, chosen, noise[chosen])

    chi2[:], slope[:], curvature[:] = normal(u, np.arange(sets))
    active = np.isfinite(chi2)
    for _ in range(_ITERATIONS):
        left = np.flatnonzero(active & ~converged)
        if progress is not None:
            progress(sets - left.size, sets)
        if not left.size:
            break
        diagonal = np.einsum("kaa->ka", curvature[left])
        diagonal = np.maximum(diagonal, 1e-12 * diagonal.max(1, keepdims=True) + 1e-300)
        damped = curvature[left] + np.einsum("k,ka,ab->kab", damping[left], diagonal, np.eye(p))
        step = -np.linalg.solve(damped, slope[left][..., None])[..., 0]
        step *= np.minimum(1.0, _STEP / np.maximum(np.abs(step).max(1, keepdims=True), 1e-300))
        tried = np.clip(u[left] + step, low + 1e-10, high - 1e-10)
        value, gradient, square = normal(tried, left)
        better = value <= chi2[left]
        gained = np.where(better, chi2[left] - value, np.inf)
        converged[left] = gained < _CHANGE * (1 + chi2[left])
        good = left[better]
        u[good], chi2[good] = tried[better], value[better]
        slope[good], curvature[good] = gradient[better], square[better]
        damping[good] *= _LESS
        damping[left[~better]] *= _MORE
        # No step improves: the minimum to rounding, or a corner without responses.
        converged[left[damping[left] > _MOST]] = True
    return Refitted(u, chi2, converged & active)


def _normal(
    model: PointModel,
    readings: LockInTable,
    weights: Float,
    u: Float,
    chosen: NDArray[np.intp],
    prior_noise: Float,
) -> tuple[Float, Float, Float]:
    """chi-squared, half its gradient and half its curvature for some of the sets."""
    sets, points = len(u), model.size
    rows = (chosen[:, None] * points + np.arange(points)).ravel()
    part = rows_of(readings, rows)
    tiled = PointModel(model.plan, model.hypothesis, part.points, np.tile(model.slow, sets))
    values = {
        k.name: np.repeat(k.to_value(u[:, i]), points)
        for i, k in enumerate(model.hypothesis.unknowns)
    }
    found = tiled.whitened(part, values)
    return _summed(found, np.tile(weights, sets), sets, model.hypothesis, u, prior_noise)


def _summed(
    found: Whitened,
    weights: Float,
    sets: int,
    hypothesis: Hypothesis,
    u: Float,
    prior_noise: Float,
) -> tuple[Float, Float, Float]:
    p = u.shape[1]
    root = np.sqrt(weights)[:, None]
    r = (found.values * root).reshape(sets, -1)
    jacobian = (found.jacobian * root[..., None]).reshape(sets, -1, p)
    prior, slopes = prior_terms(hypothesis, u)
    r = np.concatenate([r, prior - prior_noise[:, : prior.shape[1]]], axis=1)
    jacobian = np.concatenate([jacobian, slopes], axis=1)
    chi2 = np.einsum("km,km->k", r, r)
    failed = ~np.isfinite(chi2)
    r, jacobian = np.where(failed[:, None], 0.0, r), np.where(failed[:, None, None], 0.0, jacobian)
    return (
        np.where(failed, np.inf, chi2),
        np.einsum("kmp,km->kp", jacobian, r),
        np.einsum("kmp,kmq->kpq", jacobian, jacobian),
    )


def prior_terms(hypothesis: Hypothesis, u: Float) -> tuple[Float, Float]:
    """Residuals of the priors, shape (sets, q), and their derivatives, shape (sets, q, p)."""
    having = [i for i, k in enumerate(hypothesis.unknowns) if k.prior is not None]
    values, slopes = np.zeros((len(u), len(having))), np.zeros((len(u), len(having), u.shape[1]))
    for row, i in enumerate(having):
        unknown = hypothesis.unknowns[i]
        assert unknown.prior is not None  # by the choice of rows
        x = unknown.to_value(u[:, i])
        values[:, row] = (x - unknown.prior.mean) / unknown.prior.sd
        slopes[:, row, i] = (x if unknown.logarithmic else unknown.scale) / unknown.prior.sd
    return values, slopes
