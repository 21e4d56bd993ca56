"""Maps: response and stability over any two numbers of an operating point.

The points of a grid are solved in chunks. On each edge of the grid whose ends differ in stability
the crossing of the stability boundary is searched. The crossings are joined to lines, with the kind
of bifurcation at each point.
"""

from asperity.study.map.dataset import SHOWN
from asperity.study.map.plane import Axis
from asperity.study.map.response_map import response_map, write_map

__all__ = ["SHOWN", "Axis", "response_map", "write_map"]
