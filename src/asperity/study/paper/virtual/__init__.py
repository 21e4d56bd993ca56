"""A virtual experiment: the paper's protocol, simulated, recorded with noise and read again.

The measured points of Figs. 2 to 5 are not in the text, and nothing here stands for them: these are
the points that the elasto-plastic law would have made of the same protocol, with error bars from
the same reading that a laboratory's recordings get.
"""

from asperity.study.paper.virtual.apparatus import description, resonance
from asperity.study.paper.virtual.beside import experiment_beside
from asperity.study.paper.virtual.harmonics import virtual_4
from asperity.study.paper.virtual.mean import virtual_2, virtual_3
from asperity.study.paper.virtual.numbers import Finding, VirtualNumbers, covered
from asperity.study.paper.virtual.pressure import virtual_5
from asperity.study.paper.virtual.recordings import (
    NORMAL,
    POINT_COLUMNS,
    Experiment,
    Series,
    all_series,
    experiment,
)

#: What makes each figure out of the experiment, in the order of the paper.
VIRTUAL = (virtual_2, virtual_3, virtual_4, virtual_5)

__all__ = [
    "NORMAL",
    "POINT_COLUMNS",
    "VIRTUAL",
    "Experiment",
    "Finding",
    "Series",
    "VirtualNumbers",
    "all_series",
    "covered",
    "description",
    "experiment",
    "experiment_beside",
    "resonance",
    "virtual_2",
    "virtual_3",
    "virtual_4",
    "virtual_5",
]
