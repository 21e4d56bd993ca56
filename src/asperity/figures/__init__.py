"""Figures: numbers to CSV, then to a picture. Nothing is solved here.

Each name below is imported when first used: Matplotlib takes its time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from asperity._lazy import lazy_names
from asperity.figures.style import COLOURS

if TYPE_CHECKING:
    from asperity.figures.map import draw_plane
    from asperity.figures.style import new_figure

_HOMES = {"draw_plane": "map", "new_figure": "style"}

__all__ = ["COLOURS", "draw_plane", "new_figure"]


__getattr__ = lazy_names(__name__, _HOMES)
