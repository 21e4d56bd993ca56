"""Figures: numbers to CSV, then to a picture. Nothing is solved here.

Each name below is imported when first used: Matplotlib takes its time.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from asperity.figures.style import COLOURS, DASHES

if TYPE_CHECKING:
    from asperity.figures.map import draw_plane
    from asperity.figures.plot import Plot
    from asperity.figures.style import new_figure, save_picture, save_table

_HOMES = {
    "Plot": "plot",
    "draw_plane": "map",
    "new_figure": "style",
    "save_picture": "style",
    "save_table": "style",
}

__all__ = [
    "COLOURS",
    "DASHES",
    "Plot",
    "draw_plane",
    "new_figure",
    "save_picture",
    "save_table",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'asperity.figures' has no attribute '{name}'")
    return getattr(import_module(f"asperity.figures.{_HOMES[name]}"), name)
