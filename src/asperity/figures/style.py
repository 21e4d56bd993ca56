"""Common style of all figures: meaning of colours and lines, and file formats.

The colour is the law (Okabe and Ito's palette, which all common kinds of colour vision can
distinguish), near-black the law with the mass of the slider; the dashes are the velocity as in the
paper's captions, and ochre is what the text states.

Figures and their numbers are the same bytes on disk whenever the same numbers are drawn.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.resources import as_file, files
from io import BytesIO
from pathlib import Path
from string import ascii_lowercase
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.parameters.arguments import typed

#: Twelve digits: more than the accuracy of any method, and less than round-off.
_DIGITS = "%.12g"


def save_picture(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write ``stem.png`` and ``stem.pdf``; the style must be active.

    Parameters
    ----------
    figure : Figure
    stem : Path
        Without suffix, in a folder that exists.

    Returns
    -------
    (Path, Path)
        The PNG and the PDF.
    """
    png, pdf = stem.with_suffix(".png"), stem.with_suffix(".pdf")
    # Lay the figure out once, and not again for each format.
    layout = figure.get_layout_engine()
    if layout is not None:
        layout.execute(figure)
        figure.set_layout_engine("none")
    figure.savefig(png, metadata={"Software": None})
    # Without date and versions, equal figures give equal files.
    figure.savefig(pdf, metadata={"CreationDate": None, "Creator": None, "Producer": None})
    return png, pdf


def save_table(
    data: pd.DataFrame, path: Path, *, header: list[str], columns: Mapping[str, str]
) -> Path:
    """Write a CSV whose first lines, marked with ``#``, say where the numbers come from.

    Parameters
    ----------
    data : DataFrame
    path : Path
    header : list of str
        Lines of provenance.
    columns : mapping of str to str
        Unit and meaning of each column.
    """
    used = [f"{name}: {columns[name]}" for name in data.columns]
    lines = [f"# {line}" for line in [*header, "columns:", *(f"  {text}" for text in used)]]
    table = data.to_csv(index=False, float_format=_DIGITS, lineterminator="\n")
    path.write_text("\n".join(lines) + "\n" + table, encoding="utf-8", newline="\n")
    return path


RICE_RUINA = "#0072B2"
LINKER_DIETERICH = "#D55E00"
ELASTO_PLASTIC = "#00805B"
STATED = "#8A5A00"
STATED_FILL = "#E9C46A"
GREY = "#767676"

#: Styles by name, for figures that are described in a file.
COLOURS = {
    "rice-ruina": RICE_RUINA,
    "linker-dieterich": LINKER_DIETERICH,
    "linker-dieterich-low": "#B0528F",
    "elasto-plastic": ELASTO_PLASTIC,
    # Curves with inertia, together with curves of the same law without it.
    "inertia": "#2B2B33",
    # A variant of a law, or of the machine.
    "variant": "#C05A00",
    "stated": STATED,
    "stated-fill": STATED_FILL,
    # Measured and simulated points.
    "points": "#B3261E",
    "grey": GREY,
}
DASHES = {"slow": "solid", "fast": "dashed"}


def reason_of_gaps(missing: Any, reasons: Any, width: int = 100) -> str:
    """Why a figure has gaps, in lines of up to `width` characters; empty for one without.

    Parameters
    ----------
    missing : bool array
        Points without a value.
    reasons : str array
        Sentence of each point, same shape.
    """
    texts = Counter(np.asarray(reasons)[np.asarray(missing, bool)].astype(str).tolist())
    if not texts:
        return ""
    text = texts.most_common(1)[0][0]
    # One reason has other numbers at other points.
    others = len({re.sub(r"\d[\d.e+-]*", "", t) for t in texts}) - 1
    more = f" (and {others} other reason{'s' * (others > 1)})" if others else ""
    gaps = f"{texts.total()} of {np.size(missing)} points have no value: {text}{more}"
    return fill(gaps, width)


@contextmanager
def style() -> Iterator[None]:
    """The project's style for drawing and saving; the user's style is restored."""
    from matplotlib.style import context

    path = files("asperity.figures") / "asperity.mplstyle"
    with as_file(path) as file, context(file, after_reset=True):
        yield


class Picture(Figure):
    """A figure that a notebook shows without pyplot, whose backend may not be installed."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The picture, and its size (px) on a screen: half of that for sharp lines on any."""
        file = BytesIO()
        with style():
            self.savefig(file, format="png", dpi=2 * self.dpi)
        width, height = (round(inches * self.dpi) for inches in self.get_size_inches())
        return file.getvalue(), {"width": width, "height": height}


@typed
def new_figure(width: float = 5.0, height: float = 3.5) -> Figure:
    """An empty figure (inches), not registered with pyplot."""
    return Picture(figsize=(width, height))


def letter_panels(axes: Sequence[Axes]) -> None:
    """Write (a), (b), ... into the upper left corners of the panels."""
    for axis, letter in zip(axes, ascii_lowercase, strict=False):
        axis.text(0.015, 0.96, f"({letter})", transform=axis.transAxes, va="top", fontsize=10)


def room_above(axis: Axes, share: float) -> None:
    """Leave a share of the height of the panel free above its curves, for a letter or a legend."""
    low, high = axis.get_ylim()
    axis.set_ylim(low, high + share * (high - low))


def three_panels(draw: Sequence[Callable[[Axes, Any], None]], measurement: Any) -> Figure:
    """A figure of three panels with letters, one above the other, each with its function."""
    figure = new_figure(5.0, 7.2)
    panels = figure.subplots(3, 1)
    for panel, drawn in zip(panels, draw, strict=True):
        drawn(panel, measurement)
    letter_panels(panels)
    return figure
