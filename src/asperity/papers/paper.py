"""A published paper as a folder: claims.toml, checks, figures; found by its name.

A paper is a Python package with

- ``claims.toml``: what the paper is, its claims in words, their rules and kinds, its conclusions
  and the ends of its published uncertainties (`asperity.papers.ledger.contents`);
- ``checks``, a module or package: one function a claim, marked with `asperity.papers.ledger.check`,
  from the paper's numbers to a `CheckResult`. A function ``model`` there, if any, turns the numbers
  into what the checks are given, so that they can share what is computed once;
- ``figures``, a module or package: ``FIGURES``, functions that return a
  `asperity.papers.report.PaperFigure`; or ``sections``, a context manager that gives a sequence of
  `asperity.papers.report.Section`.

Papers of this package are its sub-packages; others register theirs as an entry point of the group
``asperity.papers``, NAME = "package".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import entry_points
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any

from asperity import materials
from asperity.errors import InputError, closest
from asperity.papers.code import guarded, guarded_check, guarded_section, imported
from asperity.papers.ledger.checks import find_checks
from asperity.papers.ledger.claim import Claim
from asperity.papers.ledger.contents import Contents, read_contents
from asperity.papers.ledger.headline import Headline, headlines
from asperity.papers.ledger.ledger import judge_claims
from asperity.parameters.arguments import shown

if TYPE_CHECKING:
    from types import ModuleType

    from asperity.materials import Material
    from asperity.papers.sections import Section

GROUP = "asperity.papers"
_WORDS = "claims.toml"


@dataclass(frozen=True)
class Paper:
    """A paper's claims, checks and figures.

    Attributes
    ----------
    name : str
        What `find_paper` knows it by.
    package : str
        The importable package that holds it.
    """

    name: str
    package: str

    @property
    def own(self) -> bool:
        """Whether it is a paper of this package."""
        return self.package.startswith("asperity.")

    @cached_property
    def contents(self) -> Contents:
        """What claims.toml holds."""
        imported(self.package)
        return read_contents(files(self.package).joinpath(_WORDS))

    @cached_property
    def numbers(self) -> Material:
        """The paper's printed numbers."""
        wanted = self.contents.paper.numbers
        if not wanted.endswith(".toml"):
            return materials.load(wanted)
        with as_file(files(self.package).joinpath(wanted)) as path:
            return materials.load(path)

    def ledger(
        self, *, sensitivity: bool = False, progress: Callable[[int, int], None] | None = None
    ) -> list[Claim]:
        """Compute all claims; see `asperity.papers.ledger.ledger.judge_claims`."""
        module = imported(f"{self.package}.checks")
        model: Callable[[Material], Any] = getattr(module, "model", lambda numbers: numbers)
        checks = find_checks(module)
        if not self.own:
            model = guarded(model, f"{self.package}.checks.model")
            where = f"{self.package}.checks, the check of"
            checks = {name: guarded_check(f, f"{where} '{name}'") for name, f in checks.items()}
        return judge_claims(
            self.contents,
            checks,
            self.numbers,
            model,
            sensitivity=sensitivity,
            progress=progress,
        )

    def headlines(self, claims: Sequence[Claim]) -> list[Headline]:
        """The paper's conclusions, decided by the verdicts on its claims."""
        return headlines(self.contents.headline, claims)

    def sections(self) -> AbstractContextManager[Sequence[Section]]:
        """The sections of its figures, in a context that ends what computes them."""
        module = imported(f"{self.package}.figures")
        if self.own:
            made: AbstractContextManager[Sequence[Section]] = module.sections()
            return made
        return self._sections(module)

    @contextmanager
    def _sections(self, module: ModuleType) -> Iterator[Sequence[Section]]:
        """The sections of a paper from outside the package."""
        from asperity.papers.sections import Section

        where = f"{self.package}.figures"
        if hasattr(module, "sections"):
            with module.sections() as made:
                yield tuple(guarded_section(section, self.package) for section in made)
            return
        figures = getattr(module, "FIGURES", None)
        if not isinstance(figures, Sequence) or not all(callable(f) for f in figures):
            raise InputError(
                f"{where} must have FIGURES, a tuple of functions, or sections, got "
                f"{shown(figures)}; write FIGURES = (first_figure,)"
            )
        yield (guarded_section(Section("figures", "Figures", tuple(figures)), self.package),)


def available() -> dict[str, str]:
    """Names of the papers that can be reproduced, and the package of each."""
    here = files("asperity.papers")
    found = {
        folder.name: f"asperity.papers.{folder.name}"
        for folder in here.iterdir()
        if folder.is_dir() and folder.joinpath(_WORDS).is_file()
    }
    for point in entry_points(group=GROUP):
        if found.setdefault(point.name, point.value) != point.value:
            raise InputError(
                f"paper must have a name of its own, got '{point.name}' of {point.value}, which "
                f"{found[point.name]} has; rename the entry point"
            )
    return found


def find_paper(name: str) -> Paper:
    """A paper by its name.

    Raises
    ------
    InputError
        If there is no such paper.
    """
    known = available()
    if name not in known:
        raise InputError(
            f"paper must be one of the papers that are installed, got '{name}'; "
            f"{closest(name, known)}"
        )
    return Paper(name, known[name])
