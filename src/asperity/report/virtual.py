"""The virtual experiment on the page, and the heads of its tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from asperity._version import __version__
from asperity.report.markup import cell, rich
from asperity.report.parameters import provenance_lines
from asperity.study.paper.virtual import (
    NORMAL,
    Finding,
    VirtualNumbers,
    covered,
    description,
    resonance,
)

#: Quantities whose bars are drawn.
_DRAWN = {
    "virtual-02": ("delta_mu",),
    "virtual-03": ("mean_friction",),
    "virtual-04": ("mu1", "mu2"),
    "virtual-05": ("delta_mu",),
}


def introduction(figures: Sequence[VirtualNumbers]) -> str:
    """What is simulated and what is not, in front of the figures."""
    held, bars = np.sum([covered(f.points, _DRAWN[f.name]) for f in figures], axis=0)
    # Figures share series, and the points of eps = 0 have no window.
    points = pd.concat([f.points.dropna(subset="window") for f in figures])
    readings = points.drop_duplicates(["series", "epsilon_set"])
    windows, verdicts = readings["window"], readings["verdict"]
    clear = int((verdicts == "ok").sum())
    runs = len(figures[0].series[0].seeds)
    told = "; ".join(description(figures[0].series[0].frequency))
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
        f"the standard deviation of the runs. {held} of {bars} bars hold the model. The lock-in "
        f"reads {windows.min():.1f} to {windows.max():.1f} s of each modulated stretch, after "
        f"what has not settled; the verdict is ok on {clear} of {len(verdicts)} readings, and "
        "stands in the tables.",
        f"The machine: {told}. Without inertia, as the paper’s models: with the mass of the "
        f"slider the asperities resonate at {resonance():.0f} Hz, twice the frequency of Figure 5.",
    )
    return "".join(f"<p>{_marked(text)}</p>" for text in texts)


def _marked(text: str) -> str:
    return rich(text).replace("&lt;b&gt;", "<b>").replace("&lt;/b&gt;", "</b>")


def findings_table(figures: Sequence[VirtualNumbers]) -> str:
    """What the recordings say, what the machine was told, and what the paper states."""
    rows = "\n".join(_row(finding) for figure in figures for finding in figure.findings)
    heads = ("Read off simulated recordings", "Reading, ± 95 %", "The machine has", "The text has")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        '<table class="ledger" role="table" aria-label="Read off the simulated recordings">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table>'
    )


def _row(finding: Finding) -> str:
    half = NORMAL * finding.uncertainty
    digits = max(0, 1 - int(np.floor(np.log10(half))))
    reading = f"{finding.value:.{digits}f} ± {half:.{digits}f}"
    if not finding.agrees:
        reading += " (does not hold what the machine has)"
    return (
        '<tr role="row">'
        + cell("Quantity", rich(finding.what), "statement")
        + cell("Reading", rich(reading), "computed")
        + cell("The machine has", rich(f"{finding.told:.{digits}f}"), "stated")
        + cell("The text has", rich(finding.stated), "stated")
        + "</tr>"
    )


def provenance(figure: VirtualNumbers, what: str) -> list[str]:
    """What the first lines of a CSV say.

    Parameters
    ----------
    figure : VirtualNumbers
    what : str
        The table: of the points or of the lines.
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
        *provenance_lines(),
        "read off the points:",
        *(f"  {name} = {value:.12g}" for name, value in figure.scalars.items()),
    ]
