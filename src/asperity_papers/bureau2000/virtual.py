"""A virtual experiment: the paper's protocol, simulated, recorded with noise and read again.

The measured points of Figs. 2 to 5 are not in the text, and nothing here replaces them. The points
are those that the same protocol measures on a simulated slider with the elasto-plastic law. Their
error bars come from the analysis of recordings that a laboratory uses; the model's lines are drawn
next to them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.resources import files
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

import asperity as asp
from asperity.ledger import (
    FigureNumbers,
    fill,
    formula_value,
    printed_numbers,
    rich,
    table,
)
from asperity_papers.bureau2000.curves import WORDS, FigureCurve, figure_numbers, solve_curves
from asperity_papers.bureau2000.machine import EXT, PAPER, SPEEDS, Float
from asperity_papers.bureau2000.recordings import (
    PRINTED,
    QUANTITIES,
    Series,
    SimulatedPoints,
    all_series,
    description,
    state_coefficient,
)
from asperity_papers.bureau2000.response_figures import AIR, VACUUM, velocity_axis

#: Half a 95 % interval, in standard uncertainties.
NORMAL = 1.96


class Read(NamedTuple):
    """A number read off measured points, its standard uncertainty, and its value in the model.

    Differences and ratios treat the numbers as independent.
    """

    value: float
    uncertainty: float
    model: float

    def __neg__(self) -> Read:
        return Read(-self.value, self.uncertainty, -self.model)

    def __sub__(self, other: Read) -> Read:
        spread = float(np.hypot(self.uncertainty, other.uncertainty))
        return Read(self.value - other.value, spread, self.model - other.model)

    def __truediv__(self, other: Read | float) -> Read:
        if not isinstance(other, Read):
            return Read(*(number / other for number in self))
        value = self.value / other.value
        spread = np.hypot(self.uncertainty / self.value, other.uncertainty / other.value)
        return Read(value, abs(value) * float(spread), self.model / other.model)


@dataclass(frozen=True)
class RecoveredQuantity:
    """A number measured in the simulated recordings, and its value in the simulated machine.

    Attributes
    ----------
    what : str
    value, uncertainty : float
        Standard uncertainty.
    true_value : float
        Value in the model or in the simulated machine, which the readings do not use.
    stated : str
        What the text of the paper says about its own experiment.
    """

    what: str
    value: float
    uncertainty: float
    true_value: float
    stated: str

    @property
    def agrees(self) -> bool:
        """Whether the 95 % interval contains the value in the simulated machine."""
        return bool(abs(self.value - self.true_value) <= NORMAL * self.uncertainty)


@dataclass(frozen=True)
class VirtualFigure:
    """A figure of the virtual experiment.

    Attributes
    ----------
    numbers : FigureNumbers
        The model's lines, and points with the columns ``point_column`` of figures.toml.
    series : tuple of Series
    recovered : tuple of RecoveredQuantity
    """

    numbers: FigureNumbers
    series: tuple[Series, ...]
    recovered: tuple[RecoveredQuantity, ...]

    @property
    def points(self) -> pd.DataFrame:
        """The points of `numbers`."""
        assert self.numbers.points is not None  # a virtual figure has points
        return self.numbers.points


def _of(points: pd.DataFrame, series: str) -> pd.DataFrame:
    return points[points["series"] == series]


def with_model(points: pd.DataFrame, lines: pd.DataFrame) -> pd.DataFrame:
    """Points with the model's values, from the operating points of the lines.

    Raises
    ------
    KeyError
        If a line has no operating point where a point is.
    """
    where = ["V", "frequency", "epsilon_eff"]
    same = np.all(
        [np.isclose(points[[n]].to_numpy(), lines[n], rtol=1e-9, atol=1e-12) for n in where], axis=0
    )
    for row in np.flatnonzero(~same.any(axis=1)):
        V, f, epsilon = points[where].iloc[row]
        raise KeyError(f"no operating point at {V:g} m/s, {f:g} Hz, {epsilon:g}")
    at = lines.iloc[same.argmax(axis=1)]
    at = at.assign(static_friction=at["mean_friction"] - at["delta_mu"])
    model = {f"{name}_model": at[name].to_numpy() for name in QUANTITIES}
    return points.assign(**model)[list(WORDS.point_column)]


def over_amplitude(name: str, names: Sequence[str], readings: SimulatedPoints) -> VirtualFigure:
    """A figure of some series against eps."""
    series = tuple(s for s in all_series() if s.name in names)
    eps = PRINTED.applied_amplitudes()
    curves = [
        FigureCurve(s.name, EXT, s.velocity, eps, abs(s.transfer), s.frequency) for s in series
    ]
    return _figure(name, series, curves, pd.concat([readings[s.name] for s in series]))


def over_velocity(readings: SimulatedPoints) -> VirtualFigure:
    """Mean against V for four amplitudes."""
    at_120_hz = (s for s in all_series() if s.frequency == PRINTED.numbers.frequency)
    series = tuple(sorted(at_120_hz, key=lambda s: s.velocity))
    amplitudes = PRINTED.numbers["epsilon_figure3"].si_values or ()
    V, share = velocity_axis(PRINTED), abs(series[0].transfer)
    curves = [FigureCurve(f"eps = {e:g}", EXT, V, e, share) for e in amplitudes]
    tables = []
    for s in series:
        rows = readings[s.name]
        tables += [_unmodulated(rows), rows[rows["epsilon_set"].isin(amplitudes)]]
    return _figure("virtual-03", series, curves, pd.concat(tables, ignore_index=True))


def _figure(
    name: str, series: tuple[Series, ...], curves: Sequence[FigureCurve], points: pd.DataFrame
) -> VirtualFigure:
    """A figure of points, with the model's lines and the numbers of its formulas."""
    overrides = {"B": state_coefficient()}
    lines = solve_curves(PRINTED, (replace(curve, overrides=overrides) for curve in curves))
    points = with_model(points, lines)
    terms, printed = _terms(series, points), printed_numbers(PRINTED.numbers)
    recovered = []
    for formula, what, stated in recovered_words()[name]:
        value, uncertainty, true_value = (
            formula_value(f"{part}({formula})", printed, f"recovered.{name}", PRINTED.terms | terms)
            for part in Read._fields
        )
        recovered.append(RecoveredQuantity(what, value, uncertainty, true_value, stated))
    scalars = {
        f"{quantity.what}, {part}": getattr(quantity, part)
        for quantity in recovered
        for part in ("value", "uncertainty", "true_value")
    }
    numbers = figure_numbers(PRINTED, name, lines, scalars, points=points, terms=terms)
    return VirtualFigure(numbers, series, tuple(recovered))


