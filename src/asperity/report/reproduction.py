"""Everything that ``asperity reproduce`` writes."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from asperity._version import __version__
from asperity.figures.files import save_picture, save_table
from asperity.figures.paper import DRAWN, SCHEMATICS, Schematic
from asperity.figures.paper.virtual import VIRTUAL_DRAWN
from asperity.figures.style import style
from asperity.report import claims as ledger
from asperity.report import virtual
from asperity.report.folder import written_whole
from asperity.report.headlines import headlines
from asperity.report.page import Plate, build_page
from asperity.report.parameters import provenance_lines
from asperity.report.summary import ReproductionSummary
from asperity.study.paper import COLUMNS, FIGURES, FigureNumbers
from asperity.study.paper.virtual import (
    POINT_COLUMNS,
    VIRTUAL,
    Experiment,
    VirtualNumbers,
    experiment_beside,
)

if TYPE_CHECKING:
    from asperity.study.claims import Claim

#: Called with what is being done, the steps done and all steps.
Progress = Callable[[str, int, int], None]

_STEPS = 2 * len(FIGURES) + 2 * len(VIRTUAL) + len(SCHEMATICS) + 3


class _Counter:
    """Steps of the work, told to whoever asked."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress or (lambda *_: None)
        self._done = 0

    def begin(self, label: str) -> None:
        self._progress(label, self._done, _STEPS)
        self._done += 1

    def end(self) -> None:
        self._progress("done", _STEPS, _STEPS)


def reproduce(out: Path, progress: Progress | None = None) -> ReproductionSummary:
    """Write the figures, their numbers, the ledger of claims and the page that shows them.

    Parameters
    ----------
    out : Path
        Folder, made if absent. It receives figures/ (PNG, PDF), data/ (CSV), claims.json,
        claims.csv and index.html, all of them or none; other files in it are left alone.
    progress : callable, optional
        Called with (label, steps done, all steps) before each step.

    Returns
    -------
    ReproductionSummary

    Raises
    ------
    InputError
        If the folder cannot be written; before any work.
    """
    start = time.perf_counter()
    out = Path(out)
    steps = _Counter(progress)
    with written_whole(out) as folder, experiment_beside() as readings:
        figures = _compute(steps)
        plates = _draw(figures, folder, steps)
        steps.begin("claims")
        claims = _ledger()
        simulated = _simulate(readings, steps)
        plates += _draw_simulated(simulated, folder, steps)
        steps.begin("page")
        ledger.write_json(claims, folder / "claims.json")
        ledger.write_csv(claims, folder / "claims.csv")
        page = build_page(plates, claims, headlines(figures), simulated)
        (folder / "index.html").write_text(page, encoding="utf-8", newline="\n")
    steps.end()
    solved = [*figures.values(), *simulated]
    return ReproductionSummary(
        folder=out,
        figures=len(plates),
        points=sum(len(figure.data) for figure in solved),
        failed=sum(figure.failed for figure in solved),
        verdicts=ledger.counts(claims),
        exceptions=tuple(
            (c.verdict, c.place, c.statement) for c in claims if c.verdict != "reproduced"
        ),
        seconds=time.perf_counter() - start,
    )


def _ledger() -> Sequence[Claim]:
    from asperity.study.claims import ledger

    return ledger()


def _compute(steps: _Counter) -> Mapping[str, FigureNumbers]:
    found = {}
    for compute in FIGURES:
        steps.begin(f"numbers of {compute.__name__.replace('_', ' ')}")
        figure = compute()
        found[figure.name] = figure
    return found


def _simulate(readings: Callable[[], Experiment], steps: _Counter) -> list[VirtualNumbers]:
    steps.begin("simulated recordings")
    experiment = readings()
    found = []
    for compute in VIRTUAL:
        steps.begin(f"numbers of {compute.__name__.replace('_', ' ')}")
        found.append(compute(experiment))
    return found


def _draw(figures: Mapping[str, FigureNumbers], folder: Path, steps: _Counter) -> list[Plate]:
    """Draw all figures and write their numbers; returns them in the order of the paper."""
    pictures, tables = folder / "figures", folder / "data"
    pictures.mkdir()
    tables.mkdir()
    plates = []
    # The style also holds how pictures are saved.
    with style():
        for schematic in SCHEMATICS:
            steps.begin(schematic.place)
            png, _ = save_picture(schematic.draw(), pictures / schematic.name)
            plates.append(_plate(schematic, png, ()))
        for name, figure in figures.items():
            steps.begin(figure.place)
            png, _ = save_picture(DRAWN[name](figure), pictures / name)
            path = tables / f"{name}.csv"
            save_table(figure.data, path, header=_provenance(figure), columns=COLUMNS)
            plates.append(_plate(figure, png, (f"data/{name}.csv",)))
    return sorted(plates, key=lambda plate: plate.name)


def _draw_simulated(
    figures: Sequence[VirtualNumbers], folder: Path, steps: _Counter
) -> list[Plate]:
    """Draw the virtual experiment, and write its points and the model's lines."""
    pictures, tables = folder / "figures", folder / "data"
    plates = []
    with style():
        for figure in figures:
            steps.begin(figure.place)
            name = figure.name
            png, _ = save_picture(VIRTUAL_DRAWN[name](figure), pictures / name)
            head = virtual.provenance(figure, "points")
            save_table(figure.points, tables / f"{name}.csv", header=head, columns=POINT_COLUMNS)
            head = virtual.provenance(figure, "the model's lines")
            save_table(figure.data, tables / f"{name}-model.csv", header=head, columns=COLUMNS)
            plates.append(_plate(figure, png, (f"data/{name}.csv", f"data/{name}-model.csv")))
    return plates


def _plate(figure: FigureNumbers | Schematic, png: Path, tables: tuple[str, ...]) -> Plate:
    pictures = tuple(f"figures/{figure.name}.{kind}" for kind in ("png", "pdf"))
    return Plate(
        figure.name, figure.place, figure.title, figure.caption, figure.alt, png, pictures + tables
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
        *provenance_lines(),
        "read off the curves:",
        *(f"  {name} = {value:.12g}" for name, value in figure.scalars.items()),
    ]
