"""Optimal design: the operating points that answer the question of a plan best."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from asperity._version import __version__
from asperity.arrays import Float
from asperity.errors import InputError, named
from asperity.inference.design.candidates import (
    Candidates,
    Progress,
    candidates_of,
    differences,
    expected_readings,
    labelled,
    predicted,
    some_of,
)
from asperity.inference.design.criteria import Determinant
from asperity.inference.design.plan import DesignPlan, expected_values, plan_of, read_plan
from asperity.inference.design.rival import RivalFit, separation
from asperity.inference.design.simulation import (
    Simulated,
    deviations_of_simulation,
    simulated,
)
from asperity.inference.design.weights import (
    EvenGrid,
    Whole,
    even_grid,
    optimal_weights,
    times_fewer,
    whole_readings,
)
from asperity.inference.fitting.parabola import UNDETERMINED, inverse_information
from asperity.inference.fitting.result import Warned
from asperity.inference.objective import Objective
from asperity.inference.tables.table import LockInTable
from asperity.parameters.arguments import at_least, typed


class PredictedReading(NamedTuple):
    """Expected reading of an observable, and its standard uncertainty."""

    value: float
    uncertainty: float


class AtOneLevel(NamedTuple):
    """A design of which all points have one level of an axis, the other axes being chosen best.

    Attributes
    ----------
    level : float
        Value of the axis, in SI.
    candidates : int
        Number of candidates with this level.
    times_more : float
        Factor by which the readings increase.
    """

    level: float
    candidates: int
    times_more: float


@dataclass(frozen=True)
class DesignedPoint:
    """An operating point of a design.

    Attributes
    ----------
    setting : mapping of str to float
        V, epsilon (as applied), frequency, and other axes of the plan, in SI.
    readings : int
    time : float or None
        Time of all readings (s), including settling; None if the budget is a number of readings.
    predicted : mapping of str to PredictedReading
        By observable.
    """

    setting: Mapping[str, float]
    readings: int
    time: float | None
    predicted: Mapping[str, PredictedReading]


@dataclass(frozen=True)
class ExpectedError:
    """Standard error that a free parameter will have, in SI.

    Attributes
    ----------
    name, unit : str
    value : float
        Expected value, at which the design is optimised.
    se : float
        Standard error by the readings of the design; infinite if they do not determine the
        parameter.
    se_even_grid : float
        Standard error by the even grid of the same budget.
    """

    name: str
    unit: str
    value: float
    se: float
    se_even_grid: float


@dataclass(frozen=True, eq=False)
class Design(Warned):
    """Operating points that answer a question best.

    Attributes
    ----------
    plan : DesignPlan
    points : tuple of DesignedPoint
    readings, spent : float
        Number of readings, and their cost, in readings or s.
    efficiency : float
        Lower bound of the information of the optimal weights over that of the best possible design,
        by the general equivalence theorem.
    efficiency_whole : float
        The same for whole readings.
    parameters : mapping of str to ExpectedError
    correlation : array, shape (n, n)
        Correlation of the coordinates of the free parameters.
    fewer : float
        Readings of an even grid over those of this design, for the same interval or chi-squared;
        NaN if a fit of the rival has not reached a minimum.
    grid_levels : tuple of int
        Levels of the even grid along each axis of the plan.
    grid_usable : (int, int)
        Number of points of the grid that are candidates, and of all its points.
    candidates, combinations : int
        Number of usable points, and of all combinations of the plan.
    left_out : mapping of str to int
        Number of combinations that are no candidates, by reason.
    alone : mapping of str to tuple of AtOneLevel
        For designs that measure parameters: the levels of each axis.
    chi2, chi2_even_grid : float or None
        Expected excess of chi-squared of the refitted rival.
    probability, probability_even_grid : float or None
        Probability of excluding the rival; None if its fit has not reached a minimum.
    rival_values : mapping of str to float or None
        Parameters of the rival's best fit to the readings of the design.
    simulation : Simulated or None
    sentences : tuple of str
        As in `Warned`, which has the warnings.
    """

    plan: DesignPlan
    points: tuple[DesignedPoint, ...]
    readings: float
    spent: float
    efficiency: float
    efficiency_whole: float
    parameters: Mapping[str, ExpectedError]
    correlation: Float
    fewer: float
    grid_levels: tuple[int, ...]
    grid_usable: tuple[int, int]
    candidates: int
    combinations: int
    left_out: Mapping[str, int]
    alone: Mapping[str, tuple[AtOneLevel, ...]] = field(default_factory=dict)
    chi2: float | None = None
    chi2_even_grid: float | None = None
    probability: float | None = None
    probability_even_grid: float | None = None
    rival_values: Mapping[str, float] | None = None
    simulation: Simulated | None = None
    sentences: tuple[str, ...] = ()

    def record(self) -> dict[str, Any]:
        """The design as plain numbers and texts, for JSON; infinite numbers are None."""
        plan = self.plan
        result: dict[str, Any] = {
            "law": plan.truth.law.name,
            "aim": "measure" if plan.rival is None else "exclude",
            "measured": list(plan.question.measure),
            "rival": None if plan.rival is None else plan.rival.law.name,
            "points": [
                {
                    **p.setting,
                    "readings": p.readings,
                    "time": p.time,
                    "predicted": {n: reading._asdict() for n, reading in p.predicted.items()},
                }
                for p in self.points
            ],
            "readings": self.readings,
            "spent": {"value": self.spent, "unit": "s" if plan.question.time else "readings"},
            "efficiency_bound": self.efficiency,
            "efficiency_bound_whole": self.efficiency_whole,
            "parameters": {
                n: {k: v for k, v in vars(p).items() if k != "name"}
                for n, p in self.parameters.items()
            },
            "correlation": {"names": list(self.parameters), "matrix": self.correlation.tolist()},
            "even_grid": {
                "levels": dict(zip(plan.axes, self.grid_levels, strict=True)),
                "usable": self.grid_usable[0],
                "size": self.grid_usable[1],
                "times_fewer": self.fewer,
            },
            "alone": {
                axis: [level._asdict() for level in levels] for axis, levels in self.alone.items()
            },
            "candidates": {
                "combinations": self.combinations,
                "usable": self.candidates,
                "left_out": dict(self.left_out),
            },
            "warnings": list(self.warnings),
            "asperity_version": __version__,
        }
        if plan.rival is not None:
            numbers = ("chi2", "chi2_even_grid", "probability", "probability_even_grid")
            result["separation"] = {name: getattr(self, name) for name in numbers}
            result["separation"]["rival_values"] = dict(self.rival_values or {})
        if self.simulation is not None:
            s = self.simulation
            result["simulation"] = {
                name: getattr(s, name) for name in ("sets", "failed", "decided")
            }
            result["simulation"]["parameters"] = {
                n: {
                    "spread": spread,
                    "uncertainty": s.uncertainty[n],
                    "predicted": self.parameters[n].se,
                }
                for n, spread in s.spread.items()
            }
        return result

    def rows(self) -> list[dict[str, Any]]:
        """The points as rows of a table that ``asperity response --table`` reads.

        Columns: law, all parameters in SI, ``inertia`` = 1 if the mass counts, `readings`,
        `predicted_NAME` of each observable and `NAME_err`, the standard uncertainty of one reading.
        `epsilon` is the applied amplitude; if the contacts carry a share of it, `eps_ratio` is it.
        """
        truth = self.plan.truth
        constants = {**truth.fixed, **expected_values(truth)}
        if constants["eps_ratio"] == 1:
            del constants["eps_ratio"]
        if self.plan.question.inertia:
            constants["inertia"] = 1
        rows = []
        for p in self.points:
            row: dict[str, Any] = {"law": truth.law.name, **p.setting}
            row |= {n: v for n, v in constants.items() if n not in row}
            row["readings"] = p.readings
            for name, (value, error) in p.predicted.items():
                row |= {f"predicted_{name}": value, f"{name}_err": error}
            rows.append(row)
        return rows


#: If the efficiency is lower, a warning says that the weights may not be optimal.
_TRUSTED = 0.95
#: With fewer candidates per free parameter, the ranges decide the design.
_FEW = 3
#: Two laws give the same readings if the mean chi-squared of a reading is lower. Among pairs of
#: eight laws with numbers of PMMA it is 1e-27 if one law contains the other, and at least 1
#: otherwise.
_SAME = 1e-12


@typed
def design(
    plan: DesignPlan | Mapping[str, Any] | str | Path,
    *,
    simulate: Annotated[int, at_least(0)] = 0,
    progress: Progress | None = None,
) -> Design:
    """Operating points that measure parameters or exclude a law best.

    Parameters
    ----------
    plan : DesignPlan, path of a plan file, or its content
        In a content, numbers are SI and texts have units.
    simulate : int
        Number of synthetic sets of readings that are fitted to check the expected errors.
    progress : callable, optional
        Called with the work done, all work, and a label of the work.

    Returns
    -------
    Design

    Raises
    ------
    InputError
        If the plan is wrong, or none of its operating points can be used.

    Notes
    -----
    Local design: the information is evaluated at the expected values of the parameters. If the plan
    has `draws`, the logarithm of the determinant is averaged over draws about these values.
    """
    if isinstance(plan, str | Path):
        plan = read_plan(plan)
    elif isinstance(plan, Mapping):
        plan = plan_of(plan)
    report = progress or (lambda done, total, label: None)
    candidates = candidates_of(plan, report)
    _require_candidates(candidates)
    values = expected_values(plan.truth)
    at = predicted(plan, plan.truth, candidates.points, values, labelled(report, "derivatives"))
    expected = expected_readings(plan, candidates.points, at.whole)
    jacobian = differences(plan.truth, expected, at, values)[1]
    unseen = ~at.seen
    candidates = candidates.without(unseen, "its derivatives were not found")
    _require_candidates(candidates)
    cost = plan.cost(candidates.points["V"])
    if cost.min() > plan.budget:
        rule, got = "suffice for one reading", f"{plan.budget:g} s"
        raise InputError("time", rule, got, f"the shortest takes {cost.min():g} s")
    shape = tuple(levels.size for levels in plan.axes.values())
    grid = even_grid(shape, candidates.index, cost, plan.budget)
    expected, jacobian = expected.without(unseen), jacobian[~unseen]
    task = _Task(plan, candidates, expected, jacobian, cost, grid, report)
    return task.measuring(simulate) if plan.rival is None else task.excluding(plan.rival, simulate)


def _require_candidates(candidates: Candidates) -> None:
    if not candidates.index.size:
        why = "; ".join(f"{count} times: {text}" for text, count in candidates.left_out.items())
        rule = "hold operating points at which the slider slides steadily"
        advice = "lower W0, stiffen the spring, or widen the ranges"
        raise InputError("ranges", rule, f"none of {candidates.total} ({why})", advice)


@dataclass(frozen=True, eq=False)
class _Task:
    """A plan with its candidates solved."""

    plan: DesignPlan
    candidates: Candidates
    expected: LockInTable
    jacobian: Float
    cost: Float
    grid: EvenGrid
    report: Progress

    @property
    def prior(self) -> Float:
        """Derivatives of the residuals of the priors of the later fit, shape (q, p)."""
        truth = self.plan.truth
        return truth.prior_residuals(truth.coordinates(expected_values(truth)))[1]

    def measuring(self, simulate: int) -> Design:
        """The design that measures parameters."""
        total, criterion = self.plan.budget, self._determinant()
        self.report(0, 1, "design weights")
        weights, efficiency = optimal_weights(criterion, total / self.cost)
        n = whole_readings(criterion, self.cost, total, weights)
        value = criterion.value(n.astype(float))
        behind = criterion.value(weights * total / self.cost) - value
        whole = efficiency * math.exp(-max(behind, 0.0) / criterion.parameters)
        fewer = times_fewer(criterion, self.grid.readings(self.cost, total), value)
        alone = self._alone(criterion, value)
        return self._described(n, efficiency, whole, simulate, fewer=fewer, alone=alone)

    def _alone(self, criterion: Determinant, value: float) -> dict[str, tuple[AtOneLevel, ...]]:
        """Designs at one level of each axis that has several."""

        def at(axis: str, level: float) -> AtOneLevel:
            rows = np.flatnonzero(self.candidates.points[axis] == level)
            if not rows.size:
                return AtOneLevel(level, 0, math.inf)
            part = criterion.restricted(rows)
            readings = self.plan.budget / self.cost[rows]
            n = optimal_weights(part, readings)[0] * readings
            return AtOneLevel(level, rows.size, times_fewer(part, n, value))

        return {
            axis: tuple(at(axis, level) for level in levels.tolist())
            for axis, levels in self.plan.axes.items()
            if levels.size > 1
        }

    def excluding(self, rival: Objective, simulate: int) -> Design:
        """The design that excludes the rival."""
        plan, total = self.plan, self.plan.budget
        fits = RivalFit(plan, rival, self.candidates.points, self.expected)
        result = separation(fits, self.cost, total, self.report)
        n, grid = result.readings.astype(float), self.grid.readings(self.cost, total)
        best, name = result.fitted, rival.law.name
        values = "; ".join(f"{key} = {v:.4g}" for key, v in rival.named(best.u).items())
        field = "rival"
        if not math.isfinite(best.chi2):
            rule, got = "have responses where the law has them", f"'{name}', which lost them"
            advice = "narrow the ranges, or free fewer of its parameters"
            raise InputError(field, rule, got, advice)
        if best.chi2 < _SAME * n.sum():
            rule = f"give other readings than {plan.truth.law.name} in the ranges"
            got, advice = f"'{name}', which gives the same with {values}", "exchange the two laws"
            raise InputError(field, rule, got, f"{advice}, or fix some of its parameters")
        on_grid = fits.fitted(grid, best.u)
        probable, probable_on_grid = (
            fits.probability_of_deciding(self.jacobian, m, end)
            for m, end in ((n, best), (grid, on_grid))
        )
        warnings = [
            f"the fit of {name} to {where} ended next to values with which it has no response: "
            "its chi-squared is not the least, and the probability of deciding is not known"
            for where, p in (("these readings", probable), ("the even grid", probable_on_grid))
            if p is None
        ]
        fewer = best.chi2 / on_grid.chi2 if on_grid.chi2 > 0 else math.inf
        fewer = math.nan if warnings else fewer
        if result.unseen:
            warnings.append(
                f"{name} has no response at {result.unseen} candidates with the values that come "
                "nearest; they were not judged"
            )
        # The bound holds only at a minimum.
        efficiency = 0.0 if probable is None else result.efficiency
        return self._described(
            result.readings,
            efficiency,
            efficiency * min(best.chi2 / result.chi2_weights, 1.0),
            simulate,
            (fits.to(n), best.u),
            warnings,
            fewer=fewer,
            chi2=best.chi2,
            chi2_even_grid=on_grid.chi2,
            probability=probable,
            probability_even_grid=probable_on_grid,
            rival_values=rival.named(best.u),
        )

    def _determinant(self) -> Determinant:
        """The criterion at the expected values, or averaged over the draws."""
        plan, points = self.plan, self.candidates.points
        interest = [plan.truth.names.index(name) for name in plan.question.measure]
        parts = []
        for k, values in enumerate(self.candidates.draws):
            rows = np.flatnonzero(self.candidates.usable[k])
            if not rows.size:  # Nothing slides steadily: this draw prefers no point.
                continue
            some = some_of(points, rows)
            label = f"derivatives, draw {k + 1} of {len(self.candidates.draws)}"
            at = predicted(plan, plan.truth, some, values, labelled(self.report, label))
            readings = expected_readings(plan, some, at.whole)
            jacobian = differences(plan.truth, readings, at, values)[1]
            # A point without steady sliding has no information.
            parts.append(np.zeros_like(self.jacobian))
            parts[-1][rows] = jacobian
        return Determinant(np.array(parts or [self.jacobian]), self.prior, interest)

    def _described(
        self,
        n: Whole,
        efficiency: float,
        whole: float,
        simulate: int,
        rival: tuple[Objective, Float] | None = None,
        warnings: Sequence[str] = (),
        *,
        fewer: float,
        **numbers: Any,
    ) -> Design:
        """The design of whole readings; `numbers` are further fields of it."""
        plan, candidates = self.plan, self.candidates
        errors, correlation = self._errors(n.astype(float))
        warnings = [*warnings, *self._warnings(errors, efficiency)]
        undetermined = any(math.isinf(errors[name].se) for name in plan.question.measure)
        simulation = None
        if simulate:
            simulation = simulated(
                plan, self.expected, n.astype(float), simulate, rival, self.report
            )
            expected = {name: error.se for name, error in errors.items()}
            warnings += deviations_of_simulation(simulation, expected)
        return Design(
            plan=plan,
            points=tuple(self._point(int(i), n) for i in np.flatnonzero(n)),
            readings=int(n.sum()),
            spent=float(n @ self.cost),
            efficiency=efficiency,
            efficiency_whole=whole,
            parameters=errors,
            correlation=correlation,
            fewer=math.nan if undetermined else fewer,
            grid_levels=self.grid.levels,
            grid_usable=(self.grid.rows.size, self.grid.size),
            candidates=candidates.index.size,
            combinations=candidates.total,
            left_out=candidates.left_out,
            simulation=simulation,
            sentences=tuple(warnings),
            **numbers,
        )

    def _errors(self, n: Float) -> tuple[dict[str, ExpectedError], Float]:
        """Expected standard errors with the design and with the even grid, and correlations."""
        information = np.einsum("imp,imq->ipq", self.jacobian, self.jacobian)
        prior = self.prior.T @ self.prior
        grid = self.grid.readings(self.cost, self.plan.budget)
        (covariance, loose), (even, loose_even) = (
            inverse_information(np.einsum("i,ipq->pq", m, information) + prior) for m in (n, grid)
        )
        sd, sd_even = np.sqrt(np.diag(covariance)), np.sqrt(np.diag(even))
        errors = {}
        for i, u in enumerate(self.plan.truth.unknowns):
            slope = abs(u.slope(u.middle))
            errors[u.name] = ExpectedError(
                u.name,
                u.parameter.unit,
                u.middle,
                math.inf if loose[i] else slope * float(sd[i]),
                math.inf if loose_even[i] else slope * float(sd_even[i]),
            )
        return errors, covariance / np.outer(sd, sd)

    def _warnings(self, errors: Mapping[str, ExpectedError], efficiency: float) -> list[str]:
        warnings, usable = [], self.candidates.index.size
        for unknown in self.plan.truth.unknowns:
            error = errors[unknown.name]
            slope = abs(unknown.slope(error.value))
            if error.se > UNDETERMINED * slope and (
                unknown.name in (self.plan.question.measure or errors)
            ):
                warnings.append(
                    f"{named(unknown.name)} will not be determined by these readings: its "
                    f"standard error will be {error.se:.3g} {error.unit}".rstrip()
                )
        if efficiency < _TRUSTED:
            warnings.append(
                f"the search for the best design weights ended early: they are at least "
                f"{efficiency:.2g} times as good as the best possible"
            )
        if usable < _FEW * len(errors):
            warnings.append(
                f"only {usable} of {self.candidates.total} combinations can be used; "
                "the ranges decide this design more than the question"
            )
        return warnings

    def _point(self, i: int, n: Whole) -> DesignedPoint:
        readings = self.expected
        return DesignedPoint(
            {name: float(v[i]) for name, v in self.candidates.points.items()},
            int(n[i]),
            float(n[i] * self.cost[i]) if self.plan.question.time is not None else None,
            {
                k: PredictedReading(float(v[i]), float(readings.errors[k][i]))
                for k, v in readings.values.items()
            },
        )
