"""Figures of a fit as SVG: data with bands, and residuals."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from asperity.figures.style import new_figure, style
from asperity.fit_report.bands import Band
from asperity.inference import LockInTable
from asperity.inference.residuals import Residuals

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
