"""Figures and their numbers on disk, the same bytes whenever the same numbers are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

#: Twelve digits: more than any method here is good for, and no noise of the last bit.
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
    # The date, and the versions of what wrote the file, would make equal figures differ.
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
