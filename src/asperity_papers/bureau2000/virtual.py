"""A virtual experiment: the paper's protocol, simulated, recorded with noise and read again.

The measured points of Figs. 2 to 5 are not in the text, and nothing here stands for them: these are
the points that the elasto-plastic law would have made of the same protocol, with error bars from
the same reading that a laboratory's recordings get, next to the model's lines.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TypeAlias

import numpy as np
import pandas as pd

import asperity as asp
from asperity.ledger import FigureNumbers, fill, rich, table
from asperity_papers.bureau2000.curves import WORDS, FigureCurve, figure_numbers, solve_curves
from asperity_papers.bureau2000.machine import EXT, SLOW, SPEEDS, Float
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
#: Value, standard uncertainty, and the model's value.
Read: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class RecoveredQuantity:
    """A number measured in the simulated recordings, and its value in the simulated machine.

    Attributes
    ----------
    what : str
    value, uncertainty : float
        Standard uncertainty.
    true_value : float
        Value of the model, or given to the machine: what the readings know nothing of.
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
        """Whether the 95 % interval holds the value in the simulated machine."""
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


def last_point(points: pd.DataFrame, series: str, name: str) -> Read:
    """Value, uncertainty and model of a quantity at a series' largest amplitude."""
    row = _of(points, series).iloc[-1]
    return float(row[name]), float(row[f"{name}_uncertainty"]), float(row[f"{name}_model"])


def ratio(a: Read, b: Read) -> Read:
    """Value, uncertainty and model of a quotient of two independent quantities."""
    value = a[0] / b[0]
    return value, abs(value) * float(np.hypot(a[1] / a[0], b[1] / b[0])), a[2] / b[2]


def with_model(points: pd.DataFrame, lines: pd.DataFrame) -> pd.DataFrame:
    """Points with the model's values, from the operating points of the lines.

    Raises
    ------
    KeyError
        If a line has no operating point where a point is.
    """
    where = ["V", "frequency", "epsilon_eff"]
    same = np.all(
        [np.isclose(points[[n]].to_numpy(), lines[n], rtol=1e-9, atol=1e-12) for n in where[1:]]
        + [np.isclose(points[["V"]].to_numpy(), lines["V"], rtol=1e-9, atol=0)],
        axis=0,
    )
    for row in np.flatnonzero(~same.any(axis=1)):
        V, f, epsilon = points[where].iloc[row]
        raise KeyError(f"no operating point at {V:g} m/s, {f:g} Hz, {epsilon:g}")
    at = lines.iloc[same.argmax(axis=1)]
    at = at.assign(static_friction=at["mean_friction"] - at["delta_mu"])
    model = {f"{name}_model": at[name].to_numpy() for name in QUANTITIES}
    return points.assign(**model)[list(WORDS.point_column)]


