"""Figures of fits as SVG: data with bands, recordings with motions, and residuals."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from asperity.figures.style import new_figure, style
from asperity.fit_report.bands import Band
from asperity.inference import LockInTable
from asperity.inference.objective import Residuals
from asperity.inference.runs.run import RecordedRun

Float = NDArray[np.float64]

#: Samples of a recording that a figure shows, about.
_DRAWN = 2000
_LABELS = {
    "mean_friction": r"$\bar\mu$",
    "delta_mu": r"$\Delta\mu$",
    "mu1": r"$\mu_1$",
    "mu2": r"$\mu_2$",
}


def data_figure(table: LockInTable, bands: Mapping[float, Mapping[str, Band]]) -> str:
    """Readings with error bars, and bands of the fit, against the amplitude; as SVG."""
    names = [n for n in _LABELS if n in table.values]
    with style():
        figure = new_figure(6.4, 2.6 * len(names))
        axes = np.atleast_1d(figure.subplots(len(names), 1, sharex=True))
        for axis, name in zip(axes, names, strict=True):
            for k, (velocity, curves) in enumerate(bands.items()):
                color = f"C{k}"
                band = curves[name]
                axis.fill_between(band.epsilon, band.low, band.high, color=color, alpha=0.3, lw=0)
                axis.plot(band.epsilon, band.middle, color=color, lw=1)
                at = table.points["V"] == velocity
                axis.errorbar(
                    table.points["epsilon"][at],
                    table.values[name][at],
                    table.errors[name][at],
                    fmt="o",
                    ms=3,
                    color=color,
                    label=f"{velocity * 1e6:.3g} µm/s",
                )
            axis.set_ylabel(_LABELS[name])
        axes[0].legend(fontsize=8)
        axes[-1].set_xlabel(r"$\epsilon$ as applied")
        return _svg(figure)


def laws_figure(table: LockInTable, bands: Mapping[str, Mapping[float, Mapping[str, Band]]]) -> str:
    """Readings, and bands of several laws, a column of panels for each velocity; as SVG.

    Parameters
    ----------
    table : LockInTable
    bands : mapping of str to mapping
        By law, velocity and observable.
    """
    names = [n for n in _LABELS if n in table.values]
    velocities = list(next(iter(bands.values())))
    with style():
        figure = new_figure(max(6.4, 3.2 * len(velocities)), 2.6 * len(names))
        axes = figure.subplots(len(names), len(velocities), sharex=True, squeeze=False)
        for row, name in zip(axes, names, strict=True):
            for axis, velocity in zip(row, velocities, strict=True):
                for k, (law, curves) in enumerate(bands.items()):
                    band = curves[velocity][name]
                    axis.fill_between(
                        band.epsilon, band.low, band.high, color=f"C{k}", alpha=0.3, lw=0
                    )
                    axis.plot(band.epsilon, band.middle, color=f"C{k}", lw=1, label=law)
                at = table.points["V"] == velocity
                axis.errorbar(
                    table.points["epsilon"][at],
                    table.values[name][at],
                    table.errors[name][at],
                    fmt="ko",
                    ms=3,
                    lw=0.8,
                )
            row[0].set_ylabel(_LABELS[name])
        for axis, velocity in zip(axes[0], velocities, strict=True):
            axis.set_title(f"{velocity * 1e6:.3g} µm/s", fontsize=9)
        for axis in axes[-1]:
            axis.set_xlabel(r"$\epsilon$ as applied")
        axes[0, 0].legend(fontsize=7)
        return _svg(figure)


def run_figure(run: RecordedRun, curves: Mapping[str, Float]) -> str:
    """Friction of a recording with the motion of laws, and what is left; as SVG.

    Parameters
    ----------
    run : RecordedRun
    curves : mapping of str to array, shape (n,)
        Friction at the samples by law, with the nuisances of the gauge.
    """
    thin = slice(None, None, max(1, run.time.size // _DRAWN))
    with style():
        figure = new_figure(6.4, 4.8)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
        above.plot(run.time[thin], run.friction[thin], ".", color="0.7", ms=2)
        for k, (law, curve) in enumerate(curves.items()):
            above.plot(run.time[thin], curve[thin], color=f"C{k}", lw=1, label=law)
            below.plot(run.time[thin], (run.friction - curve)[thin], color=f"C{k}", lw=0.5)
        above.set_ylabel("F/W")
        above.legend(fontsize=8)
        below.set_ylabel("data - law")
        below.set_xlabel("time (s)")
        return _svg(figure)


def residual_figure(residuals: Residuals, rows: np.ndarray) -> str:
    """Residuals in standard uncertainties, by row; as SVG."""
    with style():
        figure = new_figure(6.4, 3.0)
        axis = figure.subplots()
        for k, name in enumerate(dict.fromkeys(residuals.observable.tolist())):
            at = residuals.observable == name
            axis.plot(
                residuals.row[at] + 1, residuals.values[at], "o", ms=3, color=f"C{k}", label=name
            )
        axis.axhspan(-2, 2, color="0.5", alpha=0.15, lw=0)
        axis.set_xlabel("row")
        axis.set_ylabel("residual / uncertainty")
        axis.set_xlim(0, len(rows) + 1)
        axis.legend(fontsize=8, ncols=3)
        return _svg(figure)


def _svg(figure: Figure) -> str:
    """An SVG element, without the header of a file."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    whole = text.getvalue()
    return whole[whole.index("<svg") :]
