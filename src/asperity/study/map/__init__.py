"""Maps: response and stability over any two numbers of an operating point.

The grid is solved in blocks, every edge of it whose ends differ in stability is searched for the
crossing, and the crossings are joined to lines, with the kind of bifurcation at each point.
"""

from asperity.study.map.dataset import SHOWN
from asperity.study.map.plane import Axis
from asperity.study.map.response_map import response_map, write_map

__all__ = ["SHOWN", "Axis", "response_map", "write_map"]
