"""Residuals of a table of lock-in readings, in standard uncertainties, and their derivatives.

Harmonics with a phase are compared as complex numbers, turned by the measured phase: the radial
part over the uncertainty of the amplitude, the tangential part over amplitude times the uncertainty
of the phase. A harmonic below its uncertainty then does not bias the fit, as its amplitude, which
is never negative, would.

Every residual is a linear function of what a law predicts at its row. Where the observables of a
row are correlated, C = S R S with the uncertainties S and the correlations R, the residuals are
multiplied by R^-1/2, so that each stays as close to its own observable as can be (Kessy, Lewin and
Strimmer, 2018).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from asperity.arrays import Bool, Float
from asperity.inference.objective import Residuals
from asperity.inference.tables.table import OBSERVABLES, LockInTable

#: Columns of `Prediction.columns`.
_MEAN, _STEADY, _HARMONICS, _AMPLITUDES, _COLUMNS = 0, 1, (2, 4), (6, 7), 8
#: A phase with a larger uncertainty (rad) may be any; tables often cap what they report there.
_ANY_PHASE = 0.5


class Prediction(NamedTuple):
    """What a law predicts at the rows of a table.

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
        As `log_scale` of `Residuals`, of each row.
    """

    matrix: Any
    target: Any
    reported: Bool
    log_scales: Float

    def compared(self, columns: Any) -> Any:
        """Residuals of predictions, shape (..., rows, columns) to (..., rows, slots).

        0 in slots that a row does not report. Of NumPy and of JAX arrays.
        """
        return self.along(columns) - self.target

    def along(self, columns: Any) -> Any:
        """Changes of the residuals with changes of the predictions, of the same shapes."""
        return (self.matrix @ columns[..., None])[..., 0]

    @property
    def log_scale(self) -> float:
        """Of all rows."""
        return float(self.log_scales.sum())


def weights_of(table: LockInTable) -> Weights:
    """Weights of the residuals of a table; slots are in the order of `OBSERVABLES`."""
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
        # The phase of an amplitude that reads as zero says nothing about the direction.
        width = data[:, radial] * error[:, across]
        floor = np.where(error[:, across] > _ANY_PHASE, 1.0, 1e-3) * error[:, radial]
        error[:, across] = np.where(known, np.maximum(width, floor), 1.0)
        data[:, across] = 0.0
    root = _inverse_root(table)
    matrix = root @ (matrix * (reported / error)[..., None])
    target = (root @ (data * reported / error)[..., None])[..., 0]
    return Weights(matrix, target, reported, np.log(error).sum(1) - np.linalg.slogdet(root)[1])


def _inverse_root(table: LockInTable) -> Float:
    """R^-1/2 of the correlations of each row, of shape (rows, slots, slots)."""
    if not table.covariances:
        slots = len(OBSERVABLES)
        return np.broadcast_to(np.eye(slots), (table.rows, slots, slots))
    values, vectors = np.linalg.eigh(table.correlations())
    return np.asarray((vectors / np.sqrt(values)[:, None]) @ vectors.swapaxes(1, 2))


def columns_of(predicted: Prediction, module: Any = np) -> Any:
    """A prediction as columns that residuals are linear in, of shape (rows, columns).

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


def _slopes_of(predicted: Prediction, slope: Prediction) -> Float:
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
        Of the table.
    predicted : Prediction
    derivatives : mapping of str to Prediction
        Derivative of the prediction at each row, by free parameter.
    """
    reported = weights.reported.T
    slots, rows = np.nonzero(reported)
    values = weights.compared(columns_of(predicted)).T[reported]
    slopes = [weights.along(_slopes_of(predicted, d)).T[reported] for d in derivatives.values()]
    return Residuals(
        values,
        np.column_stack(slopes) if slopes else np.zeros((values.size, 0)),
        np.array(OBSERVABLES)[slots],
        rows,
        weights.log_scale,
    )
