"""What a law predicts at candidate points, in units of the uncertainty of a reading there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from asperity.inference.design.plan import DesignPlan, Hypothesis
from asperity.inference.tables.residuals import Prediction, residuals_of, weights_of
from asperity.inference.tables.table import LockInTable
from asperity.inference.tables.term import Forward
from asperity.orbit import Outcome

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]


class Whitened(NamedTuple):
    """Differences from the expected readings in standard uncertainties, point by point.

    Attributes
    ----------
    values : array, shape (points, observables)
        (prediction - expected reading) / standard uncertainty; NaN without a response.
    jacobian : array, shape (points, observables, parameters)
        Derivatives to the coordinates of the free parameters.
    """

    values: Float
    jacobian: Float


class PointModel:
    """Predictions of a hypothesis at some operating points as a function of its parameters.

    Parameters
    ----------
    plan : DesignPlan
    hypothesis : Hypothesis
    points : mapping of str to array, shape (n,)
    slow : bool array, shape (n,)
        Points that the fast method does not solve.
    """

    def __init__(
        self, plan: DesignPlan, hypothesis: Hypothesis, points: Mapping[str, Float], slow: Bool
    ) -> None:
        self.plan, self.hypothesis, self.points, self.slow = plan, hypothesis, points, slow
        self._parts: list[tuple[NDArray[np.intp], Forward, bool]] = []
        for search in (False, True):
            rows = np.flatnonzero(slow == search)
            if rows.size:
                some = {n: v[rows] for n, v in points.items()}
                table = LockInTable(plan.name, some, {}, {})
                forward = Forward(
                    hypothesis.law,
                    table,
                    {**hypothesis.fixed, **some},
                    inertia=plan.inertia,
                    radiation_damping=plan.radiation_damping,
                )
                self._parts.append((rows, forward, search))

    @property
    def size(self) -> int:
        """Number of points."""
        return len(self.points["V"])

    def predicted(
        self, values: Mapping[str, Any]
    ) -> tuple[Prediction, dict[str, Prediction], Bool]:
        """Prediction, derivatives to the free parameters, and which points have a response.

        Parameters
        ----------
        values : mapping of str to float or array, shape (n,)
            Free parameters in SI.
        """
        n = self.size
        whole = _empty(n)
        slopes = {name: _empty(n) for name in self.hypothesis.names}
        converged = np.zeros(n, bool)
        for rows, forward, search in self._parts:
            some = {k: np.broadcast_to(v, (n,))[rows] for k, v in values.items()}
            # A number for each row is as good as one for all.
            part, derivatives, outcome = forward(cast(Mapping[str, float], some), search=search)
            _put(whole, part, rows)
            for name in slopes:
                _put(slopes[name], derivatives[name], rows)
            converged[rows] = outcome == Outcome.CONVERGED
        return whole, slopes, converged

    def whitened(self, expected: LockInTable, values: Mapping[str, Any]) -> Whitened:
        """Differences from expected readings; derivatives are to the coordinates of a fit.

        Parameters
        ----------
        expected : LockInTable
            Of the same points: readings and their uncertainties.
        values : mapping of str to float or array, shape (n,)
        """
        return self._compared(expected, values, *self.predicted(values))

    def expected(self, values: Mapping[str, Any]) -> tuple[LockInTable, Whitened]:
        """Expected readings with their uncertainties, and the derivatives there."""
        predicted, slopes, converged = self.predicted(values)
        readings = expected_readings(self.plan, self.points, predicted)
        return readings, self._compared(readings, values, predicted, slopes, converged)

    def _compared(
        self,
        expected: LockInTable,
        values: Mapping[str, Any],
        predicted: Prediction,
        slopes: Mapping[str, Prediction],
        converged: Bool,
    ) -> Whitened:
        n = self.size
        # Numbers in place of missing responses, so that each point keeps its rows.
        found = residuals_of(weights_of(_filled(expected)), predicted, slopes)
        residual = found.values.reshape(-1, n).T
        scale = [
            np.broadcast_to(values[u.name] if u.logarithmic else u.scale, (n,))
            for u in self.hypothesis.unknowns
        ]
        jacobian = found.jacobian.reshape(-1, n, len(slopes)).transpose(1, 0, 2)
        jacobian = jacobian * np.stack(scale, axis=-1)[:, None, :]
        return Whitened(
            np.where(converged[:, None], residual, np.nan),
            np.where(converged[:, None, None], jacobian, np.nan),
        )


def _filled(table: LockInTable) -> LockInTable:
    values = {n: np.nan_to_num(v) for n, v in table.values.items()}
    errors = {n: np.where(np.isfinite(e), e, 1.0) for n, e in table.errors.items()}
    return LockInTable(table.name, table.points, values, errors)


def expected_readings(
    plan: DesignPlan, points: Mapping[str, Float], predicted: Prediction
) -> LockInTable:
    """Readings without noise at some points, with the uncertainty of a reading there.

    The tangential uncertainty of a harmonic combines that of the phase and the absolute one of the
    amplitude: noise has no preferred direction in the complex plane.
    """
    values: dict[str, Float] = {}
    errors: dict[str, Float] = {}
    for name, noise in plan.noise.items():
        if name == "mean_friction":
            value = predicted.mean_friction
        elif name == "delta_mu":
            value = predicted.mean_friction - predicted.mu_ss
        else:
            harmonic = predicted.harmonics[:, int(name[-1]) - 1]
            value = np.abs(harmonic) if name.startswith("mu") else np.angle(harmonic)
        values[name] = np.asarray(value)
        if name.startswith("phase"):
            amplitude = plan.noise["mu" + name[-1]].absolute / np.maximum(np.abs(harmonic), 1e-300)
            errors[name] = np.hypot(noise.absolute, amplitude)
        else:
            errors[name] = np.maximum(noise.at(value), 1e-300)
    return LockInTable(plan.name, points, values, errors)


def rows_of(table: LockInTable, rows: NDArray[np.intp]) -> LockInTable:
    """Some rows of a table, in the given order, repeated where they occur again."""

    def taken(columns: Mapping[str, Float]) -> dict[str, Float]:
        return {n: v[rows] for n, v in columns.items()}

    return LockInTable(table.name, taken(table.points), taken(table.values), taken(table.errors))


def stacked(tables: Sequence[LockInTable]) -> LockInTable:
    """Tables of the same columns below each other."""

    def below(field: str) -> dict[str, Float]:
        first: Mapping[str, Float] = getattr(tables[0], field)
        return {n: np.concatenate([getattr(t, field)[n] for t in tables]) for n in first}

    return LockInTable(tables[0].name, below("points"), below("values"), below("errors"))


def repeated(table: LockInTable, times: int) -> LockInTable:
    """A table several times below itself."""
    return rows_of(table, np.tile(np.arange(table.rows), times))


def _empty(n: int) -> Prediction:
    return Prediction(np.full(n, np.nan), np.full(n, np.nan), np.full((n, 2), np.nan, complex))


def _put(whole: Prediction, part: Prediction, rows: NDArray[np.intp]) -> None:
    for target, source in zip(whole, part, strict=True):
        target[rows] = source