def _terms(series: tuple[Series, ...], points: pd.DataFrame) -> dict[str, Any]:
    """Names of numbers that are read off the points, for formulas."""
    shares = {s.name: abs(s.transfer) for s in series}

    def read(name: str, column: str, row: float = -1) -> Read:
        """A quantity of a series, by default at its largest amplitude."""
        at = _of(points, name).iloc[int(row)]
        return Read(*(float(at[f"{column}{part}"]) for part in ("", "_uncertainty", "_model")))

    def factor() -> Read:
        return Read(*collapse(_of(points, VACUUM), _of(points, AIR)), shares[AIR] / shares[VACUUM])

    return {
        **{name: name for name in QUANTITIES},
        "read": read,
        "slope_of": lambda epsilon: _slope(points[points["epsilon_set"] == epsilon]),
        "factor": factor,
        "share_of": shares.get,
        **{part: attrgetter(part) for part in Read._fields},
        "bar": lambda number: NORMAL * number.uncertainty,
    }


@cache
def recovered_words() -> dict[str, list[tuple[str, str, str]]]:
    """Formula and words of each recovered number, and the paper's statement, by figure."""
    file = files(__package__).joinpath("recovered.toml")
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _unmodulated(rows: pd.DataFrame) -> pd.DataFrame:
    """A point at eps = 0: mean and scatter of all F(0) of a series."""
    F0 = rows["static_friction"]
    stated, scatter = float(np.sqrt(np.mean(rows["static_friction_stated"] ** 2))), F0.std()
    point = dict.fromkeys(rows.columns, np.nan)
    point |= {name: rows[name].iloc[0] for name in ("series", "V", "frequency", "seeds")}
    point |= dict.fromkeys(("epsilon_set", "epsilon", "epsilon_eff"), 0.0)
    for name in ("mean_friction", "static_friction"):
        point |= {name: F0.mean(), f"{name}_stated": stated, f"{name}_scatter": scatter}
        point[f"{name}_uncertainty"] = max(stated, scatter)
    return pd.DataFrame([point])


