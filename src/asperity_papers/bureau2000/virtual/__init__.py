"""A virtual experiment: the paper's protocol, simulated, recorded with noise and read again.

The measured points of Figs. 2 to 5 are not in the text, and nothing here stands for them: these are
the points that the elasto-plastic law would have made of the same protocol, with error bars from
the same reading that a laboratory's recordings get.
"""

from asperity_papers.bureau2000.virtual.figures import (
    VIRTUAL,
    RecoveredQuantity,
    VirtualFigure,
)
from asperity_papers.bureau2000.virtual.recordings import (
    POINT_COLUMNS,
    Series,
    SimulatedPoints,
    all_series,
    experiment,
    experiment_in_background,
)

__all__ = [
    "POINT_COLUMNS",
    "VIRTUAL",
    "RecoveredQuantity",
    "Series",
    "SimulatedPoints",
    "VirtualFigure",
    "all_series",
    "experiment",
    "experiment_in_background",
]
