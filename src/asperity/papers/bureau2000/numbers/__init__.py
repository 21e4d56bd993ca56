"""The numbers behind the figures of Bureau, Baumberger and Caroli (2000), as the models have them.

Figures 2 to 5 show measurements, whose points are not in the text: here they are what the models
predict for the same experiment, beside what the text states about it.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from asperity.papers.bureau2000.numbers.curves import COLUMNS, FigureCurve, solve_curves
from asperity.papers.bureau2000.numbers.figure_numbers import FigureNumbers, Stated, stated
from asperity.papers.bureau2000.numbers.harmonics import (
    curves_4,
    curves_8,
    curves_9,
    curves_11,
    figure_4,
    figure_8,
    figure_9,
    figure_11,
)
from asperity.papers.bureau2000.numbers.machine import paper, printed, replaced_numbers
from asperity.papers.bureau2000.numbers.mean import (
    curves_2,
    curves_3,
    curves_5,
    curves_6,
    curves_7,
    figure_2,
    figure_3,
    figure_5,
    figure_6,
    figure_7,
)
from asperity.papers.bureau2000.numbers.period import period_figure
from asperity.papers.bureau2000.numbers.phases import phase_figure
from asperity.papers.bureau2000.numbers.resonance import resonance_figure
from asperity.papers.bureau2000.numbers.stability import floquet_figure

#: What computes each figure, in the order of the paper; the last four are not in it.
FIGURES = (
    figure_2,
    figure_3,
    figure_4,
    figure_5,
    figure_6,
    figure_7,
    figure_8,
    figure_9,
    figure_11,
    floquet_figure,
    period_figure,
    phase_figure,
    resonance_figure,
)

#: Lines of each figure of the paper, by its name.
CURVES: Mapping[str, Callable[[], list[FigureCurve]]] = MappingProxyType(
    {
        "figure-02": curves_2,
        "figure-03": curves_3,
        "figure-04": curves_4,
        "figure-05": curves_5,
        "figure-06": curves_6,
        "figure-07": curves_7,
        "figure-08": curves_8,
        "figure-09": curves_9,
        "figure-11": curves_11,
    }
)

__all__ = [
    "COLUMNS",
    "CURVES",
    "FIGURES",
    "FigureCurve",
    "FigureNumbers",
    "Stated",
    "figure_2",
    "figure_3",
    "figure_4",
    "figure_5",
    "figure_6",
    "figure_7",
    "figure_8",
    "figure_9",
    "figure_11",
    "floquet_figure",
    "paper",
    "period_figure",
    "phase_figure",
    "printed",
    "replaced_numbers",
    "resonance_figure",
    "solve_curves",
    "stated",
]
