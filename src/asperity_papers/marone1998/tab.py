"""Figures whose numbers can be moved on the browser page."""

from __future__ import annotations

from functools import partial

from asperity.ledger import TabFigure
from asperity_papers.marone1998.figures import moved_lines

_PYTHON = """\
from asperity import materials
from asperity.ledger import altered
from asperity_papers.marone1998.figures import NUMBERS
from asperity_papers.marone1998.laboratory import Laboratory

numbers = altered(materials.load("marone1998"), {changes!r})
print(NUMBERS["{name}"](Laboratory(numbers)).data)
"""


def _figure(name: str, x: str, y: str, *logarithmic: str) -> TabFigure:
    python = lambda changes: _PYTHON.format(name=name, changes=dict(changes))  # noqa: E731
    return TabFigure(x, (y,), partial(moved_lines, name), python, logarithmic)


FIGURES = {
    "figure-02": _figure("figure-02", "load", "friction"),
    "figure-03": _figure("figure-03", "hold_time", "healing", "hold_time"),
    "figure-05": _figure("figure-05", "over", "friction", "over"),
}
