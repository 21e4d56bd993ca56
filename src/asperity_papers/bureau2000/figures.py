"""The figures as the report shows them: those of the paper, then the virtual experiment's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial

import pandas as pd

import asperity as asp
from asperity.ledger import FigureNumbers, PaperFigure, Section
from asperity_papers.bureau2000 import motion, response_figures as curves, schematics, stability
from asperity_papers.bureau2000.curves import WORDS
from asperity_papers.bureau2000.machine import PAPER, Machine
from asperity_papers.bureau2000.recordings import SimulatedPoints, experiment_in_background
from asperity_papers.bureau2000.virtual import (
    VIRTUAL,
    VirtualFigure,
    introduction,
    provenance,
    recovered_table,
)

#: Figures made of curves: those of the paper, and four that are not in it.
_OF_THE_PAPER = [getattr(curves, f"figure_{n}") for n in (2, 3, 4, 5, 6, 7, 8, 9, 11)]
_FURTHER = (
    *(stability.floquet_figure, curves.phase_figure),
    *(motion.resonance_figure, curves.law_figure),
)
#: The function that computes each figure.
NUMBERS: Mapping[str, Callable[[Machine], FigureNumbers]] = {
    **{figure.name: figure for figure in (*_OF_THE_PAPER, *_FURTHER)},
    "figure-13": motion.period_figure,
}
#: Lines of each figure of the paper.
CURVES = {figure.name: figure.curves for figure in _OF_THE_PAPER}
#: Figures without numbers.
SCHEMATICS = ("figure-01", "figure-10")


@contextmanager
def sections() -> Iterator[Sequence[Section]]:
    """The report's sections; the virtual experiment is computed while the first one is."""
    with experiment_in_background() as readings:
        yield _of_the_paper(), _of_the_experiment(readings)


def _of_the_paper() -> Section:
    makers: dict[str, Callable[[], PaperFigure]] = {
        **{name: partial(_schematic, name) for name in SCHEMATICS},
        **{name: partial(_figure, compute) for name, compute in NUMBERS.items()},
    }
    observables = {name: WORDS.figures[name].observables for name in CURVES}
    in_order = [makers[name] for name in sorted(makers)]
    return Section("figures", WORDS.section["figures"].title, in_order, observables)


def _schematic(name: str) -> PaperFigure:
    return WORDS.figure(FigureNumbers(name, pd.DataFrame()), {}, lambda _: schematics.draw(name))


def _figure(compute: Callable[[Machine], FigureNumbers]) -> PaperFigure:
    numbers = compute(Machine())
    words = WORDS.figures[numbers.name]
    in_paper = words.place.startswith("Figure")
    head = [
        f"{words.place} of Bureau, Baumberger and Caroli, Phys. Rev. E 62, 6810 (2000), as the "
        "models have it; no measured points"
        if in_paper
        else f"{words.title}; a figure of asperity, not of the paper",
        f"computed by asperity {asp.__version__}: quasi-static periodic orbits, to 1e-8 relative",
        "parameters, where no column says otherwise (kind in brackets):",
        *PAPER.parameter_lines(),
        "read off the curves:",
        *(f"  {name} = {value:.12g}" for name, value in numbers.scalars.items()),
    ]
    return WORDS.figure(numbers, {numbers.name: (numbers.data, head)})


def _of_the_experiment(readings: Callable[[], SimulatedPoints]) -> Section:
    simulated: list[VirtualFigure] = []

    def make(compute: Callable[[SimulatedPoints], VirtualFigure]) -> PaperFigure:
        figure = compute(readings())
        simulated.append(figure)
        return _simulated(figure)

    return Section(
        "experiment",
        WORDS.section["experiment"].title,
        [partial(make, compute) for compute in VIRTUAL],
        before=lambda _: introduction(simulated),
        after=lambda _: recovered_table(simulated),
    )


def _simulated(figure: VirtualFigure) -> PaperFigure:
    name = figure.numbers.name
    tables = {
        name: (figure.points, provenance(figure, "points")),
        f"{name}-model": (figure.numbers.data, provenance(figure, "the model's lines")),
    }
    return WORDS.figure(figure.numbers, tables)
