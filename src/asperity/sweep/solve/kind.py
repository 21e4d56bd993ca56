"""What every kind of solve has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.outputs import require_memory
from asperity.parameters import Output, Parameter
from asperity.parameters.arguments import some_of
from asperity.sweep.plan.model import SweepPlan
from asperity.sweep.plan.points import POINT_BYTES, Points
from asperity.sweep.solve.outcome import SweepOutcome

Float = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass
class Findings:
    """What was found at some points.

    Attributes
    ----------
    numbers : dict of str to array, shape (points,)
        Outputs by name; NaN where a point failed.
    outcome : int16 array, shape (points,)
        A `SweepOutcome`.
    detail : array, shape (points,)
        The number in the sentence of the outcome; 0 where there is none.
    """

    numbers: dict[str, Float]
    outcome: NDArray[np.int16]
    detail: Float

    @classmethod
    def empty(cls, names: Sequence[str], count: int) -> Findings:
        """Room for `count` points, none of them computed."""
        return cls(
            {name: np.full(count, np.nan) for name in names},
            np.full(count, SweepOutcome.NOT_COMPUTED, dtype=np.int16),
            np.zeros(count),
        )

    def __len__(self) -> int:
        return len(self.outcome)

    def put(self, index: Index, others: Findings) -> None:
        """Take over `others` at the places `index`."""
        for name, values in others.numbers.items():
            self.numbers[name][index] = values
        self.outcome[index], self.detail[index] = others.outcome, others.detail

    def fail(self, index: Index, outcome: int, detail: float = 0.0) -> None:
        """Give the points `index` an outcome without numbers."""
        for values in self.numbers.values():
            values[index] = np.nan
        self.outcome[index], self.detail[index] = outcome, detail

    @property
    def failed(self) -> int:
        """Points without an answer."""
        return int(np.count_nonzero(self.outcome != SweepOutcome.CONVERGED))

    @property
    def left(self) -> Index:
        """Points that are not computed yet."""
        return np.flatnonzero(self.outcome == SweepOutcome.NOT_COMPUTED)


class SolveKind(ABC):
    """A kind of solve: its outputs, and how the points of a chunk are solved.

    A chunk is solved in two stages. The first solves all points for which a fast method suffices,
    at once. The points that it leaves are cut into batches of `batch` points, in the order of the
    chunk, which are solved one by one, perhaps by other workers. Both depend on the points of the
    chunk alone, so that neither the number of workers nor an interruption changes a bit.

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
    batch : int
        Points of the second stage that are solved together.
    """

    name: ClassVar[str]
    outputs: ClassVar[tuple[Output, ...]]
    defaults: ClassVar[tuple[str, ...]]
    supplies: ClassVar[tuple[str, ...]] = ()
    batch: ClassVar[int] = 64

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
        return tuple(dict.fromkeys(some_of(plan.outputs, known, "outputs")))

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
        """About how many of all points a chunk has: a fraction of a second of the first stage."""

    @abstractmethod
    def first(self, points: Points, record: Mapping[str, Any]) -> Findings:
        """The first stage: what it leaves is NOT_COMPUTED."""

    @abstractmethod
    def second(self, points: Points, record: Mapping[str, Any]) -> Findings:
        """The second stage, for one batch: an outcome for every point."""

    def batches(self, points: Points, left: Index) -> list[Index]:
        """The points that the first stage left, in batches of one law each."""
        found = []
        for law in dict.fromkeys(points.laws[left]):
            own = left[points.laws[left] == law]
            found += [own[i : i + self.batch] for i in range(0, len(own), self.batch)]
        return found


def laws_of(points: Points) -> Iterator[tuple[str, Index]]:
    """The laws of some points, each with its points."""
    for law in dict.fromkeys(points.laws):
        yield str(law), np.flatnonzero(points.laws == law)
