"""Rows of the benchmark: times and errors."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np

from benchmarks.equations import Answer

_HEADER = "| what | points | cores | us/point | points/s | mean | mu1 | mu2 | multipliers | note |"


@dataclasses.dataclass(frozen=True)
class Row:
    """One measurement; errors are the largest relative ones, NaN if there is no reference."""

    what: str
    points: int
    seconds: float
    cores: int = 1
    mean: float = math.nan
    mu1: float = math.nan
    mu2: float = math.nan
    multipliers: float = math.nan
    note: str = ""

    def with_errors(self, answer: Answer, reference: Answer) -> Row:
        """The row with the errors of `answer`, whose first points are those of `reference`."""
        points = reference.mean.shape[-1]
        errors = {
            name: float(np.max(np.abs(got[..., :points] - true) / np.abs(true)))
            for name, got, true in zip(Answer._fields, answer, reference, strict=True)
        }
        return dataclasses.replace(self, **errors)

    @property
    def microseconds(self) -> float:
        """Time for a point (us), on all cores together."""
        return self.seconds / self.points * 1e6

    def markdown(self) -> str:
        """A line of the table."""
        errors = (self.mean, self.mu1, self.mu2, self.multipliers)
        shown = ["-" if math.isnan(e) else f"{e:.0e}" for e in errors]
        numbers = [f"{self.points:,}", str(self.cores), f"{self.microseconds:,.3g}"]
        rate = f"{self.points / self.seconds:,.0f}"
        return "| " + " | ".join([self.what, *numbers, rate, *shown, self.note]) + " |"


def markdown(rows: list[Row]) -> str:
    """The table."""
    rule = "|" + "---|" * (_HEADER.count("|") - 1)
    return "\n".join([_HEADER, rule, *(row.markdown() for row in rows)])


def write(rows: list[Row], path: Path) -> None:
    """Write the rows as JSON, missing errors as null."""
    records = []
    for row in rows:
        record = dataclasses.asdict(row)
        records.append({k: None if v != v else v for k, v in record.items()})
    path.write_text(json.dumps(records, indent=1) + "\n")
