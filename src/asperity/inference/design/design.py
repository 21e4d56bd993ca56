"""From a plan to the operating points that answer its question best."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.inference.design.candidates import (
    Candidates,
    Progress,
    candidates_of,
    without_rows,
)
from asperity.inference.design.plan import DesignPlan
from asperity.inference.design.plan_file import plan_of, read_plan
from asperity.inference.design.predictions import PointModel, prior_terms, rows_of, stacked
from asperity.inference.design.result import Design, DesignedPoint, ExpectedError
from asperity.inference.design.rival import (
    RivalFit,
    Separation,
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
    times_fewer_of,
    whole_readings,
)
from asperity.inference.design.simulation import Simulated, simulated
from asperity.inference.fitting.intervals import UNDETERMINED, inverse_information
from asperity.inference.tables.table import LockInTable

Float = NDArray[np.float64]

#: Points between two reports of progress, of the fast method and of the search.
_BLOCK, _SLOW_BLOCK = 256, 32
#: Efficiency below which the shares are not called optimal.
_TRUSTED = 0.95
#: Candidates per free parameter below which the ranges decide the design.
_FEW = 3
#: A simulated spread surprises if it differs by more of its own standard errors, plus this share
#: of the expected one.
_SURPRISING, _LINEAR = 3.0, 0.1


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
    result = candidates_of(plan, report)
    _require_candidates(plan, result)
    model = PointModel(plan, plan.truth, result.points, result.slow)
    expected, jacobian = _in_blocks(model, plan.truth.values, report, "derivatives")
    seen = np.asarray(np.isfinite(jacobian).all(axis=(1, 2)))
    if not seen.all():
        result = without_rows(result, seen, "its derivatives were not found")
        _require_candidates(plan, result)
        expected, jacobian = expected.without(~seen), jacobian[seen]
    cost, total = plan.budget.cost(result.points["V"]), plan.budget.total
    if cost.min() > total:
        raise InputError(
            f"{plan.name}.time must suffice for one reading, got {total:g} s; the shortest takes "
            f"{cost.min():g} s"
        )
    grid = even_grid(plan.shape, result.index, cost, total)
    task = _Task(plan, result, expected, jacobian, cost, total, grid, report)
    return task.measuring(simulate) if plan.rival is None else task.excluding(simulate)


def _require_candidates(plan: DesignPlan, result: Candidates) -> None:
    if not result.size:
        why = "; ".join(f"{count} times: {reason}" for reason, count in result.left_out.items())
        raise InputError(
            f"{plan.name}.ranges must hold operating points at which the slider slides steadily, "
            f"got none of {result.total} ({why}); lower W0, stiffen the spring, or widen the ranges"
        )


def _in_blocks(
    model: PointModel, values: Mapping[str, float], report: Progress, label: str
) -> tuple[LockInTable, Float]:
    """Expected readings, and the derivatives of one reading in its standard uncertainties."""
    tables, jacobians, order = [], [], []
    for slow, block in ((False, _BLOCK), (True, _SLOW_BLOCK)):
        some = np.flatnonzero(model.slow == slow)
        for start in range(0, some.size, block):
            rows = some[start : start + block]
            points = {n: v[rows] for n, v in model.points.items()}
            part = PointModel(model.plan, model.hypothesis, points, model.slow[rows])
            readings, result = part.expected(values)
            tables.append(readings)
            jacobians.append(result.jacobian)
            order.append(rows)
            report(sum(r.size for r in order), model.size, label)
    back = np.argsort(np.concatenate(order))
    return rows_of(stacked(tables), back), np.concatenate(jacobians)[back]


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
    total: float
    grid: EvenGrid
    report: Progress

    @property
    def prior(self) -> Float:
        """Information of the priors of the later fit."""
        _, slopes = prior_terms(self.plan.truth, self.plan.truth.coordinates[None])
        return np.asarray(slopes[0].T @ slopes[0])

    def measuring(self, simulate: int) -> Design:
        """The design that measures parameters."""
        criterion = self._determinant()
        self.report(0, 1, "shares")
        shares = optimal_shares(criterion, self.total / self.cost)
        n = whole_readings(criterion, self.cost, self.total, shares.shares)
        grid = self.grid.readings(self.cost, self.total)
        fewer = times_fewer(criterion, n.astype(float), grid)
        value = criterion.value(n.astype(float))
        best = criterion.value(shares.shares * self.total / self.cost)
        reached = shares.efficiency * criterion.least_efficiency(best - value, value)
        alone = self._alone(criterion, value)
        return self._described(n, shares, reached, fewer, simulate, {"alone": alone})

    def _alone(
        self, criterion: Determinant, value: float
    ) -> dict[str, tuple[tuple[float, int, float], ...]]:
        """What each setting gives by itself, the others chosen best."""
        result: dict[str, tuple[tuple[float, int, float], ...]] = {}
        for axis in self.plan.axes:
            if axis.levels.size == 1:
                continue
            levels = []
            for level in axis.levels:
                rows = np.flatnonzero(self.candidates.points[axis.name] == level)
                more = math.inf
                if rows.size:
                    part = criterion.restricted(rows)
                    readings = self.total / self.cost[rows]
                    n = optimal_shares(part, readings).shares * readings
                    more = times_fewer_of(part, n, value)
                levels.append((float(level), int(rows.size), more))
            result[axis.name] = tuple(levels)
        return result

    def excluding(self, simulate: int) -> Design:
        """The design that excludes the rival."""
        plan = self.plan
        assert plan.rival is not None  # by the choice of the aim
        fits = RivalFit(plan, plan.rival, self.candidates, self.expected)
        result = separation(fits, self.cost, self.total, self.report)
        n = result.readings
        grid = self.grid.readings(self.cost, self.total)
        starts = np.array(
            [[float(u.to_coordinate(result.values[u.name])) for u in plan.rival.unknowns]]
        )
        starts = np.vstack([starts, plan.rival.coordinates])
        on_grid = fits.fitted(grid, starts)
        counts = (len(plan.truth.names), len(plan.rival.names))
        probable = [
            probability_of_deciding(self.jacobian, linear, readings, counts, plan.seed)
            for linear, readings in (
                (result.criterion, n.astype(float)),
                (fits.criterion(on_grid.coordinates[0])[0], grid),
            )
        ]
        behind = float(on_grid.chi2[0])
        separated = {
            "chi2": result.chi2,
            "chi2_grid": behind,
            "probability": probable[0],
            "probability_grid": probable[1],
            "rival_values": result.values,
        }
        warnings = []
        if result.unseen:
            warnings.append(
                f"{plan.rival.law.name} has no response at {result.unseen} candidates with the "
                "values that come nearest; they were not judged"
            )
        fewer = result.chi2 / behind if behind > 0 else math.inf
        whole = result.criterion.least_efficiency(result.chi2_shares - result.chi2, result.chi2)
        reached = result.shares.efficiency * whole
        return self._described(
            n, result.shares, reached, fewer, simulate, separated, warnings, (fits, result)
        )

    def _determinant(self) -> Determinant:
        """The criterion at the expected values, or averaged over the draws."""
        plan, result = self.plan, self.candidates
        interest = [plan.truth.names.index(name) for name in plan.measured]
        if not plan.draws:
            information = fisher_information(self.jacobian)[None]
            return Determinant(information, self.prior[None], interest)
        parts = []
        for k, values in enumerate(result.draws):
            rows = np.flatnonzero(result.usable[k])
            some = {n: v[rows] for n, v in result.points.items()}
            model = PointModel(plan, plan.truth, some, result.slow[rows])
            label = f"derivatives, draw {k + 1} of {len(result.draws)}"
            _, jacobian = _in_blocks(model, values, self.report, label)
            # A point that slides unsteadily tells nothing.
            information = np.zeros((result.size, len(plan.truth.names), len(plan.truth.names)))
            information[rows] = np.nan_to_num(fisher_information(jacobian))
            parts.append(information)
        prior = np.broadcast_to(self.prior, (len(parts), *self.prior.shape))
        return Determinant(np.array(parts), prior, interest)

    def _described(
        self,
        n: NDArray[np.int64],
        shares: Shares,
        reached: float,
        fewer: float,
        simulate: int,
        separated: Mapping[str, Any] | None = None,
        warnings: Sequence[str] = (),
        rival: tuple[RivalFit, Separation] | None = None,
    ) -> Design:
        plan, result = self.plan, self.candidates
        errors, correlation = self._errors(n.astype(float))
        said = [*warnings, *self._warnings(errors, shares)]
        simulation = None
        if simulate:
            simulation = self._simulated(n, simulate, rival)
            said += _surprises(simulation, errors)
        return Design(
            plan=plan,
            points=tuple(self._point(int(i), n) for i in np.flatnonzero(n)),
            readings=int(n.sum()),
            spent=float(n @ self.cost),
            efficiency=shares.efficiency,
            efficiency_whole=reached,
            parameters=errors,
            correlation=correlation,
            fewer=fewer,
            grid_levels=self.grid.levels,
            grid_usable=(self.grid.rows.size, self.grid.size),
            candidates=result.size,
            combinations=result.total,
            left_out=result.left_out,
            simulation=simulation,
            warnings=tuple(said),
            **(separated or {}),
        )

    def _errors(self, n: Float) -> tuple[dict[str, ExpectedError], Float]:
        """Expected standard errors with the design and with the even grid, and correlations."""
        truth = self.plan.truth
        information = fisher_information(self.jacobian)
        grid = self.grid.readings(self.cost, self.total)
        (covariance, loose), (even, loose_even) = (
            inverse_information(np.einsum("i,ipq->pq", m, information) + self.prior)
            for m in (n, grid)
        )
        sd, sd_even = np.sqrt(np.diag(covariance)), np.sqrt(np.diag(even))
        errors = {}
        for i, u in enumerate(truth.unknowns):
            value = truth.values[u.name]
            slope = abs(u.slope(value))
            errors[u.name] = ExpectedError(
                u.name,
                u.parameter.unit,
                value,
                math.inf if loose[i] else slope * float(sd[i]),
                math.inf if loose_even[i] else slope * float(sd_even[i]),
            )
        return errors, covariance / np.outer(sd, sd)

    def _warnings(self, errors: Mapping[str, ExpectedError], shares: Shares) -> list[str]:
        said = []
        for unknown in self.plan.truth.unknowns:
            error = errors[unknown.name]
            slope = abs(unknown.slope(error.value))
            if error.se > UNDETERMINED * slope and unknown.name in (self.plan.measured or errors):
                said.append(
                    f"{unknown.name} will not be determined by these readings: its standard error "
                    f"will be {error.se:.3g} {error.unit}".rstrip()
                )
        if shares.efficiency < _TRUSTED:
            said.append(
                f"the search for the best shares ended early: they are at least "
                f"{shares.efficiency:.2g} times as good as the best possible"
            )
        if self.candidates.size < _FEW * len(errors):
            said.append(
                f"only {self.candidates.size} of {self.candidates.total} combinations can be used; "
                "the ranges decide this design more than the question"
            )
        return said

    def _point(self, i: int, n: NDArray[np.int64]) -> DesignedPoint:
        return DesignedPoint(
            {name: float(v[i]) for name, v in self.candidates.points.items()},
            int(n[i]),
            float(n[i] * self.cost[i]) if self.plan.budget.time is not None else None,
            {
                name: (float(self.expected.values[name][i]), float(self.expected.errors[name][i]))
                for name in self.expected.values
            },
        )

    def _simulated(
        self, n: NDArray[np.int64], sets: int, rival: tuple[RivalFit, Separation] | None
    ) -> Simulated:
        rows = np.flatnonzero(n)
        keep = np.zeros(n.size, bool)
        keep[rows] = True
        some = {name: v[rows] for name, v in self.candidates.points.items()}
        model = PointModel(self.plan, self.plan.truth, some, self.candidates.slow[rows])
        other = None
        if rival is not None:
            fits, result = rival
            other = fits.at(rows)[0], result.values
        return simulated(
            model,
            self.expected.without(~keep),
            n[rows].astype(float),
            sets,
            self.plan.seed,
            self.report,
            other,
        )


def _surprises(result: Simulated, errors: Mapping[str, ExpectedError]) -> list[str]:
    """Where the simulated fits differ from what was expected."""
    said = []
    if result.failed:
        said.append(
            f"{result.failed} of {result.failed + result.sets} simulated fits did not converge"
        )
    for name, spread in result.spread.items():
        expected = errors[name].se
        if abs(spread - expected) > _SURPRISING * result.uncertainty[name] + _LINEAR * expected:
            said.append(
                f"the simulated spread of {name}, {spread:.3g}, is not the expected standard error "
                f"{expected:.3g}: predictions are not linear in it over so wide a range"
            )
    return said