def _over_amplitude(
    readings: SimulatedPoints, series: tuple[Series, ...]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The model's lines of some series, with the machine's parameters, and their points."""
    eps, overrides = PRINTED.applied_amplitudes(), {"B": state_coefficient()}
    lines = solve_curves(
        PRINTED,
        (
            FigureCurve(
                one.name, EXT, one.velocity, eps, abs(one.transfer), one.frequency, overrides
            )
            for one in series
        ),
    )
    return lines, with_model(pd.concat([readings[one.name] for one in series]), lines)


def _figure(
    name: str,
    lines: pd.DataFrame,
    points: pd.DataFrame,
    series: tuple[Series, ...],
    reads: Mapping[str, Read],
    quoted: Mapping[str, float],
    **slopes: float,
) -> VirtualFigure:
    recovered = tuple(
        RecoveredQuantity(what, *reads[key], stated)
        for key, (what, stated) in recovered_words()[name].items()
    )
    scalars = {
        f"{quantity.what}, {part}": getattr(quantity, part)
        for quantity in recovered
        for part in ("value", "uncertainty", "true_value")
    }
    numbers = figure_numbers(PRINTED, name, lines, scalars | slopes, quoted=quoted, points=points)
    return VirtualFigure(numbers, series, recovered)


@cache
def recovered_words() -> dict[str, dict[str, tuple[str, str]]]:
    """Words of each recovered number, and what the paper states of it, by figure and number."""
    file = files(__package__).joinpath("recovered.toml")
    return tomllib.loads(file.read_text(encoding="utf-8"))


def virtual_2(readings: SimulatedPoints) -> VirtualFigure:
    """Change of the mean against eps, at two velocities."""
    pair = all_series()[:2]
    lines, points = _over_amplitude(readings, pair)
    drops, still = (
        [last_point(points, name, column) for name in SPEEDS]
        for column in ("delta_mu", "static_friction")
    )
    reads, quoted = {"fast over slow": ratio(drops[1], drops[0])}, {"strongest": drops[0][0]}
    for name, drop, F0 in zip(SPEEDS, drops, still, strict=True):
        value, sigma, true_value = ratio(drop, F0)
        reads[f"share, {name}"] = -value, sigma, -true_value
        quoted |= {f"drop, {name}": -value, f"bar, {name}": NORMAL * sigma}
    weak = _of(points, SLOW).iloc[0]
    quoted |= {
        "weakest": weak["delta_mu"],
        "bar of the weakest": NORMAL * weak["delta_mu_uncertainty"],
    }
    return _figure("virtual-02", lines, points, pair, reads, quoted)


def virtual_3(readings: SimulatedPoints) -> VirtualFigure:
    """Mean against V for four amplitudes."""
    at_120_hz = (one for one in all_series() if one.frequency == PRINTED.numbers.frequency)
    series = tuple(sorted(at_120_hz, key=lambda one: one.velocity))
    amplitudes = PRINTED.numbers["epsilon_figure3"].si_values or ()
    V, share = velocity_axis(PRINTED), abs(series[0].transfer)
    overrides = {"B": state_coefficient()}
    lines = solve_curves(
        PRINTED,
        (FigureCurve(f"eps = {e:g}", EXT, V, e, share, overrides=overrides) for e in amplitudes),
    )
    tables = [
        rows
        for one in (readings[series_.name] for series_ in series)
        for rows in (_still(one), one[one["epsilon_set"].isin(amplitudes)])
    ]
    points = with_model(pd.concat(tables, ignore_index=True), lines)
    slopes = {e: _slope(points[points["epsilon_set"] == e]) for e in amplitudes}
    still, strong = slopes[min(slopes)], slopes[max(slopes)]
    change = strong[0] - still[0], float(np.hypot(strong[1], still[1])), strong[2] - still[2]
    quoted = {
        "change": change[0],
        "bar of the change": NORMAL * change[1],
        "change of the model": change[2],
    }
    named = {f"slope_{e:g}": slope[0] for e, slope in slopes.items()}
    reads = {"slope": still, "change": change}
    return _figure("virtual-03", lines, points, series, reads, quoted, **named)


def _still(rows: pd.DataFrame) -> pd.DataFrame:
    """One point of eps = 0: the mean of all F(0) of a series, and how they differ."""
    F0 = rows["static_friction"]
    stated, scatter = float(np.sqrt(np.mean(rows["static_friction_stated"] ** 2))), F0.std()
    one = dict.fromkeys(rows.columns, np.nan)
    one |= {name: rows[name].iloc[0] for name in ("series", "V", "frequency", "seeds")}
    one |= dict.fromkeys(("epsilon_set", "epsilon", "epsilon_eff"), 0.0)
    for name in ("mean_friction", "static_friction"):
        one |= {name: F0.mean(), f"{name}_stated": stated, f"{name}_scatter": scatter}
        one[f"{name}_uncertainty"] = max(stated, scatter)
    return pd.DataFrame([one])


def _slope(rows: pd.DataFrame) -> Read:
    """Slope over ln V of the readings, its uncertainty, and the same of the model.

    All velocities count alike, so that what is fitted does not depend on the noise.
    """
    x = np.log(rows["V"].to_numpy())
    share = (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    value, sigma, model = (
        rows[f"mean_friction{name}"].to_numpy() for name in ("", "_uncertainty", "_model")
    )
    return float(share @ value), float(np.sqrt(share**2 @ sigma**2)), float(share @ model)


def virtual_4(readings: SimulatedPoints) -> VirtualFigure:
    """First and second harmonic against eps, at two velocities."""
    pair = all_series()[:2]
    lines, points = _over_amplitude(readings, pair)
    first, second = (
        [last_point(points, name, column) for name in SPEEDS] for column in ("mu1", "mu2")
    )
    slow = _of(points, SLOW)
    plateau = float(slow["epsilon_eff"].iloc[-1]) * PRINTED.elastic_slope(pair[0].velocity)
    reads = {
        "mu1, fast over slow": ratio(first[1], first[0]),
        "mu2, fast over slow": ratio(second[1], second[0]),
        "over plateau": (first[0][0] / plateau, first[0][1] / plateau, first[0][2] / plateau),
    }
    quoted: dict[str, float] = {}
    for name, mu1, mu2 in zip(SPEEDS, first, second, strict=True):
        reads |= {f"mu1, {name}": mu1, f"ratio, {name}": ratio(mu2, mu1)}
        quoted |= {
            f"mu1, {name}": mu1[0], f"bar, {name}": NORMAL * mu1[1],
            f"ratio, {name}": mu2[0] / mu1[0],
        }  # fmt: skip
    return _figure("virtual-04", lines, points, pair, reads, quoted)


def virtual_5(readings: SimulatedPoints) -> VirtualFigure:
    """Change of the mean in air and in vacuum, and the factor that makes them one curve."""
    p = PRINTED.numbers
    pair = tuple(one for one in all_series() if one.frequency == p.frequency_vacuum)
    lines, points = _over_amplitude(readings, pair)
    factor, sigma = collapse(_of(points, VACUUM), _of(points, AIR))
    vacuum, air = (abs(one.transfer) for one in pair)
    quoted = {
        "factor": factor,
        "bar of the factor": NORMAL * sigma,
        "factor of the machine": air / vacuum,
        **{f"share, {name}": share for name, share in ((VACUUM, vacuum), (AIR, air))},
        **{f"drop, {n}": last_point(points, n, "delta_mu")[0] for n in (VACUUM, AIR)},
    }
    reads = {"factor": (factor, sigma, air / vacuum)}
    return _figure("virtual-05", lines, points, pair, reads, quoted)


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


#: What makes each figure out of the experiment, in the order of the paper.
VIRTUAL: tuple[Callable[[SimulatedPoints], VirtualFigure], ...] = (
    virtual_2,
    virtual_3,
    virtual_4,
    virtual_5,
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
    bold = {"&lt;b&gt;": "<b>", "&lt;/b&gt;": "</b>"}
    page = "".join(f"<p>{rich(text)}</p>" for text in texts)
    for escaped, tag in bold.items():
        page = page.replace(escaped, tag)
    return page


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
    """What the recordings say, the value in the simulated machine, and what the paper states."""
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


def provenance(
    figure: VirtualFigure, place: str, what: str, parameters: Sequence[str]
) -> list[str]:
    """What the first lines of a CSV say.

    Parameters
    ----------
    figure : VirtualFigure
    place : str
        Place of the figure in the report.
    what : str
        The table: of the points or of the lines.
    parameters : sequence of str
        Lines on the numbers that the models were given.
    """
    runs = [
        f"  {s.name}, {s.frequency:g} Hz: seeds {', '.join(map(str, s.seeds))}; eps_eff/eps "
        f"{abs(s.transfer):.6g}; sliding {s.sliding:.4g} s, modulated {s.modulated:.4g} s"
        for s in figure.series
    ]
    return [
        f"SIMULATED, {what} of {place}: a virtual experiment; no measured points",
        "after the protocol of Bureau, Baumberger and Caroli, Phys. Rev. E 62, 6810 (2000)",
        f"computed by asperity {asp.__version__}",
        *description(figure.series[0].frequency),
        "runs (seed: noise of the sensors, drift of the gauge; the motion is the same):",
        *runs,
        "parameters, where nothing above says otherwise (kind in brackets):",
        *parameters,
        "read off the points:",
        *(f"  {name} = {value:.12g}" for name, value in figure.numbers.scalars.items()),
    ]
