"""Everything that ``asperity reproduce`` writes."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from asperity.figures.files import save_picture, save_table
from asperity.figures.style import style
from asperity.outputs import written_folder
from asperity.papers.ledger.claim import VERDICTS, Claim
from asperity.papers.measured_points import CurveComparison
from asperity.papers.paper import Paper
from asperity.papers.report import ledger
from asperity.papers.report.measured import MeasuredPoints
from asperity.papers.report.page import Plate, PlateGroup, build_page
from asperity.papers.report.summary import ReproductionSummary
from asperity.papers.sections import PaperFigure, Section

#: Called with the steps done, all steps, and what is being done.
Progress = Callable[[int, int, str], None]


class _StepCounter:
    """Counts the steps of the work and reports them."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress = progress or (lambda *_: None)
        self._done, self._total = 0, total

    def begin(self, label: str) -> None:
        self._progress(self._done, self._total, label)
        self._done += 1

    def end(self) -> None:
        self._progress(self._total, self._total, "done")


def reproduce(
    paper: Paper,
    out: Path,
    progress: Progress | None = None,
    *,
    data: Path | None = None,
) -> ReproductionSummary:
    """Write a paper's figures, their numbers, the ledger of its claims and the page that shows all.

    Parameters
    ----------
    paper : Paper
    out : Path
        Folder, made if absent. It receives figures/ (PNG, PDF), data/ (CSV), claims.json,
        claims.csv and index.html, all of them or none; other files in it are left alone.
    progress : callable, optional
        Called before each step with the steps done, all steps, and a label of the step.
    data : Path, optional
        CSV of measured or digitised points (`asperity.papers.measured_points.read_points`), which
        are drawn on the figures and compared with their curves; data/points.csv and
        agreement.json are written too.

    Returns
    -------
    ReproductionSummary

    Raises
    ------
    InputError
        If the folder cannot be written, or the file of points breaks a rule; before any work,
        but for points of a curve that is not there or beyond its ends.
    """
    start = time.perf_counter()
    out = Path(out)
    points = MeasuredPoints() if data is None else MeasuredPoints.read(Path(data))
    with written_folder(out) as folder, paper.sections() as sections:
        points.check({k: v for section in sections for k, v in section.observables.items()})
        steps = _StepCounter(progress, sum(2 * len(section.figures) for section in sections) + 2)
        for name in ("figures", "data"):
            (folder / name).mkdir()
        shown = [_show(section, folder, steps, points) for section in sections[:1]]
        # What the later sections show may be computed in another process meanwhile.
        steps.begin("claims")
        claims = paper.ledger(sensitivity=True)
        shown += [_show(section, folder, steps, points) for section in sections[1:]]
        steps.begin("page")
        ledger.write_json(paper, claims, folder / "claims.json")
        ledger.write_csv(claims, folder / "claims.csv")
        agreement = points.write(folder)
        page = build_page(
            paper, [group for group, _ in shown], claims, paper.headlines(claims), agreement
        )
        (folder / "index.html").write_text(page, encoding="utf-8", newline="\n")
    steps.end()
    figures = [figure for _, own in shown for figure in own]
    return _summary(paper, out, figures, claims, agreement, time.perf_counter() - start)


def _show(
    section: Section, folder: Path, steps: _StepCounter, points: MeasuredPoints
) -> tuple[PlateGroup, list[PaperFigure]]:
    """Compute and draw the figures of a section, and write their tables."""
    figures = []
    for compute in section.figures:
        steps.begin(f"numbers of {section.title.lower()}")
        figures.append(points.add(compute(), section.observables))
    plates = []
    # The style also says how pictures are saved.
    with style():
        for figure in figures:
            steps.begin(figure.place)
            plates.append(_draw(figure, folder))
    group = PlateGroup(
        section.key, section.title, section.before(figures), plates, section.after(figures)
    )
    return group, figures


def _draw(figure: PaperFigure, folder: Path) -> Plate:
    png, _ = save_picture(figure.draw(), folder / "figures" / figure.name)
    for table in figure.tables:
        path = folder / "data" / f"{table.name}.csv"
        save_table(table.data, path, header=list(table.header), columns=table.columns)
    files = [f"figures/{figure.name}.{kind}" for kind in ("png", "pdf")]
    files += [f"data/{table.name}.csv" for table in figure.tables]
    return Plate(
        figure.name, figure.place, figure.title, figure.caption, figure.alt, png, tuple(files)
    )


def _summary(
    paper: Paper,
    out: Path,
    figures: Sequence[PaperFigure],
    claims: Sequence[Claim],
    agreement: Sequence[CurveComparison],
    seconds: float,
) -> ReproductionSummary:
    tests = Counter[str](claim.verdict for claim in claims if claim.is_test)
    return ReproductionSummary(
        paper=paper.contents.paper.short,
        folder=out,
        figures=len(figures),
        points=sum(figure.points for figure in figures),
        failed=sum(figure.failed for figure in figures),
        claims=len(claims),
        tests={verdict: tests[verdict] for verdict in VERDICTS},
        exceptions=tuple(
            (c.verdict, c.place, c.statement) for c in claims if c.verdict != "reproduced"
        ),
        agreement=tuple(agreement),
        seconds=seconds,
    )
