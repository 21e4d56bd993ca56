"""What a design says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from asperity._version import __version__
from asperity.arrays import Float
from asperity.inference.design.plan import DesignPlan, expected_values


@dataclass(frozen=True)
class Simulated:
    """What came of fits to synthetic readings.

    Attributes
    ----------
    sets : int
        Fits that converged.
    failed : int
    spread : mapping of str to float
        Standard deviation of the estimates in SI: half the width that holds 68 % of them.
    uncertainty : mapping of str to float
        Standard error of that spread, by bootstrap.
    decided : float or None
        Share of the sets that exclude the rival.
    """

    sets: int
    failed: int
    spread: Mapping[str, float]
    uncertainty: Mapping[str, float]
    decided: float | None = None


@dataclass(frozen=True)
class DesignedPoint:
    """An operating point of a design.

    Attributes
    ----------
    setting : mapping of str to float
        V, epsilon (as applied), frequency, and other axes of the plan, in SI.
    readings : int
    time : float or None
        Of all its readings (s), settling included; None where the budget is a number of readings.
    predicted : mapping of str to (float, float)
        Expected reading of each observable, and its standard uncertainty.
    """

    setting: Mapping[str, float]
    readings: int
    time: float | None
    predicted: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class ExpectedError:
    """Standard error that a free parameter will have, in SI.

    Attributes
    ----------
    name, unit : str
    value : float
        Expected value, for which the design is made.
    se : float
        With the readings of the design; infinite if they do not determine the parameter.
    se_grid : float
        With the even grid of the same budget.
    """

    name: str
    unit: str
    value: float
    se: float
    se_grid: float


@dataclass(frozen=True, eq=False)
class Design:
    """Operating points that answer a question best.

    Attributes
    ----------
    plan : DesignPlan
    points : tuple of DesignedPoint
    readings, spent : float
        Number of readings, and what they cost, in readings or s.
    efficiency : float
        Information of the optimal shares over that of the best possible design, at least: by the
        general equivalence theorem.
    efficiency_whole : float
        The same of the whole readings.
    parameters : mapping of str to ExpectedError
    correlation : array, shape (n, n)
        Of the coordinates of the free parameters.
    fewer : float
        How many times fewer readings than an even grid give the same interval, or chi-squared.
    grid_levels : tuple of int
        Levels of the even grid along each axis of the plan.
    grid_usable : (int, int)
        Points of the grid that are candidates, and all.
    candidates, combinations : int
        Usable points, and all combinations of the plan.
    left_out : mapping of str to int
        Reasons why combinations are no candidates, with their number.
    alone : mapping of str to tuple of (float, int, float)
        For each level of an axis: its value, the candidates that have it, and how many times the
        readings of this design are needed if all have that level, the others chosen best. Of
        designs that measure parameters.
    chi2, chi2_grid : float or None
        Expected chi-squared by which the refitted rival is behind.
    probability, probability_grid : float or None
        Of excluding the rival.
    rival_values : mapping of str to float or None
        Parameters with which the rival comes nearest to the design's readings.
    simulation : Simulated or None
    warnings : tuple of str
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
    alone: Mapping[str, tuple[tuple[float, int, float], ...]] = field(default_factory=dict)
    chi2: float | None = None
    chi2_grid: float | None = None
    probability: float | None = None
    probability_grid: float | None = None
    rival_values: Mapping[str, float] | None = None
    simulation: Simulated | None = None
    warnings: tuple[str, ...] = ()

    def record(self) -> dict[str, Any]:
        """Everything as plain numbers and texts, for JSON; numbers that are infinite are None."""
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
                    "predicted": {
                        n: {"value": v, "uncertainty": e} for n, (v, e) in p.predicted.items()
                    },
                }
                for p in self.points
            ],
            "readings": self.readings,
            "spent": {"value": self.spent, "unit": "s" if plan.question.time else "readings"},
            "efficiency_bound": self.efficiency,
            "efficiency_bound_whole": self.efficiency_whole,
            "parameters": {
                n: {"value": p.value, "unit": p.unit, "se": p.se, "se_even_grid": p.se_grid}
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
                axis: [
                    {"level": level, "candidates": count, "times_more": more}
                    for level, count, more in levels
                ]
                for axis, levels in self.alone.items()
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
            result["separation"] = {
                "chi2": self.chi2,
                "chi2_even_grid": self.chi2_grid,
                "probability": self.probability,
                "probability_even_grid": self.probability_grid,
                "rival_values": dict(self.rival_values or {}),
            }
        if self.simulation is not None:
            s = self.simulation
            result["simulation"] = {
                "sets": s.sets,
                "failed": s.failed,
                "decided": s.decided,
                "parameters": {
                    n: {
                        "spread": s.spread[n],
                        "uncertainty": s.uncertainty[n],
                        "predicted": self.parameters[n].se,
                    }
                    for n in s.spread
                },
            }
        return result

    def rows(self) -> list[dict[str, Any]]:
        """The points as rows of a table that ``asperity response --table`` reads.

        Columns: law, all parameters in SI, `readings`, `predicted_NAME` of each observable and
        `NAME_err`, the standard uncertainty of one reading. `epsilon` is as applied: with eps_ratio
        other than 1 the contacts carry eps_ratio times it.
        """
        truth = self.plan.truth
        constants = {**truth.fixed, **expected_values(truth)}
        constants.pop("eps_ratio", None)
        rows = []
        for p in self.points:
            row: dict[str, Any] = {"law": truth.law.name, **p.setting}
            row |= {n: v for n, v in constants.items() if n not in row}
            row["readings"] = p.readings
            for name, (value, error) in p.predicted.items():
                row |= {f"predicted_{name}": value, f"{name}_err": error}
            rows.append(row)
        return rows
