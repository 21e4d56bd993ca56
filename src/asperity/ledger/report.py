"""`reproduce`: figures, tables and the ledger of a paper, and a page with all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from asperity._version import __version__
from asperity.ledger.claims import Claim
from asperity.ledger.contents import KINDS
from asperity.ledger.page import KIND_TEXTS, VERDICT_TEXTS, build_page, counts
from asperity.ledger.paper import Paper
from asperity.ledger.points import CurveComparison, MeasuredPoints, check_names
from asperity.materials import citation
from asperity.outputs import write_table, written_folder
from asperity.outputs.json import to_json
from asperity.outputs.sections import aligned
from asperity.parameters.arguments import FilePath, typed
from asperity.parameters.parameter import count_text

if TYPE_CHECKING:
    from asperity.ledger.figures import PaperFigure, Section

#: Called with the number of finished steps, of all steps, and the name of the present step.
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class ReproductionSummary:
    """Outcome of `reproduce`.

    Attributes
    ----------
    paper : str
        Authors and year.
    folder : Path
        Where the report lies.
    figures : int
        Number of figures drawn.
    points : int
        Operating points solved for them.
    failed : int
        Number of points that did not converge; figures leave them out.
    claims : int
        Number of claims.
    tests : mapping of str to int
        Number of claims that the models could have contradicted, by verdict.
    exceptions : tuple of (str, str, str)
        Verdict, place and statement of each claim that is not reproduced.
    agreement : tuple of CurveComparison
        Agreement of measured points with the curves, where points were given.
    seconds : float
    """

    paper: str
    folder: Path
    figures: int
    points: int
    failed: int
    claims: int
    tests: Mapping[str, int]
    exceptions: tuple[tuple[str, str, str], ...]
    agreement: tuple[CurveComparison, ...]
    seconds: float

    @property
    def page(self) -> Path:
        """The page to open first."""
        return self.folder / "index.html"

    def lines(self) -> list[str]:
        """Lines of the table that the command prints."""
        tests = ", ".join(f"{count} {verdict}" for verdict, count in self.tests.items())
        tested = count_text(sum(self.tests.values()), "test")
        failed = f", {self.failed} failed" if self.failed else ""
        rows = [
            ("figures", f"{self.figures} in figures/ (PNG, PDF), their numbers in data/ (CSV)"),
            *([("solved", f"{self.points} points{failed}")] if self.points else []),
            ("claims", f"{self.claims}, of which {tested}: {tests}"),
            *(("points", one.text) for one in self.agreement if not one.figure),
            ("time", f"{self.seconds:.1f} s"),
        ]
        head = f"{self.paper}, reproduced by asperity {__version__}"
        lines = [head, *(f"  {name:<9}{text}" for name, text in rows)]
        if self.exceptions:
            lines += ["Not reproduced as printed:", *aligned(self.exceptions, "  ").splitlines()]
        return lines


@typed
def reproduce(
    paper: Paper,
    out: FilePath,
    progress: Progress | None = None,
    *,
    data: FilePath | None = None,
) -> ReproductionSummary:
    """Write the figures of a paper, their numbers, the ledger of its claims and the report page.

    Parameters
    ----------
    paper : Paper
    out : path
        Folder, made if absent. It receives figures/ (PNG, PDF), data/ (CSV), claims.json,
        claims.csv and index.html, all of them or none; other files in it are left alone.
    progress : callable, optional
        Called before each step with the steps done, all steps, and a label of the step.
    data : path, optional
        CSV of measured or digitised points (`asperity.ledger.points.read_points`), which
        are drawn on the figures and compared with their curves; data/points.csv and
        agreement.json are written too.

    Returns
    -------
    ReproductionSummary

    Raises
    ------
    InputError
        If the folder cannot be written, or the file of points breaks a rule. Points of an unknown
        curve or beyond its ends are found when their figure is computed, other mistakes at once.
    """
    start = time.perf_counter()
    out = Path(out)
    points = MeasuredPoints() if data is None else MeasuredPoints.read(Path(data))
    with written_folder(out) as folder, paper.sections() as sections:
        observables = {k: v for section in sections for k, v in section.observables.items()}
        check_names(points.points, observables, points.name)
        total, done = sum(2 * len(section.figures) for section in sections) + 2, count()

        def begin(label: str) -> None:
            if progress is not None:
                progress(next(done), total, label)

        for name in ("figures", "data"):
            (folder / name).mkdir()
        shown = [_show(section, folder, begin, points) for section in sections[:1]]
        # Later sections may be computed in another process at the same time.
        begin("claims")
        claims = paper.ledger(sensitivity=True)
        shown += [_show(section, folder, begin, points) for section in sections[1:]]
        begin("page")
        _write_json(paper, claims, folder / "claims.json")
        # The separate numbers of claims are in claims.json only.
        rows = ([getattr(claim, name) for name in _FIELDS] for claim in claims)
        write_table(folder / "claims.csv", _FIELDS, rows)
        agreement = points.write(folder)
        page = build_page(paper, folder, shown, claims, paper.headlines(claims), agreement)
        (folder / "index.html").write_text(page, encoding="utf-8", newline="\n")
    begin("done")
    figures = [figure for _, drawn in shown for figure in drawn]
    return ReproductionSummary(
        paper=paper.contents.paper.short,
        folder=out,
        figures=len(figures),
        points=sum(figure.points for figure in figures),
        failed=sum(figure.failed for figure in figures),
        claims=len(claims),
        tests=counts([claim for claim in claims if claim.is_test]),
        exceptions=tuple(
            (c.verdict, c.place, c.statement) for c in claims if c.verdict != "reproduced"
        ),
        agreement=tuple(agreement),
        seconds=time.perf_counter() - start,
    )


def _show(
    section: Section, folder: Path, begin: Callable[[str], None], points: MeasuredPoints
) -> tuple[Section, list[PaperFigure]]:
    """Compute and draw the figures of a section, and write their tables."""
    from asperity.figures.style import save_picture, save_table, style

    figures = []
    for compute in section.figures:
        begin(f"numbers of {section.title.lower()}")
        figures.append(points.add(compute(), section.observables))
    # The style also says how pictures are saved.
    with style():
        for figure in figures:
            begin(figure.place)
            save_picture(figure.draw(), folder / "figures" / figure.name)
            for table in figure.tables:
                path = folder / "data" / f"{table.name}.csv"
                save_table(table.data, path, header=list(table.header), columns=table.columns)
    return section, figures


_FIELDS = (
    "id", "place", "statement", "stated", "kind", "computed", "verdict", "rule", "how", "why"
)  # fmt: skip


def _write_json(paper: Paper, claims: Sequence[Claim], path: Path) -> None:
    """All claims with their numbers and sensitivities, and the paper."""
    about = paper.contents.paper
    record = {
        "paper": citation(about.source) if about.source else about.short,
        "asperity_version": __version__,
        "verdicts": {name: meaning for name, (_, meaning) in VERDICT_TEXTS.items()},
        "kinds": dict(KIND_TEXTS),
        "counts": {k: counts([c for c in claims if c.kind == k]) for k in KINDS},
        "uncertainties": {u.quantity: u.note for u in paper.contents.uncertainty},
        "claims": [claim.as_dict() for claim in claims],
    }
    path.write_text(to_json(record, indent=2) + "\n", encoding="utf-8", newline="\n")
