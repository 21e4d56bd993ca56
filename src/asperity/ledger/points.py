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

import csv
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import pandas as pd

from asperity.errors import InputError, closest
from asperity.ledger.figures import Observable, PaperFigure
from asperity.units import to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Significance level: the probability that a test rejects a true curve.
LEVEL = 0.05
#: A test must reject a curve that is wrong by this share with the probability 1 - LEVEL.
WRONG_BY = 0.2

#: The same in a sentence, for what is written.
RULE = (
    f"agrees: chi^2 = sum ((y - curve)/y_err)^2 is not larger than its {100 * (1 - LEVEL):g} % "
    "quantile for as many degrees of freedom as points, nothing being fitted to them here, while "
    f"a curve {100 * WRONG_BY:g} % off would exceed it in {100 * (1 - LEVEL):g} % of all cases; "
    "undecided: the errors are too wide for that; disagrees: chi^2 is larger"
)

COLUMNS = ("figure", "observable", "series", "x", "y", "y_err", "source")
Agreement: TypeAlias = Literal["agrees", "disagrees", "undecided"]

_MARKERS = ("o", "s", "^", "D", "v")
_COLOUR = "#B3261E"


@dataclass(frozen=True)
class MeasuredPoint:
    """A row of a file of points, in SI."""

    line: int
    figure: str
    observable: str
    series: str
    x: str
    y: float
    y_err: float
    source: str


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

    def as_dict(self) -> dict[str, Any]:
        """Fields by name, for JSON."""
        return asdict(self)


def read_points(path: Path) -> list[MeasuredPoint]:
    """Read a CSV with the columns of `COLUMNS`; lines that begin with ``#`` are skipped.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing or unknown, or a cell breaks its rule; the
        sentence names the line.
    """
    name = Path(path).name
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "not UTF-8 text"
        raise InputError(
            f"--data must be a CSV that can be read, got '{path}' ({why.lower()}); see "
            "asperity reproduce --help"
        ) from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if _counts(line)]
    if not lines:
        raise InputError(f"{name} must have a heading and a point a line, got nothing; add them")
    heading = [cell.strip() for cell in next(csv.reader([lines[0][1]]))]
    _check_heading(heading, name)
    if len(lines) == 1:
        raise InputError(f"{name} must have a point a line, got the heading alone; add them")
    return [
        _point(
            dict(zip(heading, _cells(text, len(heading), f"{name} line {n}"), strict=True)), n, name
        )
        for n, text in lines[1:]
    ]


def _counts(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _check_heading(heading: Sequence[str], name: str) -> None:
    for column in COLUMNS:
        if heading.count(column) != 1:
            raise InputError(
                f"{name} must have each of the columns {', '.join(COLUMNS)} once, got "
                f"{heading.count(column)} times '{column}'; correct the heading"
            )
    for column in set(heading) - set(COLUMNS):
        raise InputError(
            f"{name} must have the columns {', '.join(COLUMNS)} only, got '{column}' as well; "
            "remove it"
        )


def _cells(line: str, count: int, where: str) -> list[str]:
    cells = [cell.strip() for cell in next(csv.reader([line]))]
    if len(cells) != count:
        raise InputError(
            f"{where} must have {count} cells as the heading has, got {len(cells)}; correct it"
        )
    return cells


def _point(row: Mapping[str, str], line: int, name: str) -> MeasuredPoint:
    where = f"{name} line {line}"
    y, y_err = (_number(row[key], f"{where}: {key}") for key in ("y", "y_err"))
    if y_err <= 0:
        raise InputError(
            f"{where}: y_err must be positive, got {y_err:g}; give the standard uncertainty of y"
        )
    if not row["source"]:
        raise InputError(
            f"{where}: source must say where the point comes from, got nothing; name the table, "
            "the recording or the figure that was digitised"
        )
    return MeasuredPoint(
        line, row["figure"], row["observable"], row["series"], row["x"], y, y_err, row["source"]
    )


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where} must be a finite number, got '{text}'; correct it")
    return value


def check_names(
    points: Sequence[MeasuredPoint], observables: Mapping[str, Sequence[Observable]], name: str
) -> None:
    """Refuse points of figures or observables that the paper's report does not have.

    Raises
    ------
    InputError
    """
    for point in points:
        where = f"{name} line {point.line}"
        if point.figure not in observables:
            raise InputError(
                f"{where}: figure must be a figure with curves, got '{point.figure}'; "
                f"{closest(point.figure, observables)}"
            )
        columns = [one.column for one in observables[point.figure]]
        if point.observable not in columns:
            raise InputError(
                f"{where}: observable must be one of {point.figure}, got '{point.observable}'; "
                f"{closest(point.observable, columns)}"
            )


