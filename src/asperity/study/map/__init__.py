"""Maps: response and stability over any two numbers of an operating point.

The points of a grid are solved in chunks. Contours of their stability give the edges of the grid
that the stability boundary crosses; there it is located, with the kind of bifurcation.
"""

from asperity.study.map.plane import SHOWN, Axis
from asperity.study.map.response_map import response_map, write_map

__all__ = ["SHOWN", "Axis", "response_map", "write_map"]
