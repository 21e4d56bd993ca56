"""A virtual experiment: the paper's protocol, simulated, recorded with noise and read again.

The measured points of Figs. 2 to 5 are not in the text, and nothing here stands for them: these are
the points that the elasto-plastic law would have made of the same protocol, with error bars from
the same reading that a laboratory's recordings get.
"""

from asperity.papers.bureau2000.virtual.apparatus import description
from asperity.papers.bureau2000.virtual.harmonics import virtual_4
from asperity.papers.bureau2000.virtual.mean import virtual_2, virtual_3
from asperity.papers.bureau2000.virtual.numbers import RecoveredQuantity, VirtualNumbers, covered
from asperity.papers.bureau2000.virtual.pressure import virtual_5
from asperity.papers.bureau2000.virtual.process import experiment_beside
from asperity.papers.bureau2000.virtual.recordings import (
    NORMAL,
    POINT_COLUMNS,
    Series,
    SimulatedPoints,
    all_series,
    experiment,
)

#: What makes each figure out of the experiment, in the order of the paper.
VIRTUAL = (virtual_2, virtual_3, virtual_4, virtual_5)

__all__ = [
    "NORMAL",
    "POINT_COLUMNS",
    "VIRTUAL",
    "RecoveredQuantity",
    "Series",
    "SimulatedPoints",
    "VirtualNumbers",
    "all_series",
    "covered",
    "description",
    "experiment",
    "experiment_beside",
    "virtual_2",
    "virtual_3",
    "virtual_4",
    "virtual_5",
]
