"""Periodic responses, with their stability."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from asperity.laws import Law
from asperity.parameters import OUTPUTS
from asperity.study.axes import columns_of
from asperity.study.outcome import Answers
from asperity.study.points import Points
from asperity.study.responses import answers_of_law
from asperity.study.solve.kind import SolveKind

#: Outputs with one number a point.
_NAMES = (
    *("mean_friction", "delta_mu", "mu_ss", "mu1", "mu2", "phase1", "phase2"),
    *("log_multiplier", "floquet_max", "mode_frequency", "growth_rate", "stable"),
)

#: Ratio of the solution times of a point with and without inertia.
_INERTIAL = 16


class PeriodicSolve(SolveKind):
    """`asperity.periodic_response` at every point."""

    name = "periodic"
    outputs = tuple(OUTPUTS[name] for name in _NAMES)
    # One batch and half a second of the quasi-static solver.
    fewest, most = 960, 19_200
    defaults = (
        *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"),
        *("log_multiplier", "mode_frequency", "stable"),
    )

    def chunk_points(self, points: int, record: Mapping[str, Any]) -> int:
        """As in `SolveKind`."""
        inertial = record["numbers"].get("inertia", 0) or any(
            "inertia" in columns_of(axis) for axis in record["axes"].values()
        )
        usual = super().chunk_points(points, record)
        return min(usual, self.most // _INERTIAL) if inertial else usual

    def solve_law(self, law: type[Law], points: Points, record: Mapping[str, Any]) -> Answers:
        """As in `SolveKind`."""
        return answers_of_law(law, points.of_law(law.name), record["outputs"])
