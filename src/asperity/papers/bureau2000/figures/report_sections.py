"""The figures as the report shows them: those of the paper, then the virtual experiment's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from asperity._version import __version__
from asperity.papers.bureau2000.figures.drawn import DRAWN, SCHEMATICS, Schematic
from asperity.papers.bureau2000.figures.observables import OBSERVABLES
from asperity.papers.bureau2000.figures.virtual import VIRTUAL_DRAWN
from asperity.papers.bureau2000.numbers import COLUMNS, FIGURES, FigureNumbers
from asperity.papers.bureau2000.virtual import (
    POINT_COLUMNS,
    VIRTUAL,
    SimulatedPoints,
    VirtualNumbers,
    experiment_beside,
    page_section,
)
from asperity.papers.paper import find_paper
from asperity.papers.report.parameters import provenance_lines
from asperity.papers.sections import FigureTable, PaperFigure, Section


@contextmanager
def sections() -> Iterator[Sequence[Section]]:
    """The report's sections; the virtual experiment is computed beside the first one."""
    with experiment_beside() as readings:
        yield _of_the_paper(), _of_the_experiment(readings)


def _of_the_paper() -> Section:
    # In the order of the paper, by the number in the name.
    makers = {own.name: _schematic_maker(own) for own in SCHEMATICS}
    makers |= {name: _maker(compute) for name, compute in zip(DRAWN, FIGURES, strict=True)}
    in_order = [makers[name] for name in sorted(makers)]
    return Section("figures", "Figures", in_order, observables=OBSERVABLES)


def _schematic_maker(own: Schematic) -> Callable[[], PaperFigure]:
    return lambda: PaperFigure(own.name, own.place, own.title, own.caption, own.alt, own.draw)


def _maker(compute: Callable[[], FigureNumbers]) -> Callable[[], PaperFigure]:
    return lambda: _figure(compute())


def _figure(numbers: FigureNumbers) -> PaperFigure:
    table = FigureTable(numbers.name, numbers.data, _provenance(numbers), numbers.columns)
    return PaperFigure(
        numbers.name,
        numbers.place,
        numbers.title,
        numbers.caption,
        numbers.alt,
        draw=lambda: DRAWN[numbers.name](numbers),
        tables=(table,),
        points=len(numbers.data),
        failed=numbers.failed,
    )


def _provenance(figure: FigureNumbers) -> list[str]:
    """What the first lines of a CSV say."""
    return [
        f"{figure.place} of Bureau, Baumberger and Caroli, Phys. Rev. E 62, 6810 (2000), as the "
        "models have it; no measured points"
        if figure.place.startswith("Figure")
        else f"{figure.title}; a figure of asperity, not of the paper",
        f"computed by asperity {__version__}: quasi-static periodic orbits, to 1e-8 relative",
        "parameters, where no column says otherwise (kind in brackets):",
        *provenance_lines(find_paper("bureau2000")),
        "read off the curves:",
        *(f"  {name} = {value:.12g}" for name, value in figure.scalars.items()),
    ]


def _of_the_experiment(readings: Callable[[], SimulatedPoints]) -> Section:
    simulated: list[VirtualNumbers] = []

    def maker(compute: Callable[[SimulatedPoints], VirtualNumbers]) -> Callable[[], PaperFigure]:
        def make() -> PaperFigure:
            numbers = compute(readings())
            simulated.append(numbers)
            return _simulated_figure(numbers)

        return make

    return Section(
        "experiment",
        "A virtual experiment",
        [maker(compute) for compute in VIRTUAL],
        before=lambda _: page_section.introduction(simulated),
        after=lambda _: page_section.recovered_table(simulated),
    )


def _simulated_figure(numbers: VirtualNumbers) -> PaperFigure:
    parameters = provenance_lines(find_paper("bureau2000"))
    heads = [
        page_section.provenance(numbers, what, parameters)
        for what in ("points", "the model's lines")
    ]
    return PaperFigure(
        numbers.name,
        numbers.place,
        numbers.title,
        numbers.caption,
        numbers.alt,
        draw=lambda: VIRTUAL_DRAWN[numbers.name](numbers),
        tables=(
            FigureTable(numbers.name, numbers.points, heads[0], POINT_COLUMNS),
            FigureTable(f"{numbers.name}-model", numbers.data, heads[1], COLUMNS),
        ),
        points=len(numbers.data),
        failed=numbers.failed,
    )
