"""What a law predicts at candidate points, in standard uncertainties, and fits to many readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
        result = residuals_of(weights_of(_filled(expected)), predicted, slopes)
        residual = result.values.reshape(-1, n).T
        scale = [
            np.broadcast_to(values[u.name] if u.logarithmic else u.scale, (n,))
            for u in self.hypothesis.unknowns
        ]
        jacobian = result.jacobian.reshape(-1, n, len(slopes)).transpose(1, 0, 2)
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
    result = tiled.whitened(part, values)
    return _summed(result, np.tile(weights, sets), sets, model.hypothesis, u, prior_noise)


def _summed(
    result: Whitened,
    weights: Float,
    sets: int,
    hypothesis: Hypothesis,
    u: Float,
    prior_noise: Float,
) -> tuple[Float, Float, Float]:
    p = u.shape[1]
    root = np.sqrt(weights)[:, None]
    r = (result.values * root).reshape(sets, -1)
    jacobian = (result.jacobian * root[..., None]).reshape(sets, -1, p)
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
