"""Residuals of a table of lock-in readings, in standard uncertainties, and their derivatives.

Harmonics with a phase are compared as complex numbers, turned by the measured phase: the radial
part is divided by the uncertainty of the amplitude, the tangential part by amplitude times the
uncertainty of the phase. A harmonic below its uncertainty then does not bias the fit; its
amplitude, which is never negative, would.

Every residual is a linear function of the prediction at its row. If the observables of a row are
correlated, with the covariance C = S R S of uncertainties S and correlations R, the residuals are
multiplied by R^-1/2, which keeps each residual as close to its observable as possible (Kessy, Lewin
and Strimmer, 2018).

Outliers are rows that a fit does not describe, while it describes all other rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.special import chdtrc

from asperity.arrays import Bool, Float
from asperity.inference.objective import Residuals
from asperity.inference.tables.table import OBSERVABLES, LockInTable

#: Columns of `Prediction.columns`.
_MEAN, _STEADY, _HARMONICS, _AMPLITUDES, _COLUMNS = 0, 1, (2, 4), (6, 7), 8
#: A phase with a larger uncertainty (rad) is unknown; tables often cap such uncertainties.
_ANY_PHASE = 0.5


class Prediction(NamedTuple):
    """Predictions of a law at the rows of a table.

    Attributes
    ----------
    mean_friction : array, shape (rows,)
    mu_ss : array, shape (rows,)
    harmonics : complex array, shape (rows, 2)
    """

    mean_friction: Any
    mu_ss: Any
    harmonics: Any


class Weights(NamedTuple):
    """Residuals of a table as linear functions of predictions: weights @ columns - targets.

    Attributes
    ----------
    matrix : array, shape (rows, slots, columns)
        0 in slots that a row does not report.
    target : array, shape (rows, slots)
    reported : bool array, shape (rows, slots)
    log_scales : array, shape (rows,)
        The `log_scale` of `Residuals` of each row.
    """

    matrix: Any
    target: Any
    reported: Bool
    log_scales: Float

    def compared(self, columns: Any) -> Any:
        """Residuals of predictions, shape (..., rows, columns) to (..., rows, slots).

        0 in slots that a row does not report. Works with NumPy and JAX arrays.
        """
        return self.along(columns) - self.target

    def along(self, columns: Any) -> Any:
        """Changes of the residuals with changes of the predictions, of the same shapes."""
        return (self.matrix @ columns[..., None])[..., 0]

    @property
    def log_scale(self) -> float:
        """Sum over all rows."""
        return float(self.log_scales.sum())


def weights_of(table: LockInTable, slopes: Float | None = None) -> Weights:
    """Weights of the residuals of a table; slots are in the order of `OBSERVABLES`.

    Parameters
    ----------
    table : LockInTable
    slopes : array, shape (rows, columns), optional
        Derivatives of the predictions in the measured epsilon. Its errors then count as errors of
        the readings (effective variance; Orear, Am. J. Phys. 50, 912, 1982). Without slopes,
        epsilon is exact.
    """
    rows, slots = table.rows, len(OBSERVABLES)
    matrix = np.zeros((rows, slots, _COLUMNS))
    data, error = np.zeros((rows, slots)), np.ones((rows, slots))
    reported = np.zeros((rows, slots), bool)
    for slot, name in enumerate(OBSERVABLES):
        if name in table.values:
            reported[:, slot] = np.isfinite(table.values[name])
            data[:, slot] = np.nan_to_num(table.values[name])
            error[:, slot] = np.where(reported[:, slot], table.errors[name], 1.0)
    slot_of = {name: i for i, name in enumerate(OBSERVABLES)}
    matrix[:, slot_of["mean_friction"], _MEAN] = 1.0
    matrix[:, slot_of["delta_mu"], [_MEAN, _STEADY]] = 1.0, -1.0
    for n, (real, amplitude) in enumerate(zip(_HARMONICS, _AMPLITUDES, strict=True), 1):
        radial, across = slot_of[f"mu{n}"], slot_of[f"phase{n}"]
        known = reported[:, across]
        cosine, sine = np.cos(data[:, across]), np.sin(data[:, across])
        # Parts of c e^(-i phase): along the measured phasor, and across it.
        matrix[:, radial, real] = np.where(known, cosine, 0.0)
        matrix[:, radial, real + 1] = np.where(known, sine, 0.0)
        matrix[:, radial, amplitude] = np.where(known, 0.0, 1.0)
        matrix[:, across, real], matrix[:, across, real + 1] = -sine, cosine
        # The phase of an amplitude of zero has no meaning.
        width = data[:, radial] * error[:, across]
        floor = np.where(error[:, across] > _ANY_PHASE, 1.0, 1e-3) * error[:, radial]
        error[:, across] = np.where(known, np.maximum(width, floor), 1.0)
        data[:, across] = 0.0
    root = _inverse_root(table)
    matrix = root @ (matrix * (reported / error)[..., None])
    target = (root @ (data * reported / error)[..., None])[..., 0]
    log_scales = np.log(error).sum(1) - np.linalg.slogdet(root)[1]
    weights = Weights(matrix, target, reported, log_scales)
    if slopes is None:
        return weights
    # An error of epsilon moves all residuals of a row together: their covariance is 1 + g g^T.
    g = weights.along(slopes) * np.nan_to_num(table.errors["epsilon"])[:, None]
    size = np.sum(g**2, axis=1)
    share = (1 / np.sqrt(1 + size) - 1) / np.where(size > 0, size, 1.0)
    whiten = np.eye(slots) + share[:, None, None] * g[:, :, None] * g[:, None, :]
    target = (whiten @ target[..., None])[..., 0]
    return Weights(whiten @ matrix, target, reported, log_scales + np.log1p(size) / 2)


def _inverse_root(table: LockInTable) -> Float:
    """R^-1/2 of the correlations R of each row, shape (rows, slots, slots)."""
    if not table.covariances:
        slots = len(OBSERVABLES)
        return np.broadcast_to(np.eye(slots), (table.rows, slots, slots))
    values, vectors = np.linalg.eigh(table.correlations())
    return np.asarray((vectors / np.sqrt(values)[:, None]) @ vectors.swapaxes(1, 2))


def columns_of(predicted: Prediction, module: Any = np) -> Any:
    """A prediction as columns in which residuals are linear, shape (rows, columns).

    Parameters
    ----------
    predicted : Prediction
    module : module
        numpy, or jax.numpy within compiled programs.
    """
    c = predicted.harmonics
    return module.stack(
        [
            predicted.mean_friction,
            predicted.mu_ss,
            c[:, 0].real,
            c[:, 0].imag,
            c[:, 1].real,
            c[:, 1].imag,
            module.abs(c[:, 0]),
            module.abs(c[:, 1]),
        ],
        axis=1,
    )


def slopes_of(predicted: Prediction, slope: Prediction) -> Float:
    """Derivatives of `columns_of`."""
    c, change = predicted.harmonics, slope.harmonics
    columns = columns_of(slope)
    columns[:, _AMPLITUDES] = (np.exp(-1j * np.angle(c)) * change).real
    return np.asarray(columns)


def residuals_of(
    weights: Weights, predicted: Prediction, derivatives: Mapping[str, Prediction]
) -> Residuals:
    """Residuals of all observables of a table.

    Parameters
    ----------
    weights : Weights
        Weights of the table.
    predicted : Prediction
    derivatives : mapping of str to Prediction
        Derivatives of the prediction at each row, by free parameter.
    """
    reported = weights.reported.T
    slots, rows = np.nonzero(reported)
    values = weights.compared(columns_of(predicted)).T[reported]
    slopes = [weights.along(slopes_of(predicted, d)).T[reported] for d in derivatives.values()]
    return Residuals(
        values,
        np.column_stack(slopes) if slopes else np.zeros((values.size, 0)),
        np.array(OBSERVABLES)[slots],
        rows,
        weights.log_scale,
    )


#: A row is an outlier if such a departure, in any of the rows, has a lower probability by chance.
_CHANCE = 1e-4
#: Largest share of outliers among the rows; two are always allowed if there are this many other
#: rows for each.
_SHARE, _OTHERS_EACH = 0.1, 3
#: Chi-squared of the other rows must have at least this probability.
DESCRIBED = 0.01
#: Largest change of a coordinate for which predictions count as linear.
_FARTHEST = 0.3
#: Largest numbers of reweighted fits (for the sum of distances) and of fits to the nearest rows.
_REWEIGHTED, _CONCENTRATED = 6, 8

#: While the probability of chi-squared of the nearest rows is below the second number, a reweighted
#: fit must reduce this chi-squared to the first share.
_FALLING, _FAR_OFF = 0.8, 1e-12

#: Function of weights, shape (rows,), that multiply the residuals of a table: the residuals at the
#: minimum of the weighted chi-squared, followed by those of priors as row -1; None without a
#: solution.
Refit = Callable[[Float], Residuals | None]


def outlying_rows(residuals: Residuals, refit: Refit | None = None) -> list[int]:
    """Outliers, worst first: a few rows without which the law describes the table; else empty.

    Parameters
    ----------
    residuals : Residuals
        Residuals at the minimum, with the Jacobian in the coordinates of the fit.
    refit : callable, optional
        Function that fits again; by default with predictions linear in the coordinates.

    Notes
    -----
    A search that removes one row at a time fails, because several outliers hide each other. Here
    the first fit minimises the sum of the distances of the rows, in which an outlier has no more
    influence than any other row. The next fits minimise chi-squared of the nearest rows, as many as
    remain without the largest number of outliers, until these rows stay the same (least trimmed
    squares; Rousseeuw and Van Driessen, Data Min. Knowl. Discov. 12, 29, 2006). Among the remaining
    rows, outliers are those whose residuals r from the fit without them are too large, by r^T (1 +
    H)^-1 r with the uncertainty H of the fit.
    """
    rows = np.unique(residuals.row[residuals.row >= 0])
    most = max(1, int(_SHARE * rows.size), min(2, rows.size // (1 + _OTHERS_EACH)))
    if not p_value_without(residuals, ()) < DESCRIBED:
        return []
    # Without degrees of freedom the other rows say nothing about a row.
    if all(math.isnan(p_value_without(residuals, [row])) for row in rows.tolist()):
        return []
    refit = refit or partial(_linear_refit, residuals)

    def fitted(weights: Float) -> Residuals:
        result = refit(weights)
        if result is None:
            raise _NoFitError
        return result

    def farthest_of(some: Residuals) -> set[int]:
        return set(rows[np.argsort(-row_distances(some)[rows])[:most]].tolist())

    try:
        now, apart = residuals, _chi2(residuals, farthest_of(residuals))
        for _ in range(_REWEIGHTED):
            now = fitted(np.maximum(row_distances(now), 1.0) ** -0.5)
            before, apart = apart, _chi2(now, farthest_of(now))
            if apart > _FALLING * before and p_value_without(now, farthest_of(now)) < _FAR_OFF:
                # The law is wrong for most rows, and further fits do not improve this.
                return []
        out: set[int] = set()
        for _ in range(_CONCENTRATED):
            farthest = farthest_of(now)
            if farthest == out:
                break
            out = farthest
            now = fitted(weights_without(residuals, out))
        while near := {row for row in out if _chance(now, row, out) * rows.size > _CHANCE}:
            out -= near
            now = fitted(weights_without(residuals, out))
    except _NoFitError:
        return []
    if not p_value_without(now, out) >= DESCRIBED:
        return []
    return sorted(out, key=lambda row: -row_distances(now)[row])


class _NoFitError(Exception):
    """The law has no solution with the remaining rows."""


def _linear_refit(residuals: Residuals, weights: Float) -> Residuals | None:
    """Residuals of a refit with linear predictions; None if coordinates change too much."""
    # Coordinates without influence on the table are left out.
    J = residuals.jacobian[:, residuals.jacobian.any(0)]
    w = weights[residuals.row]
    shift = -np.linalg.lstsq(w[:, None] * J, w * residuals.values, rcond=1e-12)[0]
    if np.abs(shift).max(initial=0.0) > _FARTHEST:
        return None
    return residuals._replace(values=residuals.values + J @ shift, jacobian=J)


def row_distances(residuals: Residuals) -> Float:
    """Root mean square of the residuals of each row; 0 for a row without residuals."""
    of_rows = residuals.row >= 0
    row = residuals.row[of_rows]
    squares = np.bincount(row, residuals.values[of_rows] ** 2)
    return np.asarray(np.sqrt(squares / np.maximum(np.bincount(row), 1)))


def weights_without(residuals: Residuals, out: Collection[int]) -> Float:
    """Weights without the rows in `out`."""
    weights = np.ones(residuals.row.max() + 1)
    weights[list(out)] = 0.0
    return weights


def p_value_without(residuals: Residuals, out: Collection[int]) -> float:
    """Probability of chi-squared of the kept rows; NaN without degrees of freedom."""
    kept = ~np.isin(residuals.row, list(out))
    dof = int(kept.sum()) - int(residuals.jacobian.any(0).sum())
    return float(chdtrc(dof, _chi2(residuals, out))) if dof > 0 else math.nan


def _chi2(residuals: Residuals, out: Collection[int]) -> float:
    """Chi-squared of the kept rows."""
    return float(np.sum(residuals.values[~np.isin(residuals.row, list(out))] ** 2))


def _chance(residuals: Residuals, row: int, out: Collection[int]) -> float:
    """Probability that a row departs as far from the prediction by the kept rows."""
    kept, here = ~np.isin(residuals.row, list(out)), residuals.row == row
    J = residuals.jacobian
    size = np.sqrt(np.sum(J**2, axis=0))
    J = J / np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(J[kept].T @ J[kept], hermitian=True)
    spread = np.eye(int(here.sum())) + J[here] @ inverse @ J[here].T
    away = residuals.values[here]
    return float(chdtrc(away.size, away @ np.linalg.solve(spread, away)))


def leverages(jacobian: Float, information: Float) -> Float:
    """Share of each residual's variance that the fit removes, shape (n,): 1 if it fits it exactly.

    Parameters
    ----------
    jacobian : array, shape (n, coordinates)
        Of some of the residuals.
    information : array, shape (coordinates, coordinates)
        Information matrix of all data and priors of the fit; other data reduce the leverage.
    """
    size = np.sqrt(np.diag(information))
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(information / np.outer(size, size), hermitian=True)
    return np.asarray(np.einsum("ij,jk,ik->i", jacobian / size, inverse, jacobian / size))


def standardised(residuals: Residuals, information: Float) -> Float:
    """Residuals over their standard deviations at the minimum, shape (n,).

    A reading with a large influence on the fit has a small residual, which is divided by
    sqrt(1 - leverage).

    Parameters
    ----------
    residuals : Residuals
    information : array
        As of `leverages`.
    """
    leverage = leverages(residuals.jacobian, information)
    return np.asarray(residuals.values / np.sqrt(np.maximum(1 - leverage, 1e-6)))