def with_curves(
    points: Sequence[MeasuredPoint],
    table: pd.DataFrame,
    observables: Sequence[Observable],
    name: str,
) -> pd.DataFrame:
    """The points of one figure with the value of the curve at each.

    Parameters
    ----------
    points : sequence of MeasuredPoint
        Of that figure.
    table : DataFrame
        The figure's curves, with the columns ``curve`` and ``law``.
    observables : sequence of Observable
        Of that figure.
    name : str
        Of the file, for messages.

    Returns
    -------
    DataFrame
        Columns of `POINT_COLUMNS`.

    Raises
    ------
    InputError
        If the curve does not exist, or x lies outside of it.
    """
    by_name = {one.column: one for one in observables}
    rows = [_row(point, table, by_name[point.observable], name) for point in points]
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


def _row(
    point: MeasuredPoint, table: pd.DataFrame, observable: Observable, name: str
) -> dict[str, Any]:
    from scipy.interpolate import CubicSpline

    where = f"{name} line {point.line}"
    curve = table[table["curve"] == point.series]
    if curve.empty:
        known = [str(one) for one in table["curve"].unique()]
        raise InputError(
            f"{where}: series must be a curve of {point.figure}, got '{point.series}'; "
            f"{closest(point.series, known)}"
        )
    x = float(to_si(point.x, observable.kind, f"{where}: x", require_unit=True))
    at = curve[observable.x].to_numpy(float)
    if not at.min() <= x <= at.max():
        raise InputError(
            f"{where}: x must lie on the curve, from {at.min():g} to {at.max():g} (SI), got {x:g}; "
            "leave the point out"
        )
    model = float(CubicSpline(at, curve[observable.column].to_numpy(float))(x))
    return {
        "figure": point.figure,
        "observable": point.observable,
        "series": point.series,
        "law": str(curve["law"].iloc[0]),
        "x": x,
        "y": point.y,
        "y_err": point.y_err,
        "model": model,
        "residual": (point.y - model) / point.y_err,
        "source": point.source,
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


def draw_points(figure: Figure, rows: pd.DataFrame, observables: Sequence[Observable]) -> None:
    """Draw points with their standard uncertainties over the curves, and name them in a legend.

    Parameters
    ----------
    figure : matplotlib Figure
    rows : DataFrame
        From `with_curves`, of this figure.
    observables : sequence of Observable
    """
    handles: dict[str, Any] = {}
    markers = dict(zip(rows["series"].unique(), _MARKERS * len(rows), strict=False))
    for observable in observables:
        axis = figure.axes[observable.panel]
        for series, points in rows[rows["observable"] == observable.column].groupby("series"):
            handles[str(series)] = axis.errorbar(
                observable.x_scale * points["x"],
                observable.y_scale * points["y"],
                yerr=observable.y_scale * points["y_err"],
                linestyle="none", marker=markers[series], markersize=5, color=_COLOUR,
                markerfacecolor="white", capsize=2.5, elinewidth=1.0, zorder=6,
            )  # fmt: skip
    sources = ", ".join(map(str, rows["source"].unique()[:2])) + ", …" * (
        rows["source"].nunique() > 2
    )
    figure.legend(
        handles=list(handles.values()),
        labels=[f"{name.replace(' um', ' µm')}" for name in handles],
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
        points = [point for point in self.points if point.figure == figure.name]
        if not points:
            return figure
        shown = observables[figure.name]
        rows = with_curves(points, figure.tables[0].data, shown, self.name)
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
        """Write data/points.csv and agreement.json, and return the comparisons."""
        from asperity.figures.style import save_table

        if not self.compared:
            return []
        rows = pd.concat(self.compared, ignore_index=True)
        head = [f"points of {self.name} beside the curves of the figures", RULE]
        save_table(rows, folder / "data" / "points.csv", header=head, columns=POINT_COLUMNS)
        compared = comparisons(rows)
        record = {
            "rule": RULE, "file": self.name, "comparisons": [one.as_dict() for one in compared]
        }  # fmt: skip
        text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "agreement.json").write_text(text + "\n", encoding="utf-8", newline="\n")
        return compared
