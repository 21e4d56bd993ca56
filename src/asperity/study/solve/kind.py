"""The interface of a kind of solve, and periodic responses, the kind by default."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from asperity.laws import Law, get_law
from asperity.outputs import require_memory
from asperity.parameters import OUTPUTS, Output, Parameter
from asperity.questions.sweep import Sweep
from asperity.study.axes import columns_of
from asperity.study.points import POINT_BYTES, Answers, Points
from asperity.study.responses import answers_of_law

#: Number of chunks of a small plan, so that several workers share it.
_SHARES = 8


class SolveKind(ABC):
    """A kind of solve: its outputs, and how the points of a chunk are solved.

    Class attributes
    ----------------
    name : str
        Name in plans.
    outputs : tuple of Output
        Numbers that a store can keep of a point.
    defaults : tuple of str, optional
        Names of the outputs that are kept if the plan names none; all by default.
    supplies : tuple of str
        Parameters of the law that a point need not have.
    fewest, most : int
        Smallest and largest number of points of a chunk: at most some seconds of work.
    """

    name: ClassVar[str]
    outputs: ClassVar[tuple[Output, ...]] = ()
    defaults: ClassVar[tuple[str, ...] | None] = None
    supplies: ClassVar[tuple[str, ...]] = ()
    fewest: ClassVar[int] = 1
    most: ClassVar[int] = 64

    def parameters(self) -> dict[str, Parameter]:
        """Numbers that a point may have in addition to the parameters of its law, by name."""
        return {}

    def supplied(self, plan: Sweep) -> tuple[str, ...]:
        """Parameters of the law that a point of this plan need not have."""
        return self.supplies

    def known_outputs(self, laws: Sequence[str], settings: Mapping[str, Any]) -> dict[str, Output]:
        """Outputs of a plan with these laws and `settings`, by name."""
        return {output.name: output for output in self.outputs}

    def settings(self, plan: Sweep) -> dict[str, Any]:
        """Settings of this kind of solve in a plan, as JSON values."""
        return {}

    def require_memory(self, points: int, record: Mapping[str, Any]) -> None:
        """Refuse chunks whose points do not fit in memory while they are solved."""
        what, advice = f"{points:,} points at a time", "lower it or leave it out"
        require_memory(points * POINT_BYTES, "chunk", what, advice)

    def chunk_points(self, points: int, record: Mapping[str, Any]) -> int:
        """Approximate number of points of a chunk."""
        return max(self.fewest, min(self.most, points // _SHARES))

    def solve(self, points: Points, record: Mapping[str, Any]) -> Answers:
        """Answers at the points of a chunk.

        They depend on the points of the chunk only, so that neither the number of workers nor an
        interruption changes a bit.
        """
        answers = Answers.empty(record["outputs"], len(points))
        for law, rows in points.by_law():
            answers.put(rows, self.solve_law(get_law(law), points.take(rows), record))
        return answers

    @abstractmethod
    def solve_law(self, law: type[Law], points: Points, record: Mapping[str, Any]) -> Answers:
        """Answers at points with one law."""


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
