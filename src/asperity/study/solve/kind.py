"""What every kind of solve has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from asperity.errors import InputError
from asperity.outputs import require_memory
from asperity.parameters import Output, Parameter
from asperity.parameters.arguments import one_of
from asperity.study.outcome import Answers
from asperity.study.plan import SweepPlan
from asperity.study.points import POINT_BYTES, Points


class SolveKind(ABC):
    """A kind of solve: its outputs, and how the points of a chunk are solved.

    Class attributes
    ----------------
    name : str
        What plans call it.
    outputs : tuple of Output
        What it can keep of a point.
    defaults : tuple of str
        Names of the outputs that are kept where the plan names none.
    supplies : tuple of str
        Parameters that a point need not have.
    """

    name: ClassVar[str]
    outputs: ClassVar[tuple[Output, ...]]
    defaults: ClassVar[tuple[str, ...]]
    supplies: ClassVar[tuple[str, ...]] = ()

    def parameters(self) -> dict[str, Parameter]:
        """Numbers that a point of this kind may have besides those of its law, by name."""
        return {}

    def supplied(self, plan: SweepPlan) -> tuple[str, ...]:
        """Parameters that a point of this plan need not have."""
        return self.supplies

    def known_outputs(self, record: Mapping[str, Any]) -> dict[str, Output]:
        """Outputs by name, of a plan with this record."""
        return {output.name: output for output in self.outputs}

    def chosen_outputs(self, plan: SweepPlan) -> tuple[str, ...]:
        """Names of what the plan keeps.

        Raises
        ------
        InputError
            If it names something else.
        """
        if plan.outputs is None:
            return self.defaults
        known = [output.name for output in self.outputs]
        return tuple(dict.fromkeys(one_of(o, known, "outputs") for o in plan.outputs))

    def settings(self, plan: SweepPlan) -> dict[str, Any]:
        """What a plan says of this kind of solve, as JSON values."""
        for other in ("transient", "fit"):
            if other != self.name and getattr(plan, other) is not None:
                raise InputError(
                    f"{other} must be left out where solve is '{self.name}', got a table; "
                    f"write solve = '{other}' or remove it"
                )
        return {}

    def require_memory(self, points: int, record: Mapping[str, Any]) -> None:
        """Refuse chunks of so many points where memory cannot hold them while they are solved."""
        require_memory(
            points * POINT_BYTES,
            "chunk",
            f"{points:,} points at a time",
            "lower it or leave it out",
        )

    @abstractmethod
    def chunk_points(self, points: int, record: Mapping[str, Any]) -> int:
        """About how many of all points a chunk has: some seconds of work at most."""

    @abstractmethod
    def solve(self, points: Points, record: Mapping[str, Any]) -> Answers:
        """An outcome for every point of a chunk.

        It depends on the points of the chunk alone, so that neither the number of workers nor an
        interruption changes a bit.
        """
