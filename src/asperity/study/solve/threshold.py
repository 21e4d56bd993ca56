"""Stiffness thresholds: where modulated sliding loses stability when the spring is softened."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from asperity.errors import require
from asperity.laws import Law
from asperity.parameters import MACHINE, Output, canonical_name
from asperity.questions.sweep import Sweep
from asperity.study.points import RATIOS, Answers, Points, SweepOutcome, critical_stiffness
from asperity.study.responses import solvable
from asperity.study.solve.kind import SolveKind
from asperity.study.threshold import require_scan, search_thresholds

#: The stiffness, and the ratio that determines it.
_SOUGHT = {"K": MACHINE["K"], "stiffness_ratio": RATIOS["stiffness_ratio"].parameter}


class ThresholdSolve(SolveKind):
    """`asperity.study.threshold.stiffness_threshold` at every point; it gives K and K/K_c.

    The limits of the search are multiples of K_c of the same point, from
    `asperity.study.threshold.natural_scales`.
    """

    name = "threshold"
    outputs = (
        Output("K_threshold", "N/m", "stiffness below which modulated sliding is unstable", "K^*"),
        Output("threshold_ratio", "1", "threshold over K_c of unmodulated sliding", "K^*/K_c"),
        Output("mode_frequency", "Hz", "frequency of the mode that starts to grow, modulo f"),
        Output("bifurcation", "1", "0: fold, 1: period doubling, 2: Neimark-Sacker"),
    )
    supplies = ("K",)
    # Enough to share the fixed costs of a search.
    fewest, most = 24, 480

    def settings(self, plan: Sweep) -> dict[str, Any]:
        """As in `SolveKind`."""
        low, high = plan.threshold.between
        rule, got = "go from a softer to a stiffer spring", f"{low:g} to {high:g}"
        require(0 < low < high, "threshold.between", rule, got, "write it like [0.3, 4.0]")
        for place, names in (("parameters", plan.parameters), ("axes", plan.single_columns)):
            for name in names:
                rule, got = "be left out where its threshold is sought", f"'{name}'"
                sought, advice = canonical_name(name, _SOUGHT), "choose threshold.between"
                require(sought is None, f"{place}.{name}", rule, got, advice)
        return {"between": [low, high], "scan": plan.threshold.scan}

    def require_memory(self, points: int, record: Mapping[str, Any]) -> None:
        """As in `SolveKind`, and for the stiffnesses of a chunk."""
        super().require_memory(points, record)
        require_scan(points, record["settings"]["scan"], "threshold.scan")

    def solve_law(self, law: type[Law], points: Points, record: Mapping[str, Any]) -> Answers:
        """As in `SolveKind`."""
        answers = Answers.empty(record["outputs"], len(points))
        values = points.of_law(law.name)
        critical = np.full(len(points), np.nan)
        if {"A", "B", "D0"} <= set(values):
            critical = critical_stiffness(values)
        # A point has no stiffness; any valid one is checked in its place.
        values["K"] = np.ones(len(points))
        sound = solvable(law, values, answers)
        scaled = critical[sound] > 0
        answers.fail(sound[~scaled], SweepOutcome.NO_SCALE)
        sound = sound[scaled]
        if not len(sound):
            return answers
        values, critical = {n: v[sound] for n, v in values.items()}, critical[sound]
        low, high = (end * critical for end in record["settings"]["between"])
        searched = search_thresholds(law, values, low, high, record["settings"]["scan"])
        numbers = {
            "K_threshold": searched["K"],
            "threshold_ratio": searched["K"] / critical,
            **searched.numbers,
        }
        kept = {name: numbers[name] for name in record["outputs"]}
        answers.put(sound, Answers(kept, searched.outcome, searched.detail / critical))
        return answers
