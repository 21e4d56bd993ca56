"""The numbers behind the figures of Bureau, Baumberger and Caroli (2000), as the models have them.

Figures 2 to 5 show measurements, whose points are not in the text: here they are what the models
predict for the same experiment, beside what the text states about it.
"""

from asperity.study.paper.curves import COLUMNS, Curve, solve_curves
from asperity.study.paper.harmonics import figure_4, figure_8, figure_9, figure_11
from asperity.study.paper.machine import paper
from asperity.study.paper.mean import figure_2, figure_3, figure_5, figure_6, figure_7
from asperity.study.paper.numbers import FigureNumbers, Stated, stated
from asperity.study.paper.stability import floquet_figure

#: What computes each figure, in the order of the paper.
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
)

__all__ = [
    "COLUMNS",
    "FIGURES",
    "Curve",
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
    "solve_curves",
    "stated",
]
