"""Figures of fits: data with bands, recordings with motions, and residuals."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from asperity.arrays import Float
from asperity.errors import InputError, require
from asperity.figures.style import new_figure, style
from asperity.fit_report.bands import Series, bands_of
from asperity.inference import Fit, LockInTable
from asperity.inference.objective import Residuals
from asperity.inference.runs.run import RecordedRun
from asperity.inference.runs.term import RunTerm
from asperity.inference.tables.term import LockInTerm
from asperity.parameters import NAMES, Names
from asperity.parameters.parameter import labelled

#: Approximate number of samples of a recording in a figure.
_DRAWN = 2000
_LABELS = {
    "mean_friction": r"$\bar\mu$",
    "delta_mu": r"$\Delta\mu$",
    "mu1": r"$\mu_1$",
    "mu2": r"$\mu_2$",
}


def _draw_band(axis: Any, one: Series, name: str, color: str, label: str | None = None) -> None:
    band = one.bands[name]
    axis.fill_between(band.epsilon, band.low, band.high, color=color, alpha=0.3, lw=0)
    axis.plot(band.epsilon, band.middle, color=color, lw=1, label=label)


def _draw_readings(axis: Any, table: LockInTable, one: Series, name: str, **style: Any) -> None:
    columns = (
        c[one.rows] for c in (table.points["epsilon"], table.values[name], table.errors[name])
    )
    axis.errorbar(*columns, fmt="o", ms=3, **style)


def data_figure(table: LockInTable, series: Sequence[Series]) -> Figure:
    """Readings with error bars, and bands of the fit, against the amplitude."""
    names = [n for n in _LABELS if n in table.values]
    with style():
        figure = new_figure(6.4, 2.6 * len(names))
        axes = np.atleast_1d(figure.subplots(len(names), 1, sharex=True))
        for axis, name in zip(axes, names, strict=True):
            for k, one in enumerate(series):
                _draw_band(axis, one, name, f"C{k}")
                _draw_readings(axis, table, one, name, color=f"C{k}", label=one.label)
            axis.set_ylabel(_LABELS[name])
        axes[0].legend(fontsize=8)
        axes[-1].set_xlabel(r"$\epsilon$ as applied")
        return figure


def laws_figure(table: LockInTable, predicted: Mapping[str, Sequence[Series]]) -> Figure:
    """Readings, and bands of several laws, a column of panels for each series.

    Parameters
    ----------
    table : LockInTable
    predicted : mapping of str to sequence of Series
        By law.
    """
    names = [n for n in _LABELS if n in table.values]
    count = len(next(iter(predicted.values())))
    with style():
        figure = new_figure(max(6.4, 3.2 * count), 2.6 * len(names))
        axes = figure.subplots(len(names), count, sharex=True, squeeze=False)
        for row, name in zip(axes, names, strict=True):
            for i, axis in enumerate(row):
                for k, (law, series) in enumerate(predicted.items()):
                    _draw_band(axis, series[i], name, f"C{k}", law)
                _draw_readings(axis, table, series[i], name, color="k", lw=0.8)
            row[0].set_ylabel(_LABELS[name])
        for axis, one in zip(axes[0], next(iter(predicted.values())), strict=True):
            axis.set_title(one.label, fontsize=9)
        for axis in axes[-1]:
            axis.set_xlabel(r"$\epsilon$ as applied")
        axes[0, 0].legend(fontsize=7)
        return figure


def run_figure(run: RecordedRun, curves: Mapping[str, Float]) -> Figure:
    """Friction of a recording with the motions of laws, and the residuals.

    Parameters
    ----------
    run : RecordedRun
    curves : mapping of str to array, shape (n,)
        Friction at the samples by law, with the nuisances of the gauge.
    """
    thin = slice(None, None, max(1, run.time.size // _DRAWN))
    time = run.recorded_times(run.time)[thin]
    with style():
        figure = new_figure(6.4, 4.8)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
        above.plot(time, run.friction[thin], ".", color="0.7", ms=2)
        for k, (law, curve) in enumerate(curves.items()):
            above.plot(time, curve[thin], color=f"C{k}", lw=1, label=law)
            below.plot(time, (run.friction - curve)[thin], color=f"C{k}", lw=0.5)
        above.set_ylabel("friction $F/W$")
        above.legend(fontsize=8)
        below.set_ylabel("data - law")
        # Times late in a recording as they stand in its file, not as multiples of a power of ten.
        below.ticklabel_format(axis="x", style="plain", useOffset=False)
        below.set_xlabel("time (s)")
        return figure


def residual_figure(residuals: Residuals, rows: np.ndarray) -> Figure:
    """Data less the law in standard uncertainties, by row.

    Parameters
    ----------
    residuals : Residuals
    rows : array of str
        Names of the rows, such as "row 3" or "row 3 of a.csv".
    """
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    # Rows of the file that are no readings are not in the table.
    numbers = {k: name.split(" of ")[0].removeprefix("row ") for k, name in enumerate(rows, 1)}
    with style():
        figure = new_figure(6.4, 3.0)
        axis = figure.subplots()
        for k, name in enumerate(dict.fromkeys(residuals.observable.tolist())):
            at = residuals.observable == name
            axis.plot(
                residuals.row[at] + 1, -residuals.values[at], "o", ms=3, color=f"C{k}", label=name
            )
        axis.axhspan(-2, 2, color="0.5", alpha=0.15, lw=0)
        axis.set_xlabel("row")
        axis.set_ylabel("(data - law) / uncertainty")
        axis.set_xlim(0, len(rows) + 1)
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        axis.xaxis.set_major_formatter(FuncFormatter(lambda x, _: numbers.get(round(x), "")))
        axis.legend(fontsize=8, ncols=3)
        return figure


def draw_fit(fit: Fit) -> Figure:
    """The first recording of a fit with the motion of its law, or its first table with bands.

    Parameters
    ----------
    fit : Fit

    Raises
    ------
    InputError
        If the fit has not converged, or is one of another kind of data.
    """
    require(fit.converged, "plot", "have a fit that converged", f"one with: {fit.message}")
    for recording, _ in fit.parts(RunTerm):
        return run_figure(recording.run, {fit.law: recording.fitted_friction(fit.values)})
    for table, _ in fit.parts(LockInTerm):
        return data_figure(table.table, bands_of(fit, table, None))
    rule = "have a fit to a recording or a table of readings"
    raise InputError("plot", rule, "another kind of data", "plot its residuals yourself")


def svg(figure: Figure, names: Names = NAMES[0]) -> str:
    """A figure as an SVG element, without the header of a file, labelled in a set of names."""
    text = io.StringIO()
    with style():
        labelled(figure, names).savefig(
            text, format="svg", metadata={"Date": None, "Creator": None}
        )
    whole = text.getvalue()
    return whole[whole.index("<svg") :]
