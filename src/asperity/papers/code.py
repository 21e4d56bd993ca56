"""Code of papers from outside the package: what it raises becomes a sentence."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import ModuleType
from typing import TYPE_CHECKING, Any

from asperity.errors import InputError, printable
from asperity.papers.ledger.checks import CheckResult
from asperity.parameters.arguments import instance

if TYPE_CHECKING:
    from asperity.papers.sections import PaperFigure, Section


@contextmanager
def running(what: str) -> Iterator[None]:
    """Run code of a paper; what it raises becomes an `InputError` that names it."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # code of others may raise anything
        text = printable(" ".join(str(error).split()), 200)
        raise InputError(
            f"{what} must be code that runs, got {type(error).__name__}: {text}; correct it"
        ) from error


def imported(module: str) -> ModuleType:
    """A module of a paper.

    Raises
    ------
    InputError
        If it is missing or cannot be imported.
    """
    with running(module):
        return importlib.import_module(module)


def guarded(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    """A function of a paper, whose errors are sentences."""

    def run(*arguments: Any) -> Any:
        with running(what):
            return function(*arguments)

    return run


def guarded_check(check: Callable[[Any], Any], what: str) -> Callable[[Any], CheckResult]:
    """A check of a paper, which gives a `CheckResult`."""

    def run(model: Any) -> CheckResult:
        with running(what):
            found = check(model)
        return instance(found, CheckResult, what, "return CheckResult({...}, text)")

    return run


def guarded_section(section: Any, package: str) -> Section:
    """A section of a paper, whose figures are computed and drawn with their errors as sentences."""
    from asperity.papers.sections import Section

    own: Section = instance(section, Section, f"{package}.figures", "yield Sections")
    figures = tuple(_guarded_figure(f, f"{package}.figures") for f in own.figures)
    return replace(own, figures=figures)


def _guarded_figure(compute: Callable[[], Any], what: str) -> Callable[[], PaperFigure]:
    name = f"{what}.{getattr(compute, '__name__', 'figure')}"

    def run() -> PaperFigure:
        from asperity.papers.sections import PaperFigure

        with running(name):
            made = compute()
        figure: PaperFigure = instance(made, PaperFigure, name, "return a PaperFigure")
        return replace(figure, draw=guarded(figure.draw, f"{name}, draw"))

    return run
