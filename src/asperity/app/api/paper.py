"""The Paper tab: figures of a paper with numbers that the user moves, and the paper's claims."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from asperity.app.api.operating_point import Name, Value
from asperity.app.endpoints import Answer, Job, Question
from asperity.app.preparation import is_ready
from asperity.errors import InputError, require
from asperity.ledger import Paper, altered, available, find_paper
from asperity.materials import Material
from asperity.parameters import obeying
from asperity.parameters.arguments import one_of
from asperity.units import KINDS, from_si

#: A slider without stated ends covers this factor on both sides of the printed number.
_FACTOR = 4.0
#: Largest factor between a number and the printed number: farther away the equations are so stiff
#: that curves take minutes.
_BEYOND = 100.0


class ChosenPaper(Question):
    """A request about a paper.

    Attributes
    ----------
    paper : str
        Its name; the first one in alphabetical order if it is empty.
    """

    paper: Name = ""


class MovedFigure(ChosenPaper):
    """A figure of a paper, and the moved numbers.

    Attributes
    ----------
    figure : str
    numbers : mapping of str to number or str
        SI, or texts with units, by the names of the paper's numbers; the others are as printed.
    """

    figure: Name
    numbers: Annotated[dict[Name, Value], Field(max_length=20, default_factory=dict)]


@cache
def _paper(name: str) -> Paper:
    return find_paper(name or None)


def preparations() -> dict[str, Callable[[], Any]]:
    """Programs of each figure."""
    tasks: dict[str, Callable[[], Any]] = {}
    for name in available():
        try:
            figures = list(_paper(name).tab)
        except InputError:
            continue  # reported when the page opens that paper
        tasks |= {_task(_paper(name), f): partial(_printed_lines, name, f) for f in figures}
    return tasks


def _task(paper: Paper, figure: str) -> str:
    return f"{paper.words.figures[figure].place} of {paper.name}"


@cache
def _printed_lines(paper: str, figure: str) -> list[dict[str, Any]]:
    return _paper(paper).tab[figure].lines(_paper(paper).numbers)


def overview(question: ChosenPaper) -> dict[str, Any]:
    """Papers, figures with their sliders, and the words of all claims; nothing is solved."""
    paper = _paper(question.paper)
    about = paper.contents.paper
    return {
        "papers": [
            {"name": name, "short": _paper(name).contents.paper.short} for name in available()
        ],
        "paper": {
            "name": paper.name, "title": about.title, "authors": about.authors,
            "journal": about.journal,
        },
        "figures": [
            {
                "name": name,
                "place": words.place,
                "title": words.short or words.title,
                "numbers": [_slider(paper, number) for number in words.numbers],
                "inertia": bool(paper.tab[name].slow),
            }
            for name, words in paper.words.figures.items()
            if name in paper.tab
        ],
        "claims": [
            {
                "id": c.id, "place": c.place, "section": _section(c.place),
                "statement": c.statement, "stated": c.stated, "kind": c.kind,
                "how": " ".join(c.how.split()), "why": " ".join(c.why.split()),
            }
            for c in paper.contents.claim
        ],
    }  # fmt: skip


def _section(place: str) -> str:
    """The section, page or figure that a place such as "Section III.A.2; Fig. 7" names first."""
    section = re.search(r"Abstract|Appendix|Section [IVX]+(\.[A-Z])?|p\. \d+|Figure \d+", place)
    return section[0] if section else "Captions"


def _slider(paper: Paper, name: str) -> dict[str, Any]:
    """A number on the page: symbol, meaning, slider, and its place in the paper."""
    number, words = paper.numbers[name], paper.words.slider.get(name)
    symbol, meaning = paper.contents.paper.parameters.get(name, (name, ""))
    low, high = number.si / _FACTOR, number.si * _FACTOR
    if words is not None:
        symbol, meaning, low, high = words.label, words.meaning, words.low, words.high
    return {
        "name": name,
        "kind": number.dimension,
        "label": symbol,
        "meaning": meaning or number.note or name,
        "slider": {"value": number.si, "low": low, "high": high, "log": words is None},
        "origin": f"{number.kind}, {number.place}",
    }


def check(question: MovedFigure) -> None:
    """Raise `InputError` for an invalid figure or number, before a process is started."""
    known = _paper(question.paper).tab
    one_of(question.figure, known, "figure")
    _changes(question)


def _moved_numbers(question: MovedFigure) -> Material:
    """The numbers of the paper with the moved values."""
    return altered(_paper(question.paper).numbers, _changes(question))


def _changes(question: MovedFigure) -> dict[str, float]:
    """The moved numbers, in their printed units."""
    paper = _paper(question.paper)
    known = paper.words.figures[question.figure].numbers
    changes = {}
    for name, value in question.numbers.items():
        one_of(name, known, "numbers")
        number, slider = paper.numbers[name], paper.words.slider.get(name)
        si = float(obeying(value, name, number.dimension, "positive"))
        high = np.inf if slider is None else slider.high
        require(si <= high, name, f"be at most {high:g}", f"{si:g}", "lower it")
        near = number.si / _BEYOND <= si <= number.si * _BEYOND
        rule = f"be within a factor of {_BEYOND:g} of the printed {number}"
        got = f"{si:.3g} {KINDS[number.dimension].si}".strip()
        require(near, name, rule, got, "move it nearer")
        changes[name] = float(from_si(si, number.unit, number.dimension))
    return changes


def figure(question: MovedFigure) -> dict[str, Any]:
    """Curves of a figure with the printed and with the moved numbers, and the text's statements."""
    check(question)
    paper, numbers = _paper(question.paper), _moved_numbers(question)
    words, chosen = paper.words, paper.tab[question.figure]
    answer: dict[str, Any] = {
        "numbers": {n: numbers[n].si for n in words.figures[question.figure].numbers},
        "python": chosen.python(_changes(question)),
        "command": "# no command draws the figures with moved numbers: copy as Python"
        if question.numbers
        else f"asperity reproduce {paper.name} --out report",
    }
    task = _task(paper, question.figure)
    if not is_ready(task):
        return {**answer, "preparing": task}
    before = _printed_lines(paper.name, question.figure)
    after = chosen.lines(numbers) if question.numbers else before

    def axis(column: str) -> dict[str, Any]:
        label = words.label.get(column, column)
        return {"column": column, "label": label, "log": column in chosen.logarithmic}

    return {
        **answer,
        **chosen.extras(numbers),
        "x": axis(chosen.x),
        "rows": [axis(column) for column in chosen.rows],
        "printed": before,
        "moved": after,
        "stated": chosen.marks(numbers),
    }


