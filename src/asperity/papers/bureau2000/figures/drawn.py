"""What draws each figure, and the two figures without numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from matplotlib.figure import Figure

from asperity.papers.bureau2000.figures.additional import draw_period, draw_phases, draw_resonance
from asperity.papers.bureau2000.figures.harmonics import draw_4, draw_8, draw_9, draw_11
from asperity.papers.bureau2000.figures.mean import draw_2, draw_3, draw_5, draw_6, draw_7
from asperity.papers.bureau2000.figures.schematics import draw_1, draw_10
from asperity.papers.bureau2000.figures.stability import draw_floquet
from asperity.papers.bureau2000.numbers import FigureNumbers

#: What draws the numbers of each figure.
DRAWN: Mapping[str, Callable[[FigureNumbers], Figure]] = MappingProxyType(
    {
        "figure-02": draw_2,
        "figure-03": draw_3,
        "figure-04": draw_4,
        "figure-05": draw_5,
        "figure-06": draw_6,
        "figure-07": draw_7,
        "figure-08": draw_8,
        "figure-09": draw_9,
        "figure-11": draw_11,
        "figure-12": draw_floquet,
        "figure-13": draw_period,
        "figure-14": draw_phases,
        "figure-15": draw_resonance,
    }
)


@dataclass(frozen=True)
class Schematic:
    """A figure without numbers; fields as in `FigureNumbers`."""

    name: str
    place: str
    title: str
    caption: str
    alt: str
    draw: Callable[[], Figure]


SCHEMATICS = (
    Schematic(
        "figure-01",
        "Figure 1",
        "The set-up",
        "Redrawn from the text, not to scale. Translation stage (Drv), loading leaf spring (Lsp), "
        "displacement gauge (Gg) that reads its deflection, vibration exciter (Vb) with the "
        "accelerometer (Acc) on its moving element, and weighting spring (Spr), whose end moves "
        "along with the slider. Top: the spring–slider system with its control parameters, normal "
        "load W, driving velocity V and spring stiffness K.",
        "A slider on a track is pulled through a vertical leaf spring by a translation stage "
        "moving at velocity V; a vibration exciter sits on the slider, and a vertical spring from "
        "a second stage carries part of its weight. Above, the same as a block, a spring K and a "
        "velocity V.",
        draw_1,
    ),
    Schematic(
        "figure-10",
        "Figure 10",
        "The interface: a spring in series with a frictional joint",
        "Redrawn from the text. The asperities' bodies are a spring of stiffness "
        "κ_asp = W/λ, the nanometre-thick joint is a frictional element whose force f depends on "
        "its own sliding rate; the slider's velocity is the sum of both rates.",
        "From left to right: a fixed wall, a frictional element of two rubbing plates with force f "
        "of the plastic rate, a spring of stiffness W over lambda, and the slider, pulled by F and "
        "loaded by W.",
        draw_10,
    ),
)
