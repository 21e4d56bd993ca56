"""What a reproduction came to, in a few lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from asperity._version import __version__


@dataclass(frozen=True)
class ReproductionSummary:
    """Outcome of `asperity.report.reproduce`.

    Attributes
    ----------
    folder : Path
        Where the report lies.
    figures : int
        Number of figures drawn.
    points : int
        Operating points solved for them.
    failed : int
        Those of them that did not converge; what is drawn leaves them out.
    verdicts : mapping of str to int
        Number of claims by verdict.
    exceptions : tuple of (str, str, str)
        Verdict, place and statement of each claim that is not reproduced.
    seconds : float
    """

    folder: Path
    figures: int
    points: int
    failed: int
    verdicts: Mapping[str, int]
    exceptions: tuple[tuple[str, str, str], ...]
    seconds: float

    @property
    def page(self) -> Path:
        """The page to open first."""
        return self.folder / "index.html"

    def lines(self) -> list[str]:
        """Lines of the table that the command prints."""
        claims = sum(self.verdicts.values())
        told = ", ".join(f"{count} {verdict}" for verdict, count in self.verdicts.items())
        rows = [
            ("figures", f"{self.figures} in figures/ (PNG, PDF), their numbers in data/ (CSV)"),
            ("points", f"{self.points} solved" + (f", {self.failed} failed" * bool(self.failed))),
            ("claims", f"{claims}: {told}" if claims else "none"),
            ("time", f"{self.seconds:.1f} s"),
        ]
        head = f"Bureau, Baumberger and Caroli (2000), reproduced by asperity {__version__}"
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
