"""Thresholds of stiffness: where modulated sliding loses stability when its spring is softened."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from asperity.errors import InputError
from asperity.laws import get_law
from asperity.operating_point import motions
from asperity.parameters import Output
from asperity.sweep.plan.model import SweepPlan
from asperity.sweep.plan.points import Points
from asperity.sweep.solve.kind import Findings, SolveKind, laws_of
from asperity.sweep.solve.outcome import SweepOutcome
from asperity.sweep.solve.periodic import solvable
from asperity.sweep.threshold import require_scan, search_thresholds

#: Codes of the bifurcations, in the order of `flag_meanings`.
KINDS = ("fold", "period doubling", "Neimark-Sacker")
_OUTCOMES = {
    "found": SweepOutcome.CONVERGED,
    "stable": SweepOutcome.STABLE_THROUGHOUT,
    "unstable": SweepOutcome.UNSTABLE_THROUGHOUT,
    "no crossing": SweepOutcome.NO_CROSSING,
    "no response": SweepOutcome.NO_RESPONSE,
}


class ThresholdSolve(SolveKind):
    """`asperity.sweep.threshold.stiffness_threshold` at every point; K and K/K_c are its answers.

    Stiffnesses are looked for between multiples of K_c = (B - A) W0/D0 of the same point.
    """

    name = "threshold"
    outputs = (
        Output("K_threshold", "N/m", "stiffness below which modulated sliding is unstable", "K^*"),
        Output("threshold_ratio", "1", "threshold over K_c = (B - A) W0/D0", "K^*/K_c"),
        Output("mode_frequency", "Hz", "frequency of the mode that starts to grow, modulo f"),
        Output("bifurcation", "1", "0: fold, 1: period doubling, 2: Neimark-Sacker"),
    )
    defaults = tuple(output.name for output in outputs)
    supplies = ("K",)
    batch = 24

    def settings(self, plan: SweepPlan) -> dict[str, Any]:
        """As in `SolveKind`."""
        super().settings(plan)
        low, high = plan.threshold.between
        if not 0 < low < high:
            raise InputError(
                f"threshold.between must go from a softer to a stiffer spring, got {low:g} to "
                f"{high:g}; write it like [0.3, 4.0]"
            )
        return {"between": [low, high], "scan": plan.threshold.scan}

    def require_memory(self, points: int, record: Mapping[str, Any]) -> None:
        """As in `SolveKind`, and for the stiffnesses of a batch."""
        super().require_memory(points, record)
        require_scan(min(points, self.batch), record["settings"]["scan"], "threshold.scan")

    def chunk_points(self, points: int, record: Mapping[str, Any]) -> int:
        """As in `SolveKind`."""
        return max(self.batch, min(20 * self.batch, points // 8))

    def first(self, points: Points, record: Mapping[str, Any]) -> Findings:
        """Only what cannot be solved is found out: every threshold takes a search."""
        found = Findings.empty(record["outputs"], len(points))
        for law, rows in laws_of(points):
            solvable(law, _with_stiffness(points, rows, law, record)[0], rows, found)
        return found

    def second(self, points: Points, record: Mapping[str, Any]) -> Findings:
        """As in `SolveKind`."""
        found = Findings.empty(record["outputs"], len(points))
        for law, rows in laws_of(points):
            values, critical = _with_stiffness(points, rows, law, record)
            for group in motions(values):
                some = {n: v[group] for n, v in values.items()}
                found.put(rows[group], _search(law, some, critical[group], record))
        return found


def _with_stiffness(
    points: Points, rows: Any, law: str, record: Mapping[str, Any]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Values of the points, with the softest spring in place of none, and K_c."""
    values = points.take(rows).of_law(law)
    if not {"A", "B", "D0"} <= set(values):
        critical = np.full(len(rows), np.nan)
    else:
        critical = (values["B"] - values["A"]) * values["W0"] / values["D0"]
    values["K"] = record["settings"]["between"][0] * critical
    return values, critical


def _search(
    law: str, values: dict[str, np.ndarray], critical: np.ndarray, record: Mapping[str, Any]
) -> Findings:
    settings = record["settings"]
    low, high = settings["between"]
    searched = search_thresholds(
        get_law(law), values, low * critical, high * critical, settings["scan"]
    )
    numbers = {
        "K_threshold": searched.K,
        "threshold_ratio": searched.K / critical,
        "mode_frequency": searched.turn * values["frequency"],
        "bifurcation": np.array(
            [KINDS.index(k) if k in KINDS else np.nan for k in searched.kind], dtype=float
        ),
    }
    outcome = np.array([int(_OUTCOMES[what]) for what in searched.what], dtype=np.int16)
    good = outcome == SweepOutcome.CONVERGED
    return Findings(
        {name: np.where(good, numbers[name], np.nan) for name in record["outputs"]},
        outcome,
        np.where(good, 0.0, searched.where / critical),
    )
