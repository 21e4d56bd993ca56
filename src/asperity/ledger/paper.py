"""A published paper as a folder of claims, checks and figures, with an entry point.

A paper is a Python package, registered as an entry point of the group ``asperity.papers``,
NAME = "package". It holds

- ``claims.toml``: what the paper is, its claims in words, their rules and kinds, its conclusions
  and the ends of its published uncertainties (`asperity.ledger.contents`);
- ``checks``, a module or package: one function for each claim without formulas (``values``),
  marked with `asperity.ledger.check`, from the paper's numbers to computed numbers by name. A
  function ``model`` there, if any, turns the paper's numbers into the argument of the checks, an
  object that computes common results once; its attribute ``terms``, if any, maps names to functions
  and objects that formulas may use;
- ``figures.toml``: titles, captions and alternative texts of its figures, and what is drawn;
- ``figures``, a module or package: ``FIGURES``, functions that return a
  `asperity.ledger.PaperFigure`; or ``sections``, a context manager that gives a sequence of
  `asperity.ledger.Section`;
- ``tab``, a module, if the paper has figures with sliders on the browser page, a
  `asperity.ledger.TabFigure` each, and ``recipe``, a module, if it has a procedure from
  measurements to numbers (``asperity recipe``).
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import entry_points
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any

from asperity import materials
from asperity.errors import InputError, closest, code_of_others, require
from asperity.ledger.claims import (
    Claim,
    Headline,
    find_checks,
    headlines,
    judge_claims,
    printed_numbers,
)
from asperity.ledger.contents import Contents, read_contents
from asperity.ledger.figures import FiguresFile, PaperFigure, Section, TabFigure, figure_words
from asperity.parameters.arguments import of_type, shown, typed

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable
    from types import ModuleType

    from asperity.ledger.rules import AcceptanceRule
    from asperity.materials import Material

GROUP = "asperity.papers"


@dataclass(frozen=True)
class Paper:
    """A paper's claims, checks and figures.

    Exceptions of the paper's code are raised as `InputError` with the name of the code.

    Attributes
    ----------
    name : str
        Name of the entry point.
    package : str
        The importable package of the paper.
    """

    name: str
    package: str

    @cached_property
    def _folder(self) -> Traversable:
        """The folder of the package, if it can be imported."""
        self.module("")
        return files(self.package)

    @cached_property
    def words(self) -> FiguresFile:
        """The content of figures.toml; empty without this file."""
        has_words = self._folder.joinpath("figures.toml").is_file()
        return figure_words(self.package) if has_words else FiguresFile()

    @cached_property
    def tab(self) -> Mapping[str, TabFigure]:
        """The figures that the browser page can move, by name."""
        return self.module("tab").FIGURES if self.has("tab") else {}

    def module(self, name: str) -> ModuleType:
        """A module of the paper's package.

        Raises
        ------
        InputError
            If it is missing or cannot be imported.
        """
        with code_of_others(f"{self.package}.{name}".rstrip(".")):
            return importlib.import_module(f"{self.package}.{name}".rstrip("."))

    def has(self, name: str) -> bool:
        """Whether the paper's package has a module."""
        self.module("")
        return importlib.util.find_spec(f"{self.package}.{name}") is not None

    @cached_property
    def contents(self) -> Contents:
        """The content of claims.toml."""
        return read_contents(self._folder.joinpath("claims.toml"))

    @cached_property
    def numbers(self) -> Material:
        """The paper's printed numbers."""
        source = self.contents.paper.numbers
        if not source.endswith(".toml"):
            return materials.load(source)
        with as_file(self._folder.joinpath(source)) as path:
            return materials.load(path)

    def parameter_lines(self) -> list[str]:
        """Name, value and kind of every number that the report lists, for the heads of tables."""
        return [
            f"  {name} = {self.numbers[name]} ({self.numbers[name].kind})"
            for name in self.contents.paper.parameters
        ]

    def rule(self, claim: str) -> AcceptanceRule:
        """The rule of a claim of the paper, for further uses of the rule."""
        entry = next(entry for entry in self.contents.claim if entry.id == claim)
        return entry.rule.build(printed_numbers(self.numbers), claim)

    def ledger(
        self, *, sensitivity: bool = False, progress: Callable[[int, int], None] | None = None
    ) -> list[Claim]:
        """Compute all claims; see `asperity.ledger.claims.judge_claims`."""
        module = self.module("checks")
        model: Callable[[Material], Any] = getattr(module, "model", lambda numbers: numbers)
        where = f"{self.package}.checks"
        return judge_claims(
            self.contents,
            {
                name: code_of_others(f"{where}, the check of '{name}'")(check)
                for name, check in find_checks(module).items()
            },
            self.numbers,
            code_of_others(f"{where}.model")(model),
            sensitivity=sensitivity,
            progress=progress,
        )

    def headlines(self, claims: Sequence[Claim]) -> list[Headline]:
        """The paper's conclusions, decided by the verdicts on its claims."""
        return headlines(self.contents.headline, claims)

    @contextmanager
    def sections(self) -> Iterator[Sequence[Section]]:
        """The sections of the figures, in a context that ends their processes."""
        module, where = self.module("figures"), f"{self.package}.figures"
        if hasattr(module, "sections"):
            with module.sections() as sections:
                yield tuple(_guarded_section(section, where) for section in sections)
            return
        figures = getattr(module, "FIGURES", None)
        if not isinstance(figures, Sequence) or not all(callable(f) for f in figures):
            rule = "have FIGURES, a tuple of functions, or sections"
            raise InputError(where, rule, shown(figures), "write FIGURES = (first_figure,)")
        yield (_guarded_section(Section("figures", "Figures", tuple(figures)), where),)


def available() -> dict[str, str]:
    """Names of the papers that can be reproduced, and the package of each."""
    papers: dict[str, str] = {}
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        if papers.setdefault(point.name, point.value) != point.value:
            rule = "have a name that no other has"
            got = f"'{point.name}' of {point.value} and of {papers[point.name]}"
            raise InputError("paper", rule, got, "rename one of the entry points")
    return papers


@typed
def find_paper(name: str | None = None) -> Paper:
    """A paper by its name; without a name the first in alphabetical order.

    Raises
    ------
    InputError
        If there is no such paper, or no paper is installed.
    """
    papers = available()
    advice = "install asperity again, which brings its papers along"
    require(papers, "a paper", "be installed", f"no entry point of the group {GROUP}", advice)
    if name is None:
        name = next(iter(papers))
    if name not in papers:
        rule = "be one of the papers that are installed"
        raise InputError("paper", rule, f"'{name}'", closest(name, papers))
    return Paper(name, papers[name])


def _guarded_section(section: Any, where: str) -> Section:
    """A section of a paper; exceptions of its computations and drawings become `InputError`."""
    checked: Section = of_type(section, Section, where)
    return replace(checked, figures=tuple(_guarded_figure(f, where) for f in checked.figures))


def _guarded_figure(compute: Callable[[], Any], where: str) -> Callable[[], PaperFigure]:
    name = f"{where}.{getattr(compute, '__name__', 'figure')}"

    def run() -> PaperFigure:
        figure: PaperFigure = of_type(code_of_others(name)(compute)(), PaperFigure, name)
        return replace(figure, draw=code_of_others(f"{name}, draw")(figure.draw))

    return run