_slow_as_printed: dict[tuple[str, str, str], dict[str, Any]] = {}


def inertia(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Slow lines, one a message: ``curve``, and ``printed`` with the printed numbers."""
    question = MovedFigure(**argument)
    paper, numbers = _paper(question.paper), _moved_numbers(question)
    chosen = paper.tab[question.figure]
    for done, name in enumerate(chosen.slow):
        assert chosen.slow_line is not None  # a figure with slow lines has what computes them

        def on_progress(points: int, total: int, done: int = done) -> None:
            report(progress=(done + points / total) / len(chosen.slow))

        key = paper.name, question.figure, name
        if key not in _slow_as_printed:
            _slow_as_printed[key] = chosen.slow_line(paper.numbers, name, on_progress)
        before = after = _slow_as_printed[key]
        if question.numbers:
            after = chosen.slow_line(numbers, name, on_progress)
        report(curve=after, printed=before, progress=(done + 1) / len(chosen.slow))
    return {}


_judged: dict[str, list[dict[str, Any]]] = {}


def ledger(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Verdicts by claim, which a worker computes once; the number of finished ones is reported."""
    paper = _paper(ChosenPaper(**argument).paper)
    if paper.name not in _judged:

        def on_progress(done: int, total: int) -> None:
            report(finished=done, total=total)

        fields = ("id", "computed", "rule", "verdict")
        claims = paper.ledger(progress=on_progress)
        _judged[paper.name] = [{f: getattr(c, f) for f in fields} for c in claims]
    return {"claims": _judged[paper.name]}


ENDPOINTS = (
    Answer("paper", ChosenPaper, overview),
    Answer("paper/figure", MovedFigure, figure),
    Job(
        "paper/inertia", MovedFigure, "asperity.app.api.paper:inertia", lane="search",
        check=check, seconds=120,
    ),
    Job("paper/ledger", ChosenPaper, "asperity.app.api.paper:ledger", lane="paper", seconds=300),
)  # fmt: skip
