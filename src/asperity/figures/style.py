"""What a colour and a line mean, the same in every figure.

The colour is the law (Okabe and Ito's palette, which all common kinds of colour vision can
distinguish), near-black the law with the mass of the slider; the dashes are the velocity as in the
paper's captions, and ochre is what the text states.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RICE_RUINA = "#0072B2"
LINKER_DIETERICH = "#D55E00"
LINKER_DIETERICH_LOW = "#B0528F"
ELASTO_PLASTIC = "#00805B"
STATED = "#8A5A00"
STATED_FILL = "#E9C46A"
GREY = "#767676"
#: Curves that count the mass of the slider, beside the same law without it.
INERTIA = "#2B2B33"

#: A variant of a law, or of the machine.
VARIANT = "#C05A00"
#: Measured and simulated points.
POINTS = "#B3261E"

SLOW, FAST = "solid", "dashed"

#: The same by name, for figures that are described in a file.
COLOURS = {
    "rice-ruina": RICE_RUINA,
    "linker-dieterich": LINKER_DIETERICH,
    "linker-dieterich-low": LINKER_DIETERICH_LOW,
    "elasto-plastic": ELASTO_PLASTIC,
    "inertia": INERTIA,
    "variant": VARIANT,
    "stated": STATED,
    "stated-fill": STATED_FILL,
    "points": POINTS,
    "grey": GREY,
}
DASHES = {"slow": SLOW, "fast": FAST}


@contextmanager
def style() -> Iterator[None]:
    """The project's style, for making and for saving figures; the user's own is left as it was."""
    import matplotlib as mpl

    with as_file(files("asperity.figures") / "asperity.mplstyle") as path:
        settings = mpl.rc_params_from_file(path, use_default_template=True)
    # The template holds the backend and would switch it; files are written by the figure itself.
    chosen = {name: value for name, value in settings.items() if not name.startswith("backend")}
    with mpl.rc_context(chosen):
        yield


def new_figure(width: float = 5.0, height: float = 3.5) -> Figure:
    """An empty figure (inches), not registered with pyplot."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height))
