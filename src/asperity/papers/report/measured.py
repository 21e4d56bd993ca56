"""Measured points on their way through a report: onto the figures, into a table, to a verdict."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from asperity.figures.files import save_table
from asperity.papers.measured_points import (
    POINT_COLUMNS,
    RULE,
    CurveComparison,
    MeasuredPoint,
    Observable,
    check_names,
    comparisons,
    draw_points,
    read_points,
    with_curves,
)
from asperity.papers.sections import PaperFigure


@dataclass
class MeasuredPoints:
    """The points of a file; without a file, none, and nothing is drawn or written.

    Attributes
    ----------
    name : str
        Of the file, for messages.
    points : list of MeasuredPoint
    compared : list of DataFrame
        One for each figure that has been given its points.
    """

    name: str = ""
    points: Sequence[MeasuredPoint] = ()
    compared: list[pd.DataFrame] = field(default_factory=list)

    @classmethod
    def read(cls, path: Path) -> MeasuredPoints:
        """Read a file; see `read_points`."""
        return cls(path.name, read_points(path))

    def check(self, observables: Mapping[str, Sequence[Observable]]) -> None:
        """Refuse points that no figure takes, before anything is computed."""
        check_names(self.points, observables, self.name)

    def add(
        self, figure: PaperFigure, observables: Mapping[str, Sequence[Observable]]
    ) -> PaperFigure:
        """The figure with its points drawn; the points are compared with its curves."""
        own = [point for point in self.points if point.figure == figure.name]
        if not own:
            return figure
        shown = observables[figure.name]
        rows = with_curves(own, figure.tables[0].data, shown, self.name)
        self.compared.append(rows)

        def draw() -> Figure:
            drawn = figure.draw()
            draw_points(drawn, rows, shown)
            return drawn

        count = f"{len(rows)} point" + "s" * (len(rows) > 1)
        return replace(
            figure, draw=draw, caption=f"{figure.caption} Red: {count} of {self.name}, with "
            "standard uncertainties.",
        )  # fmt: skip

    def write(self, folder: Path) -> list[CurveComparison]:
        """Write data/points.csv and agreement.json, and return what they say."""
        if not self.compared:
            return []
        rows = pd.concat(self.compared, ignore_index=True)
        head = [f"points of {self.name} beside the curves of the figures", RULE]
        save_table(rows, folder / "data" / "points.csv", header=head, columns=POINT_COLUMNS)
        found = comparisons(rows)
        record = {"rule": RULE, "file": self.name, "comparisons": [one.as_dict() for one in found]}
        text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "agreement.json").write_text(text + "\n", encoding="utf-8", newline="\n")
        return found
