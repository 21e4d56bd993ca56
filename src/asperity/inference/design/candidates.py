"""Operating points of a plan at which the slider slides steadily, and predictions at these points.

A reading needs a stable periodic response: an unstable response turns into stick-slip and is never
measured. Where slip would reverse, the law does not describe it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from asperity.arrays import Bool, Float, Index
from asperity.inference.design.plan import DesignPlan, expected_values
from asperity.inference.objective import Objective
from asperity.inference.tables.residuals import Prediction, residuals_of, weights_of
from asperity.inference.tables.table import LockInTable
from asperity.inference.tables.term import LockInTerm, on_contacts
from asperity.orbit import Outcome, periodic_response
from asperity.parameters.rules import RULES
from asperity.slider.parameters import slider_from

Progress = Callable[[int, int, str], None]

#: Points per call of the compiled derivatives; progress is reported after each call.
_BLOCK = 128
#: Reasons why a point with a periodic response is no candidate.
_UNSTABLE = "its periodic response is unstable: stick-slip"
_REVERSES = "slip would reverse in its response, and the law slips forwards only"
_CUT = (":", ";", " epsilon = ")


@dataclass(frozen=True, eq=False)
class Candidates:
    """Operating points that a design may use.

    Attributes
    ----------
    points : mapping of str to array, shape (n,)
        V, epsilon (as applied), frequency, and other axes of the plan, in SI.
    index : int array, shape (n,)
        Index of each point among all combinations of the plan.
    total : int
        Number of combinations.
    left_out : mapping of str to int
        Number of combinations that were left out, by reason.
    draws : tuple of mapping of str to float
        Values of the free parameters over which the design is averaged.
    usable : bool array, shape (draws, n)
        Whether each point slides steadily with the values of each draw.
    """

    points: Mapping[str, Float]
    index: Index
    total: int
    left_out: Mapping[str, int]
    draws: tuple[Mapping[str, float], ...]
    usable: Bool

    def without(self, out: Bool, reason: str) -> Candidates:
        """The candidates without those in `out`, which are counted under a reason."""
        if not out.any():
            return self
        return replace(
            self,
            points=some_of(self.points, ~out),
            index=self.index[~out],
            usable=self.usable[:, ~out],
            left_out={**self.left_out, reason: int(out.sum())},
        )


def some_of(
    points: Mapping[str, Float], rows: NDArray[np.bool_ | np.intp] | slice
) -> dict[str, Float]:
    """Some of the points."""
    return {name: column[rows] for name, column in points.items()}


def labelled(progress: Progress, label: str) -> Callable[[int, int], None]:
    """Progress of one kind of work."""
    return lambda done, total: progress(done, total, label)


def candidates_of(plan: DesignPlan, progress: Progress) -> Candidates:
    """Solve all combinations of a plan and keep those that slide steadily.

    Parameters
    ----------
    plan : DesignPlan
    progress : callable
        Called with the number of points solved, the number of all points, and a label.
    """
    points = plan.candidates()
    reasons = _reasons(plan, points, expected_values(plan.truth), labelled(progress, "points"))
    # Without modulation there are no harmonics, but the mean still measures mu_ss(V).
    means = all(n in ("mean_friction", "delta_mu") for n in plan.noise)
    still = (points["epsilon"] == 0) & (reasons == "") & (not means)
    reasons = np.where(still, "its load is not modulated", reasons)
    index = np.flatnonzero(reasons == "")
    kept, draws = some_of(points, index), drawn_values(plan)
    usable = np.array(
        [
            _reasons(plan, kept, values, labelled(progress, f"draw {k} of {len(draws)}")) == ""
            for k, values in enumerate(draws, 1)
        ]
    ).reshape(len(draws), index.size)
    left_out = Counter(str(r) for r in reasons if r)
    steady = Candidates(kept, index, reasons.size, dict(left_out.most_common()), draws, usable)
    if not draws:
        return steady
    reason = f"unusable in more than {1 - plan.question.usable_share:.0%} of the draws"
    return steady.without(usable.mean(0) < plan.question.usable_share, reason)


def drawn_values(plan: DesignPlan) -> tuple[dict[str, float], ...]:
    """Values of the free parameters, normal about the expected ones, by a Sobol sequence.

    Values that break the rule of their parameter are replaced by the next values of the sequence.
    """
    count, expected = plan.question.draws, expected_values(plan.truth)
    if not count:
        return ()
    rules = {u.name: RULES[u.parameter.rule] for u in plan.truth.unknowns}
    # Imported here: slow to load.
    from scipy.stats.qmc import Sobol

    sequence = Sobol(len(plan.uncertainty), seed=plan.question.seed)
    result: list[dict[str, float]] = []
    while len(result) < count:
        for row in ndtri(sequence.random(max(8, 1 << (count - 1).bit_length()))):
            drawn = {
                n: expected[n] + sd * float(z)
                for (n, sd), z in zip(plan.uncertainty.items(), row, strict=True)
            }
            if all(bool(rules[n].holds(x)) for n, x in drawn.items()):
                result.append({**expected, **drawn})
    return tuple(result[:count])


def _reasons(
    plan: DesignPlan,
    points: Mapping[str, Float],
    values: Mapping[str, float],
    progress: Callable[[int, int], None],
) -> NDArray[np.str_]:
    """Reasons why points have no response to be read, shape (n,); empty where they have one."""
    given = on_contacts({**plan.truth.fixed, **points, **values})
    reasons = np.full(len(points["V"]), "contact would be lost", dtype=object)
    kept = given["epsilon"] < 1
    if not kept.any():
        return reasons
    some = {n: v[kept] if np.ndim(v) else v for n, v in given.items()}
    response = periodic_response(
        slider_from(plan.truth.law, some),
        velocity=some["V"],
        epsilon=some["epsilon"],
        frequency=some["frequency"],
        inertia=plan.question.inertia,
        radiation_damping=some["eta"] if plan.question.radiation_damping else None,
        harmonics=2,
        progress=progress,
    )
    failed = [_short(str(text)) for text in response.result]
    steady = np.where(response.stable, "", _UNSTABLE)
    described = np.where(response.reverses, _REVERSES, steady)
    reasons[kept] = np.where(response.converged, described, failed)
    return reasons


def _short(reason: str) -> str:
    """A reason without the numbers of its point, so that equal reasons are counted together."""
    for mark in _CUT:
        reason = reason.partition(mark)[0]
    return "no response was found: " + reason.removesuffix(" at").removesuffix(" before")


class Predicted(NamedTuple):
    """Predictions of a law at some points.

    Attributes
    ----------
    whole : Prediction
        Zero at points without a response.
    slopes : dict of str to Prediction
        Derivatives with respect to the free parameters.
    seen : bool array, shape (n,)
        Whether each point has a response with derivatives.
    """

    whole: Prediction
    slopes: dict[str, Prediction]
    seen: Bool


def predicted(
    plan: DesignPlan,
    hypothesis: Objective,
    points: Mapping[str, Float],
    values: Mapping[str, float],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Predicted:
    """Predictions of a law at operating points, shape (n,), with free parameters in SI."""
    parts, total = [], len(points["V"])
    for start in range(0, total, _BLOCK):
        block = some_of(points, slice(start, start + _BLOCK))
        table = LockInTable(plan.name, block, {}, {})
        parts.append(_term(plan, hypothesis, table).predicted(values))
        progress(min(start + _BLOCK, total), total)
    *predictions, outcome = jax.tree.map(lambda *columns: np.concatenate(columns), *parts)
    seen = outcome == Outcome.CONVERGED
    for column in jax.tree.leaves(predictions):
        seen &= np.isfinite(column.reshape(total, -1)).all(1)
    whole, slopes = jax.tree.map(lambda column: np.where(seen, column.T, 0).T, predictions)
    # The tree has sorted the names.
    return Predicted(whole, {name: slopes[name] for name in hypothesis.names}, seen)


def _term(plan: DesignPlan, hypothesis: Objective, table: LockInTable) -> LockInTerm:
    fixed = {**hypothesis.fixed, **table.points}
    term = LockInTerm(table, hypothesis.law, fixed, **plan.motion)
    term.use_search(True)
    return term


def expected_readings(
    plan: DesignPlan, points: Mapping[str, Float], whole: Prediction
) -> LockInTable:
    """Readings without noise at some points, with the uncertainty of a reading at each point.

    The tangential uncertainty of a harmonic combines that of the phase and the absolute one of the
    amplitude: noise has no preferred direction in the complex plane.
    """
    values: dict[str, Float] = {}
    errors: dict[str, Float] = {}
    for name, noise in plan.noise.items():
        if name == "mean_friction":
            value = whole.mean_friction
        elif name == "delta_mu":
            value = whole.mean_friction - whole.mu_ss
        else:
            harmonic = whole.harmonics[:, int(name[-1]) - 1]
            value = np.abs(harmonic) if name.startswith("mu") else np.angle(harmonic)
        values[name] = np.asarray(value)
        if name.startswith("phase"):
            amplitude = plan.noise["mu" + name[-1]].absolute / np.maximum(np.abs(harmonic), 1e-300)
            errors[name] = np.hypot(noise.absolute, amplitude)
        else:
            errors[name] = np.maximum(noise.at(value), 1e-300)
    return LockInTable(plan.name, points, values, errors)


def differences(
    hypothesis: Objective, readings: LockInTable, at: Predicted, values: Mapping[str, float]
) -> tuple[Float, Float]:
    """Predictions less readings in standard uncertainties, and their derivatives.

    Returns
    -------
    array, shape (points, observables)
    array, shape (points, observables, parameters)
        Derivatives with respect to the coordinates of the free parameters.
    """
    result = residuals_of(weights_of(readings), at.whole, at.slopes)
    slopes = np.array([u.slope(values[u.name]) for u in hypothesis.unknowns])
    jacobian = result.jacobian.reshape(-1, readings.rows, slopes.size).swapaxes(0, 1) * slopes
    return result.values.reshape(-1, readings.rows).T, jacobian


def with_readings(
    plan: DesignPlan, hypothesis: Objective, readings: LockInTable, counts: Float
) -> Objective:
    """The hypothesis with readings to be fitted; each is the mean of several, shape (rows,)."""
    term = _term(plan, hypothesis, readings).weighted(np.sqrt(counts))
    return replace(hypothesis, terms=(term,))
