"""Summary of a reproduction, in a few lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from asperity._version import __version__
from asperity.papers.measured_points import CurveComparison
from asperity.parameters.display import count_text


@dataclass(frozen=True)
class ReproductionSummary:
    """Outcome of `asperity.papers.report.reproduce`.

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
        Those of them that did not converge; what is drawn leaves them out.
    claims : int
        Number of claims.
    tests : mapping of str to int
        Number of claims that the models could have contradicted, by verdict.
    exceptions : tuple of (str, str, str)
        Verdict, place and statement of each claim that is not reproduced.
    agreement : tuple of CurveComparison
        Of measured points with the curves, where points were given.
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
        rows = [
            ("figures", f"{self.figures} in figures/ (PNG, PDF), their numbers in data/ (CSV)"),
            ("solved", f"{self.points} points" + (f", {self.failed} failed" * bool(self.failed))),
            ("claims", f"{self.claims}, of which {tested}: {tests}"),
            *(("points", one.text) for one in self.agreement if not one.figure),
            ("time", f"{self.seconds:.1f} s"),
        ]
        head = f"{self.paper}, reproduced by asperity {__version__}"
        return [head, *(f"  {name:<9}{text}" for name, text in rows), *self._exception_lines()]

    def _exception_lines(self) -> list[str]:
        if not self.exceptions:
            return []
        width = max(len(place) for _, place, _ in self.exceptions)
        return [
            "Not reproduced as printed:",
            *(
                f"  {verdict:<9} {place:<{width}}  {statement}"
                for verdict, place, statement in self.exceptions
            ),
        ]
