"""The virtual experiment on the page, and the heads of its tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from asperity._version import __version__
from asperity.papers.bureau2000.numbers.resonance import contact_resonance
from asperity.papers.bureau2000.virtual.apparatus import description
from asperity.papers.bureau2000.virtual.numbers import RecoveredQuantity, VirtualNumbers, covered
from asperity.papers.bureau2000.virtual.recordings import NORMAL
from asperity.papers.report.markup import cell, rich

#: Quantities whose bars are drawn.
_DRAWN = {
    "virtual-02": ("delta_mu",),
    "virtual-03": ("mean_friction",),
    "virtual-04": ("mu1", "mu2"),
    "virtual-05": ("delta_mu",),
}


def introduction(figures: Sequence[VirtualNumbers]) -> str:
    """What is simulated and what is not, in front of the figures."""
    within, bars = np.sum([covered(f.points, _DRAWN[f.name]) for f in figures], axis=0)
    # Figures share series, and the points of eps = 0 have no window.
    points = pd.concat([f.points.dropna(subset="window") for f in figures])
    readings = points.drop_duplicates(["series", "epsilon_set"])
    windows, verdicts = readings["window"], readings["verdict"]
    clear = int((verdicts == "ok").sum())
    runs = len(figures[0].series[0].seeds)
    machine = "; ".join(description(figures[0].series[0].frequency))
    texts = (
        "<b>Simulated.</b> The measured points of the paper’s Figures 2 to 5 are in no text, and "
        "nothing here stands for them or was read off a figure. These are the points that the "
        "elasto-plastic law would have made of the same protocol: slide steadily, modulate, read, "
        "switch off, measure F(0) again, next amplitude. The motion is integrated through all of "
        "it, transients included, seen by gauges with noise and drift, and read by the code that "
        "reads a laboratory’s recordings.",
        f"Symbols: mean of {runs} runs, which differ in the noise of the sensors and in the drift "
        "of the gauge, while the motion is the same. Bars: 95 % of a single run, "
        f"{NORMAL:g} times the larger of the standard uncertainty that the readings state and of "
        f"the standard deviation of the runs. {within} of {bars} bars contain the model. The "
        f"lock-in reads {windows.min():.1f} to {windows.max():.1f} s of each modulated stretch, "
        f"after the transient; the verdict is ok on {clear} of {len(verdicts)} readings, and "
        "stands in the tables.",
        f"The machine: {machine}. Without inertia, as the paper’s models: with the mass of the "
        f"slider the asperities resonate at {contact_resonance():.0f} Hz, twice the frequency of "
        "Figure 5.",
    )
    return "".join(f"<p>{_marked(text)}</p>" for text in texts)


def _marked(text: str) -> str:
    return rich(text).replace("&lt;b&gt;", "<b>").replace("&lt;/b&gt;", "</b>")


def recovered_table(figures: Sequence[VirtualNumbers]) -> str:
    """What the recordings say, the value in the simulated machine, and what the paper states."""
    rows = "\n".join(_row(quantity) for figure in figures for quantity in figure.recovered)
    heads = ("Read off simulated recordings", "Reading, ± 95 %", "The machine has", "The text has")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        '<table class="ledger" role="table" aria-label="Read off the simulated recordings">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table>'
    )


def _row(quantity: RecoveredQuantity) -> str:
    half = NORMAL * quantity.uncertainty
    digits = max(0, 1 - int(np.floor(np.log10(half))))
    reading = f"{quantity.value:.{digits}f} ± {half:.{digits}f}"
    if not quantity.agrees:
        reading += " (does not hold what the machine has)"
    return (
        '<tr role="row">'
        + cell("Quantity", rich(quantity.what), "statement")
        + cell("Reading", rich(reading), "computed")
        + cell("The machine has", rich(f"{quantity.true_value:.{digits}f}"), "stated")
        + cell("The text has", rich(quantity.stated), "stated")
        + "</tr>"
    )


def provenance(figure: VirtualNumbers, what: str, parameters: Sequence[str]) -> list[str]:
    """What the first lines of a CSV say.

    Parameters
    ----------
    figure : VirtualNumbers
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
        f"SIMULATED, {what} of {figure.place}: a virtual experiment; no measured points",
        "after the protocol of Bureau, Baumberger and Caroli, Phys. Rev. E 62, 6810 (2000)",
        f"computed by asperity {__version__}",
        *description(figure.series[0].frequency),
        "runs (seed: noise of the sensors, drift of the gauge; the motion is the same):",
        *runs,
        "parameters, where nothing above says otherwise (kind in brackets):",
        *parameters,
        "read off the points:",
        *(f"  {name} = {value:.12g}" for name, value in figure.scalars.items()),
    ]
