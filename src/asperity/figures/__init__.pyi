# Public names of the package, each with its module; `asperity._lazy` imports them when used.

from asperity.figures.map import draw_plane as draw_plane
from asperity.figures.style import (
    COLOURS as COLOURS,
    new_figure as new_figure,
)
