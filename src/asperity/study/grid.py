"""The grid of a sweep: which operating points a chunk has, by the number of the chunk."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from asperity.laws import get_law
from asperity.parameters import Parameter, all_parameters, point_parameters
from asperity.parameters.arguments import shown
from asperity.questions.sweep import PlanError, Sweep
from asperity.study.axes import Column, SweepAxis
from asperity.study.plan import plan_record
from asperity.study.points import RATIOS, Points
from asperity.study.solve import SOLVES

Slices = tuple[slice, ...]

#: Up to this length an axis of laws is not divided: each worker then compiles every law once, and
#: chunks take equal times. A longer one would leave a chunk too few points of each law.
_LAWS_APART = 64

#: Largest number of points, a 64-bit integer.
_MOST_POINTS = 2**63 - 1


class SweepGrid:
    """The points of a sweep; only the points of the requested chunks are in memory.

    Parameters
    ----------
    record : mapping
        From `asperity.study.plan.plan_record`.
    chunks : tuple of int, optional
        Chunk length along each axis; chosen from the record by default.

    Attributes
    ----------
    axes : tuple of SweepAxis
    shape : tuple of int
    chunks : tuple of int
    """

    def __init__(self, record: Mapping[str, Any], chunks: Sequence[int] | None = None) -> None:
        self.record = dict(record)
        self.axes = tuple(SweepAxis(name, axis) for name, axis in record["axes"].items())
        self.shape = tuple(axis.length for axis in self.axes)
        self.chunks = tuple(chunks) if chunks is not None else self._chunks()

    @classmethod
    def of(cls, plan: Sweep) -> SweepGrid:
        """The grid of a plan.

        Raises
        ------
        PlanError
            If the plan has mistakes, or more points than a 64-bit integer counts.
        InputError
            If memory cannot hold the points of a chunk.
        """
        grid = cls(plan_record(plan))
        if grid.points > _MOST_POINTS:
            raise PlanError(
                [
                    f"axes must give at most {_MOST_POINTS:.3g} points, got "
                    f"{' x '.join(map(shown, grid.shape))}; shorten them"
                ]
            )
        SOLVES[plan.solve].require_memory(math.prod(grid.chunks), grid.record)
        return grid

    @property
    def points(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    @property
    def bytes(self) -> float:
        """Size of all answers in a store, uncompressed."""
        return self.points * (8.0 * (len(self.record["outputs"]) + 1) + 2)

    @property
    def chunk_shape(self) -> tuple[int, ...]:
        """Number of chunks along each axis."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunks, strict=True))

    @property
    def chunk_count(self) -> int:
        """Number of chunks."""
        return math.prod(self.chunk_shape)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the record."""
        return hashlib.sha256(json.dumps(self.record, sort_keys=True).encode()).hexdigest()

    @cached_property
    def known(self) -> dict[str, Parameter]:
        """Parameters of all laws of the sweep, and ratios."""
        laws = [get_law(name) for name in self.record["laws"]]
        of_solve = SOLVES[self.record["solve"]].parameters()
        return {**all_parameters(laws), **of_solve, **{n: r.parameter for n, r in RATIOS.items()}}

    def place(self, chunk: int) -> tuple[int, ...]:
        """Position of a chunk among the chunks, by its number in C order."""
        return tuple(int(i) for i in np.unravel_index(chunk, self.chunk_shape))

    def slices(self, chunk: int) -> Slices:
        """The part of the grid that a chunk covers."""
        return tuple(
            slice(i * c, min((i + 1) * c, n))
            for i, c, n in zip(self.place(chunk), self.chunks, self.shape, strict=True)
        )

    def size(self, chunk: int) -> int:
        """Points of a chunk."""
        return math.prod(s.stop - s.start for s in self.slices(chunk))

    def at(self, chunk: int) -> Points:
        """The points of a chunk in C order."""
        return self.between(self.slices(chunk))

    def between(self, slices: Slices) -> Points:
        """The points of a part of the grid in C order."""
        shape = tuple(s.stop - s.start for s in slices)
        count = math.prod(shape)
        columns: dict[str, Column] = {
            n: np.full(count, float(v)) for n, v in self.record["numbers"].items()
        }
        columns["law"] = np.full(count, self.record["laws"][0], dtype=object)
        for i, (axis, part) in enumerate(zip(self.axes, slices, strict=True)):
            for name, column in axis.rows(part.start, part.stop).items():
                along = column.reshape([-1 if k == i else 1 for k in range(len(shape))])
                columns[name] = np.array(np.broadcast_to(along, shape)).ravel()
        of_law = {law: point_parameters(get_law(law)) for law in self.record["laws"]}
        for name, ratio in RATIOS.items():
            if name in columns:
                none = np.full(count, np.nan)
                needed = {n: columns.get(n, none) for n in (name, *ratio.needs)}
                for n in ratio.counts:
                    has = [n in of_law[law] for law in columns["law"]]
                    needed[n] = np.where(has, columns.get(n, none), np.nan)
                with np.errstate(all="ignore"):
                    columns[ratio.target] = ratio.solve(needed)
        return Points(columns.pop("law"), data=columns.pop("data", None), values=columns)

    def _chunks(self) -> tuple[int, ...]:
        """Chunk lengths: laws apart, then as many points of the last axes as belong together."""
        wanted = self.record.get("chunk") or SOLVES[self.record["solve"]].chunk_points(
            self.points, self.record
        )
        lengths = []
        for axis in reversed(self.axes):
            apart = "law" in axis.names and axis.length <= _LAWS_APART
            # Chunks of one length, so that the last one is not much shorter.
            parts = axis.length if apart else -(-axis.length // max(wanted, 1))
            length = -(-axis.length // parts)
            wanted = wanted // length
            lengths.append(length)
        return tuple(reversed(lengths))
