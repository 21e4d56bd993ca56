"""Measured or digitised points on the curves of a paper's figures, and a test of agreement.

The rule, stated before any point is seen: for the points of one figure and observable, and again
for all points of one law, chi^2 = sum ((y - curve(x))/y_err)^2 has as many degrees of freedom as
there are points, since nothing is fitted to them here.

=============  =====================================================================================
verdict        rule
=============  =====================================================================================
agrees         chi^2 is not larger than the 95 % quantile, and the test has power: for a curve that
               is 20 % off chi^2 exceeds that quantile in 95 % of all cases or more
disagrees      chi^2 is larger than the 95 % quantile
undecided      chi^2 is not larger, but the errors are so wide that a curve 20 % off would pass too
=============  =====================================================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import pandas as pd

from asperity.errors import InputError, require
from asperity.ledger.figures import Observables, PaperFigure
from asperity.ledger.recipe import read_columns
from asperity.outputs.json import to_json
from asperity.parameters.arguments import one_of
from asperity.parameters.parameter import count_text
from asperity.units import to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Significance level: the probability that a test rejects a true curve.
LEVEL = 0.05
#: A test must reject a curve that is wrong by this share with the probability 1 - LEVEL.
WRONG_BY = 0.2

#: The rule as a sentence, for the page and the files.
RULE = (
    f"agrees: chi^2 = sum ((y - curve)/y_err)^2 is not larger than its {100 * (1 - LEVEL):g} % "
    "quantile for as many degrees of freedom as points, nothing being fitted to them here, while "
    f"a curve {100 * WRONG_BY:g} % off would exceed it in {100 * (1 - LEVEL):g} % of all cases; "
    "undecided: the errors are too wide for that; disagrees: chi^2 is larger"
)

#: Columns of a file of points.
TEXTS, NUMBERS = ("figure", "observable", "series", "x", "source"), ("y", "y_err")
Agreement: TypeAlias = Literal["agrees", "disagrees", "undecided"]

_MARKERS = ("o", "s", "^", "D", "v")


@dataclass(frozen=True)
class CurveComparison:
    """Points of one figure and observable, or of one law, against the curves.

    Attributes
    ----------
    figure, observable : str
        Empty for all points of a law together.
    law : str
    points : int
    chi_squared : float
    p_value : float
        Probability of a chi^2 as large as this or larger if the curves are true.
    power : float
        Power: the probability that a curve 20 % off is rejected.
    verdict : {"agrees", "disagrees", "undecided"}
    """

    figure: str
    observable: str
    law: str
    points: int
    chi_squared: float
    p_value: float
    power: float
    verdict: Agreement

    @property
    def text(self) -> str:
        """The comparison as a line of text."""
        where = f"{self.figure} {self.observable}, " if self.figure else "all points, "
        return (
            f"{where}{self.law}: {self.verdict}, chi^2 = {self.chi_squared:.4g} for "
            f"{self.points}, p = {self.p_value:.2g}"
        )


def read_points(path: Path) -> pd.DataFrame:
    """A CSV with the columns `TEXTS` and `NUMBERS`; lines that begin with ``#`` are skipped.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, or a cell breaks its rule; the sentence
        names the row.
    """
    kinds = dict.fromkeys(NUMBERS, "dimensionless")
    points = pd.DataFrame(read_columns(path, kinds, "a point", texts=TEXTS, label="data"))
    points.index += 1
    for row, point in points.iterrows():
        where = f"{path.name}, row {row}"
        if not point["y_err"] > 0:
            what = f"{point['y_err']:g}"
            raise InputError(f"{where}: y_err", "be positive", what, "give the standard error of y")
        rule = "say where the point comes from"
        advice = "name the table, the recording or the figure that was digitised"
        require(point["source"], f"{where}: source", rule, "nothing", advice)
    return points


def check_names(points: pd.DataFrame, observables: Mapping[str, Observables], name: str) -> None:
    """Refuse points of figures or observables that the paper's report does not have.

    Raises
    ------
    InputError
    """
    for row, point in points.iterrows():
        where = f"{name}, row {row}"
        figure = one_of(point["figure"], observables, f"{where}: figure")
        one_of(point["observable"], observables[figure], f"{where}: observable")


def with_curves(
    points: pd.DataFrame,
    table: pd.DataFrame,
    observables: Observables,
    name: str,
) -> pd.DataFrame:
    """The points of one figure with the value of the curve at each.

    Parameters
    ----------
    points : DataFrame
        From `read_points`, of that figure.
    table : DataFrame
        The figure's curves, with the columns ``curve`` and ``law``.
    observables : Observables
        Observables of that figure.
    name : str
        Name of the file, for messages.

    Returns
    -------
    DataFrame
        Columns of `POINT_COLUMNS`.

    Raises
    ------
    InputError
        If the curve does not exist, or x lies outside of it.
    """
    from scipy.interpolate import CubicSpline

    rows = []
    for number, point in points.iterrows():
        where = f"{name}, row {number}"
        _, panel = observables[point["observable"]]
        series = one_of(point["series"], map(str, table["curve"].unique()), f"{where}: series")
        curve = table[table["curve"] == series]
        x = to_si(str(point["x"]), panel.x_kind, f"{where}: x")
        at = curve[panel.x].to_numpy(float)
        if not at.min() <= x <= at.max():
            rule = f"lie on the curve, from {at.min():g} to {at.max():g} (SI)"
            raise InputError(f"{where}: x", rule, f"{x:g}", "leave the point out")
        model = float(CubicSpline(at, curve[panel.y].to_numpy(float))(x))
        residual = (point["y"] - model) / point["y_err"]
        law = str(curve["law"].iloc[0])
        rows.append({**point, "x": x, "law": law, "model": model, "residual": residual})
    return pd.DataFrame(rows, columns=list(POINT_COLUMNS))


#: Columns of the table of points, with unit and meaning.
POINT_COLUMNS = {
    "figure": "figure that the point is drawn on",
    "observable": "quantity",
    "series": "curve that the point is compared with",
    "law": "friction law of that curve",
    "x": "SI; abscissa",
    "y": "SI; as measured",
    "y_err": "SI; standard uncertainty",
    "model": "SI; the curve at x",
    "residual": "1; (y - model)/y_err",
    "source": "where the point comes from",
}


def comparisons(rows: pd.DataFrame) -> list[CurveComparison]:
    """Judge the points of each figure, observable and law, then all points of each law.

    Parameters
    ----------
    rows : DataFrame
        From `with_curves`, of all figures together.
    """
    single = [
        _judge(group, *(str(key) for key in keys))
        for keys, group in rows.groupby(["figure", "observable", "law"], sort=False)
    ]
    together = [_judge(group, "", "", str(law)) for law, group in rows.groupby("law", sort=False)]
    return [*single, *together]


def _judge(rows: pd.DataFrame, figure: str, observable: str, law: str) -> CurveComparison:
    from scipy.stats import chi2, ncx2

    n = len(rows)
    value = float((rows["residual"] ** 2).sum())
    p = float(chi2.sf(value, n))
    quantile = float(chi2.isf(LEVEL, n))
    shift = float(((WRONG_BY * rows["model"] / rows["y_err"]) ** 2).sum())
    power = float(ncx2.sf(quantile, n, shift)) if shift > 0 else LEVEL
    verdict: Agreement = "disagrees"
    if value <= quantile:
        verdict = "agrees" if power >= 1 - LEVEL else "undecided"
    return CurveComparison(figure, observable, law, n, value, p, power, verdict)


def draw_points(figure: Figure, rows: pd.DataFrame, observables: Observables) -> None:
    """Draw points with their standard uncertainties over the curves, and name them in a legend.

    Parameters
    ----------
    figure : matplotlib Figure
    rows : DataFrame
        From `with_curves`, of this figure.
    observables : Observables
    """
    from asperity.figures.style import COLOURS

    handles: dict[str, Any] = {}
    markers = dict(zip(rows["series"].unique(), _MARKERS * len(rows), strict=False))
    for column, (place, panel) in observables.items():
        axis = figure.axes[place]
        for series, points in rows[rows["observable"] == column].groupby("series"):
            handles[str(series)] = axis.errorbar(
                panel.x_scale * points["x"],
                panel.y_scale * points["y"],
                yerr=panel.y_scale * points["y_err"],
                linestyle="none", marker=markers[series], markersize=5, color=COLOURS["points"],
                markerfacecolor="white", capsize=2.5, elinewidth=1.0, zorder=6,
            )  # fmt: skip
    sources = ", ".join([*map(str, rows["source"].unique()[:2]), "…"][: rows["source"].nunique()])
    figure.legend(
        handles=list(handles.values()),
        labels=[name.replace(" um", " µm") for name in handles],
        title=f"points from: {sources}",
        loc="outside lower center",
        ncols=2,
    )


@dataclass
class MeasuredPoints:
    """The points of a file; without a file there are no points, and nothing is drawn or written.

    Attributes
    ----------
    name : str
        Name of the file, for messages.
    points : DataFrame, optional
        From `read_points`.
    compared : list of DataFrame
        One for each figure that has been given its points.
    """

    name: str = ""
    points: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=[*TEXTS, *NUMBERS]))
    compared: list[pd.DataFrame] = field(default_factory=list)

    @classmethod
    def read(cls, path: Path) -> MeasuredPoints:
        """Read a file; see `read_points`."""
        return cls(path.name, read_points(path))

    def add(self, figure: PaperFigure, observables: Mapping[str, Observables]) -> PaperFigure:
        """The figure with its points drawn; the points are compared with its curves."""
        points = self.points[self.points["figure"] == figure.name]
        if points.empty:
            return figure
        shown = observables[figure.name]
        rows = with_curves(points, figure.tables[0].data, shown, self.name)
        self.compared.append(rows)

        def draw() -> Figure:
            drawn = figure.draw()
            draw_points(drawn, rows, shown)
            return drawn

        count = count_text(len(rows), "point")
        added = f"Red: {count} of {self.name}, with standard uncertainties."
        return replace(figure, draw=draw, caption=f"{figure.caption} {added}")

    def write(self, folder: Path) -> list[CurveComparison]:
        """Write data/points.csv and agreement.json, and return the comparisons."""
        from asperity.figures.style import save_table

        if not self.compared:
            return []
        rows = pd.concat(self.compared, ignore_index=True)
        head = [f"points of {self.name} and the curves of the figures", RULE]
        save_table(rows, folder / "data" / "points.csv", header=head, columns=POINT_COLUMNS)
        compared = comparisons(rows)
        record = {"rule": RULE, "file": self.name, "comparisons": [asdict(one) for one in compared]}
        text = to_json(record, indent=2)
        (folder / "agreement.json").write_text(text + "\n", encoding="utf-8", newline="\n")
        return compared