def _slope(rows: pd.DataFrame) -> Read:
    """Slope of the readings over ln V, its uncertainty, and the slope of the model.

    All velocities have the same weight, so that both slopes are the same function of the points.
    """
    x = np.log(rows["V"].to_numpy())
    share = (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    value, sigma, model = (
        rows[f"mean_friction{name}"].to_numpy() for name in ("", "_uncertainty", "_model")
    )
    return Read(float(share @ value), float(np.sqrt(share**2 @ sigma**2)), float(share @ model))


def collapse(vacuum: pd.DataFrame, air: pd.DataFrame) -> tuple[float, float]:
    """The factor on eps that brings the drops in air onto those in vacuum.

    Parameters
    ----------
    vacuum, air : DataFrame
        Points.

    Returns
    -------
    (float, float)
        The factor and its standard uncertainty.

    Notes
    -----
    Both series are fitted by one curve, a (sqrt(1 + (b u)^2) - 1) + c u^2 with u = eps in vacuum
    and u = factor eps in air. On the periodic orbits themselves it gives the factor to 1e-4.
    """
    from scipy.optimize import curve_fit

    scaled = np.repeat([False, True], [len(vacuum), len(air)])

    def drop(epsilon: Float, factor: float, a: float, b: float, c: float) -> Float:
        u = np.where(scaled, factor * epsilon, epsilon)
        return a * (np.sqrt(1 + (b * u) ** 2) - 1) + c * u**2

    epsilon, value, sigma = (
        np.concatenate([rows[name].to_numpy() for rows in (vacuum, air)])
        for name in ("epsilon", "delta_mu", "delta_mu_uncertainty")
    )
    start = (0.5, -0.05, 10.0, 0.0)
    best, covariance = curve_fit(drop, epsilon, value, start, sigma=sigma, absolute_sigma=True)
    return float(best[0]), float(np.sqrt(covariance[0, 0]))


#: The functions that make the figures from the points, in the order of the paper.
VIRTUAL: tuple[Callable[[SimulatedPoints], VirtualFigure], ...] = (
    partial(over_amplitude, "virtual-02", SPEEDS),
    over_velocity,
    partial(over_amplitude, "virtual-04", SPEEDS),
    partial(over_amplitude, "virtual-05", (VACUUM, AIR)),
)


# --- The experiment on the page, and the heads of its tables --------------------------------------


def introduction(figures: Sequence[VirtualFigure]) -> str:
    """Text before the figures: the parts of the experiment that are simulated."""
    # Figures share series, and the points of eps = 0 have no window.
    points = pd.concat([f.points.dropna(subset="window") for f in figures])
    readings = points.drop_duplicates(["series", "epsilon_set"])
    within = np.concatenate([_within(f) for f in figures])
    numbers = {
        "runs": len(figures[0].series[0].seeds),
        "normal": NORMAL,
        "within": within.sum(),
        "bars": within.size,
        "shortest": readings["window"].min(),
        "longest": readings["window"].max(),
        "clear": int((readings["verdict"] == "ok").sum()),
        "readings": len(readings),
        "machine": "; ".join(description(figures[0].series[0].frequency)),
        "resonance": PRINTED.contact_resonance,
    }
    texts = (fill(t, numbers, "section.experiment") for t in WORDS.section["experiment"].before)
    page = "".join(f"<p>{rich(text)}</p>" for text in texts)
    return page.replace("&lt;b&gt;", "<b>").replace("&lt;/b&gt;", "</b>")


def _within(figure: VirtualFigure) -> np.ndarray:
    """Whether each drawn 95 % interval contains the model."""
    points, names = figure.points, WORDS.figures[figure.numbers.name].observables
    return np.concatenate(
        [
            abs(points[name] - points[f"{name}_model"]) <= NORMAL * points[f"{name}_uncertainty"]
            for name in names
        ]
    )


def recovered_table(figures: Sequence[VirtualFigure]) -> str:
    """The readings, the values in the simulated machine, and the statements of the paper."""
    heads = {
        "Read off simulated recordings": "statement", "Reading, ± 95 %": "computed",
        "The machine has": "stated", "The text has": "stated",
    }  # fmt: skip
    rows = [_cells(quantity) for figure in figures for quantity in figure.recovered]
    return table(heads, rows, "Read off the simulated recordings")


def _cells(quantity: RecoveredQuantity) -> tuple[str, ...]:
    half = NORMAL * quantity.uncertainty
    digits = max(0, 1 - int(np.floor(np.log10(half))))
    reading = f"{quantity.value:.{digits}f} ± {half:.{digits}f}"
    if not quantity.agrees:
        reading += " (does not hold what the machine has)"
    texts = (quantity.what, reading, f"{quantity.true_value:.{digits}f}", quantity.stated)
    return tuple(map(rich, texts))


def provenance(figure: VirtualFigure, what: str) -> list[str]:
    """First lines of a CSV file: its content (`what`: points or lines), and how it was made."""
    runs = [
        f"  {s.name}, {s.frequency:g} Hz: seeds {', '.join(map(str, s.seeds))}; eps_eff/eps "
        f"{abs(s.transfer):.6g}; sliding {s.sliding:.4g} s, modulated {s.modulated:.4g} s"
        for s in figure.series
    ]
    place = WORDS.figures[figure.numbers.name].place
    return [
        f"SIMULATED, {what} of {place}: a virtual experiment; no measured points",
        "after the protocol of Bureau, Baumberger and Caroli, Phys. Rev. E 62, 6810 (2000)",
        f"computed by asperity {asp.__version__}",
        *description(figure.series[0].frequency),
        "runs (seed: noise of the sensors, drift of the gauge; the motion is the same):",
        *runs,
        "parameters, where nothing above says otherwise (kind in brackets):",
        *PAPER.parameter_lines(),
        "read off the points:",
        *(f"  {name} = {value:.12g}" for name, value in figure.numbers.scalars.items()),
    ]
