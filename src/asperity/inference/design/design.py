"""From a plan to the operating points that answer its question best."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Float
from asperity.errors import InputError
from asperity.inference.comparison.evidence import EXCLUDED
from asperity.inference.design.candidates import (
    Candidates,
    Progress,
    candidates_of,
    differences,
    expected_readings,
    labelled,
    predicted,
    some_of,
    with_readings,
)
from asperity.inference.design.plan import DesignPlan, expected_values, plan_of, read_plan
from asperity.inference.design.result import Design, DesignedPoint, ExpectedError, Simulated
from asperity.inference.design.rival import (
    RivalFit,
    penalty,
    probability_of_deciding,
    separation,
)
from asperity.inference.design.shares import (
    Determinant,
    EvenGrid,
    Shares,
    even_grid,
    optimal_shares,
    times_fewer,
    whole_readings,
)
from asperity.inference.fitting.intervals import UNDETERMINED, inverse_information
from asperity.inference.objective import Minimum, Objective
from asperity.inference.tables.table import OBSERVABLES, LockInTable
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import Unknown

#: Efficiency below which the shares are not called optimal.
_TRUSTED = 0.95
#: Candidates per free parameter below which the ranges decide the design.
_FEW = 3
#: A simulated spread surprises if it differs by more of its own standard errors, plus this share
#: of the expected one.
_SURPRISING, _LINEAR = 3.0, 0.1
#: Decrease of chi-squared that is left at the end of a fit that has not converged.
_LEFT = 0.01


def design(
    plan: DesignPlan | Mapping[str, Any] | str | Path,
    *,
    simulate: int = 0,
    progress: Progress | None = None,
) -> Design:
    """Operating points that measure parameters or exclude a law best.

    Parameters
    ----------
    plan : DesignPlan, path of a plan file, or its content
        Numbers of a content are SI, texts carry their unit.
    simulate : int
        Number of synthetic sets of readings that are fitted to check the expected errors.
    progress : callable, optional
        Called with the work done, all work, and what it is.

    Returns
    -------
    Design

    Raises
    ------
    InputError
        If the plan is wrong, or no operating point of it can be used.

    Notes
    -----
    Local design: the information is that at the expected values of the parameters, averaged over
    draws about them if the plan has `draws` (the mean of the logarithm of the determinant).
    """
    if isinstance(plan, str | Path):
        plan = read_plan(plan)
    elif isinstance(plan, Mapping):
        plan = plan_of(plan)
    report = progress or (lambda done, total, label: None)
    candidates = candidates_of(plan, report)
    _require_candidates(plan, candidates)
    values = expected_values(plan.truth)
    at = predicted(plan, plan.truth, candidates.points, values, labelled(report, "derivatives"))
    expected = expected_readings(plan, candidates.points, at.whole)
    jacobian = differences(plan.truth, expected, at, values)[1]
    unseen = ~at.seen
    candidates = candidates.without(unseen, "its derivatives were not found")
    _require_candidates(plan, candidates)
    cost = plan.cost(candidates.points["V"])
    if cost.min() > plan.budget:
        rule, got = "suffice for one reading", f"{plan.budget:g} s"
        raise InputError(f"{plan.name}.time", rule, got, f"the shortest takes {cost.min():g} s")
    shape = tuple(levels.size for levels in plan.axes.values())
    grid = even_grid(shape, candidates.index, cost, plan.budget)
    expected, jacobian = expected.without(unseen), jacobian[~unseen]
    task = _Task(plan, candidates, expected, jacobian, cost, grid, report)
    return task.measuring(simulate) if plan.rival is None else task.excluding(plan.rival, simulate)


def _require_candidates(plan: DesignPlan, candidates: Candidates) -> None:
    if not candidates.index.size:
        why = "; ".join(f"{count} times: {text}" for text, count in candidates.left_out.items())
        rule = "hold operating points at which the slider slides steadily"
        advice = "lower W0, stiffen the spring, or widen the ranges"
        raise InputError(f"{plan.name}.ranges", rule, f"none of {candidates.total} ({why})", advice)


def fisher_information(jacobian: Float) -> Float:
    """Information of one reading at each candidate, shape (candidates, p, p)."""
    return np.asarray(np.einsum("imp,imq->ipq", jacobian, jacobian))


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
        """Information of the priors of the later fit."""
        truth = self.plan.truth
        slopes = truth.prior_residuals(truth.coordinates(expected_values(truth)))[1]
        return np.asarray(slopes.T @ slopes)

    def measuring(self, simulate: int) -> Design:
        """The design that measures parameters."""
        total, criterion = self.plan.budget, self._determinant()
        self.report(0, 1, "shares")
        shares = optimal_shares(criterion, total / self.cost)
        n = whole_readings(criterion, self.cost, total, shares.shares)
        value = criterion.value(n.astype(float))
        best = criterion.value(shares.shares * total / self.cost)
        reached = shares.efficiency * criterion.least_efficiency(best - value, value)
        fewer = times_fewer(criterion, self.grid.readings(self.cost, total), value)
        numbers = {"fewer": fewer, "alone": self._alone(criterion, value)}
        return self._described(n, shares, reached, simulate, numbers)

    def _alone(
        self, criterion: Determinant, value: float
    ) -> dict[str, tuple[tuple[float, int, float], ...]]:
        """What each setting gives by itself, the others chosen best."""
        result: dict[str, tuple[tuple[float, int, float], ...]] = {}
        for axis, values in self.plan.axes.items():
            if values.size == 1:
                continue
            levels = []
            for level in values:
                rows = np.flatnonzero(self.candidates.points[axis] == level)
                more = math.inf
                if rows.size:
                    part = criterion.restricted(rows)
                    readings = self.plan.budget / self.cost[rows]
                    n = optimal_shares(part, readings).shares * readings
                    more = times_fewer(part, n, value)
                levels.append((float(level), int(rows.size), more))
            result[axis] = tuple(levels)
        return result

    def excluding(self, rival: Objective, simulate: int) -> Design:
        """The design that excludes the rival."""
        plan, total = self.plan, self.plan.budget
        fits = RivalFit(plan, rival, self.candidates.points, self.expected)
        result = separation(fits, self.cost, total, self.report)
        grid = self.grid.readings(self.cost, total)
        on_grid = fits.fitted(grid, result.u)
        probable, probable_on_grid = (
            probability_of_deciding(self.jacobian, linear, readings, plan.question.seed)
            for linear, readings in (
                (result.criterion, result.readings.astype(float)),
                (fits.criterion(on_grid.u)[0], grid),
            )
        )
        numbers: dict[str, Any] = {
            "fewer": result.chi2 / on_grid.chi2 if on_grid.chi2 > 0 else math.inf,
            "chi2": result.chi2,
            "chi2_grid": on_grid.chi2,
            "probability": probable,
            "probability_grid": probable_on_grid,
            "rival_values": rival.named(result.u),
        }
        if result.unseen:
            numbers["warnings"] = (
                f"{rival.law.name} has no response at {result.unseen} candidates with the "
                "values that come nearest; they were not judged",
            )
        whole = result.criterion.least_efficiency(result.chi2_shares - result.chi2, result.chi2)
        reached = result.shares.efficiency * whole
        other = (fits, result.u)
        return self._described(result.readings, result.shares, reached, simulate, numbers, other)

    def _determinant(self) -> Determinant:
        """The criterion at the expected values, or averaged over the draws."""
        plan, points = self.plan, self.candidates.points
        interest = [plan.truth.names.index(name) for name in plan.question.measure]
        parts = []
        for k, values in enumerate(self.candidates.draws):
            rows = np.flatnonzero(self.candidates.usable[k])
            some = some_of(points, rows)
            label = f"derivatives, draw {k + 1} of {len(self.candidates.draws)}"
            at = predicted(plan, plan.truth, some, values, labelled(self.report, label))
            readings = expected_readings(plan, some, at.whole)
            jacobian = differences(plan.truth, readings, at, values)[1]
            # A point that slides unsteadily tells nothing.
            information = np.zeros((len(points["V"]), *self.prior.shape))
            information[rows] = fisher_information(jacobian)
            parts.append(information)
        parts = parts or [fisher_information(self.jacobian)]
        return Determinant(np.array(parts), np.array([self.prior] * len(parts)), interest)

    def _described(
        self,
        n: NDArray[np.int64],
        shares: Shares,
        reached: float,
        simulate: int,
        numbers: Mapping[str, Any],
        rival: tuple[RivalFit, Float] | None = None,
    ) -> Design:
        candidates = self.candidates
        errors, correlation = self._errors(n.astype(float))
        said = [*numbers.get("warnings", ()), *self._warnings(errors, shares)]
        simulation = None
        if simulate:
            simulation = self._simulated(n.astype(float), simulate, rival)
            said += _surprises(simulation, errors)
        return Design(
            plan=self.plan,
            points=tuple(self._point(int(i), n) for i in np.flatnonzero(n)),
            readings=int(n.sum()),
            spent=float(n @ self.cost),
            efficiency=shares.efficiency,
            efficiency_whole=reached,
            parameters=errors,
            correlation=correlation,
            grid_levels=self.grid.levels,
            grid_usable=(self.grid.rows.size, self.grid.size),
            candidates=candidates.index.size,
            combinations=candidates.total,
            left_out=candidates.left_out,
            simulation=simulation,
            **{**numbers, "warnings": tuple(said)},
        )

    def _errors(self, n: Float) -> tuple[dict[str, ExpectedError], Float]:
        """Expected standard errors with the design and with the even grid, and correlations."""
        information = fisher_information(self.jacobian)
        grid = self.grid.readings(self.cost, self.plan.budget)
        (covariance, loose), (even, loose_even) = (
            inverse_information(np.einsum("i,ipq->pq", m, information) + self.prior)
            for m in (n, grid)
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

    def _warnings(self, errors: Mapping[str, ExpectedError], shares: Shares) -> list[str]:
        said, usable = [], self.candidates.index.size
        for unknown in self.plan.truth.unknowns:
            error = errors[unknown.name]
            slope = abs(unknown.slope(error.value))
            if error.se > UNDETERMINED * slope and (
                unknown.name in (self.plan.question.measure or errors)
            ):
                said.append(
                    f"{unknown.name} will not be determined by these readings: its standard error "
                    f"will be {error.se:.3g} {error.unit}".rstrip()
                )
        if shares.efficiency < _TRUSTED:
            said.append(
                f"the search for the best shares ended early: they are at least "
                f"{shares.efficiency:.2g} times as good as the best possible"
            )
        if usable < _FEW * len(errors):
            said.append(
                f"only {usable} of {self.candidates.total} combinations can be used; "
                "the ranges decide this design more than the question"
            )
        return said

    def _point(self, i: int, n: NDArray[np.int64]) -> DesignedPoint:
        readings = self.expected
        return DesignedPoint(
            {name: float(v[i]) for name, v in self.candidates.points.items()},
            int(n[i]),
            float(n[i] * self.cost[i]) if self.plan.question.time is not None else None,
            {k: (float(v[i]), float(readings.errors[k][i])) for k, v in readings.values.items()},
        )

    def _simulated(self, n: Float, sets: int, rival: tuple[RivalFit, Float] | None) -> Simulated:
        """Fits of synthetic readings, each set with its own noise and priors about the values.

        Nothing is linear here but the start.
        """
        plan, random = self.plan, np.random.default_rng(self.plan.question.seed)
        counts, readings = n[n > 0], self.expected.without(n <= 0)
        truth = with_readings(plan, plan.truth, readings, counts)
        u, estimates, behind = truth.coordinates(expected_values(truth)), [], []
        data = float(counts.sum()) * len(plan.noise)
        if rival is not None:
            theirs, nearest = rival[0].to(n), rival[1]
        for done in range(sets):
            self.report(done, sets, "synthetic sets")
            normal = random.normal(size=(readings.rows, len(OBSERVABLES)))
            drawn = readings.disturbed(readings.values, normal / np.sqrt(counts)[:, None])
            shifted = tuple(_with_drawn_prior(unknown, random) for unknown in truth.unknowns)
            end = _refitted(replace(truth, unknowns=shifted), drawn, counts, u)
            other = None if rival is None else _refitted(theirs, drawn, counts, nearest)
            if end is None or (rival is not None and other is None):
                continue
            estimates.append(list(truth.named(end.u).values()))
            if other is not None:
                more = penalty(len(nearest), data) - penalty(len(u), data)
                behind.append(other.chi2 - end.chi2 + more)
        columns = np.array(estimates).reshape(-1, len(u)).T
        spreads = {
            name: _spread(column, random) for name, column in zip(truth.names, columns, strict=True)
        }
        return Simulated(
            columns.shape[1],
            sets - columns.shape[1],
            {name: spread for name, (spread, _) in spreads.items()},
            {name: error for name, (_, error) in spreads.items()},
            float((np.array(behind) >= EXCLUDED).mean()) if behind else None,
        )


def _with_drawn_prior(unknown: Unknown, random: np.random.Generator) -> Unknown:
    """The prior as another measurement of the expected value would have given it."""
    if unknown.prior is None:
        return unknown
    mean = unknown.middle + unknown.prior.sd * random.normal()
    return replace(unknown, prior=replace(unknown.prior, mean=mean))


def _refitted(
    objective: Objective, readings: LockInTable, counts: Float, u: Float
) -> Minimum | None:
    """The minimum for other readings at the same points; None where it was not reached."""
    (term,) = objective.terms_of(LockInTerm)
    other = term.with_table(readings).weighted(np.sqrt(counts))
    objective = replace(objective, terms=(other,))
    end = objective.minimise(u)
    reached = math.isfinite(end.chi2) and objective.expected_decrease(end.u) < _LEFT
    return end if reached else None


def _spread(x: Float, random: np.random.Generator) -> tuple[float, float]:
    """Half the width of the central 68 %, which outliers do not inflate, and its standard error."""
    if x.size < 3:
        return float("nan"), float("nan")
    copies = np.vstack([x, random.choice(x, size=(200, x.size))])
    low, high = np.quantile(copies, [0.158655, 0.841345], axis=-1)
    half = (high - low) / 2
    return float(half[0]), float(half[1:].std())


def _surprises(simulation: Simulated, errors: Mapping[str, ExpectedError]) -> list[str]:
    """Where the simulated fits differ from what was expected."""
    said = []
    if simulation.failed:
        said.append(
            f"{simulation.failed} of {simulation.failed + simulation.sets} simulated fits did not "
            "converge"
        )
    for name, spread in simulation.spread.items():
        se, error = errors[name].se, simulation.uncertainty[name]
        if abs(spread - se) > _SURPRISING * error + _LINEAR * se:
            said.append(
                f"the simulated spread of {name}, {spread:.3g}, is not the expected standard error "
                f"{se:.3g}: predictions are not linear in it over so wide a range"
            )
    return said
