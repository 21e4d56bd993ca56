"""Paper: the figures of a published paper with its numbers moved, and the ledger of its claims."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from asperity.app.api.paper.curves import (
    element_numbers,
    inertial_curve,
    inertial_curves,
    layout,
    lines_of,
    printed_curves,
    printed_inertial_curve,
    stated_marks,
)
from asperity.app.api.paper.numbers import (
    ELEMENT,
    NUMBERS,
    PAPER,
    STEPS,
    TITLES,
    MovedFigure,
    check,
    moved_numbers,
    numbers_of,
    place_of,
    slider_of,
)
from asperity.app.endpoints import Answer, Job, Question
from asperity.app.preparation import Preparation
from asperity.materials import Material
from asperity.papers import find_paper
from asperity.papers.bureau2000.numbers import CURVES, replaced_numbers, stated
from asperity.papers.bureau2000.numbers.machine import EXT

_preparation: Preparation | None = None


class Nothing(Question):
    """A request without fields."""


def use(preparation: Preparation) -> None:
    """Let programs be compiled before they are needed."""
    global _preparation
    _preparation = preparation


def preparations() -> dict[str, Callable[[], Any]]:
    """Programs of each figure."""
    return {place_of(name): partial(printed_curves, name) for name in NUMBERS}


def overview(asked: Nothing) -> dict[str, Any]:
    """Figures with their sliders, and the words of all claims; nothing is solved."""
    contents = find_paper(PAPER).contents
    about = contents.paper
    return {
        "paper": {"title": about.title, "authors": about.authors, "journal": about.journal},
        "figures": [
            {
                "name": name,
                "place": place_of(name),
                "title": TITLES[name],
                "numbers": [slider_of(n, about.parameters) for n in numbers_of(name)],
                "inertia": name in CURVES and bool(inertial_curves(name)),
            }
            for name in NUMBERS
        ],
        "claims": [
            {
                "id": c.id, "place": c.place, "section": _section(c.place),
                "statement": c.statement, "stated": c.stated, "kind": c.kind,
                "how": " ".join(c.how.split()), "why": " ".join(c.why.split()),
            }
            for c in contents.claim
        ],
    }  # fmt: skip


def _section(place: str) -> str:
    """The section that a place such as "Section III.A.2; Fig. 7" names first."""
    found = re.search(r"Abstract|Appendix|Section [IVX]+(\.[A-Z])?", place)
    return found[0] if found else "Captions"


def figure(asked: MovedFigure) -> dict[str, Any]:
    """Curves of a figure as printed and with the moved numbers, and what the text states."""
    check(asked)
    numbers = moved_numbers(asked)
    answer: dict[str, Any] = {
        "numbers": {n: numbers[n].si for n in numbers_of(asked.figure)},
        "python": _python(asked, numbers),
        "command": f"asperity reproduce {PAPER} --out report",
    }
    if _preparation is not None and not _preparation.want(place_of(asked.figure)):
        return {**answer, "preparing": place_of(asked.figure)}
    before = printed_curves(asked.figure)
    with replaced_numbers(numbers, STEPS):
        after = lines_of(asked.figure) if asked.numbers else before
        marks = stated_marks(asked.figure)
        if asked.figure == ELEMENT:
            answer["element"] = element_numbers()
    return {**answer, **layout(asked.figure), "printed": before, "moved": after, "stated": marks}


def inertia(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Curves with the mass of the slider, a message each: ``curve``, and ``printed`` beside it.

    These have no method that always takes milliseconds.
    """
    asked = MovedFigure.model_validate(argument)
    numbers = moved_numbers(asked)
    names = (
        [curve.name for curve in inertial_curves(asked.figure)] if asked.figure in CURVES else []
    )
    for done, name in enumerate(names):

        def on_progress(points: int, total: int, done: int = done) -> None:
            report(progress=(done + points / total) / len(names))

        before = printed_inertial_curve(asked.figure, name, on_progress)
        after = before
        if asked.numbers:
            with replaced_numbers(numbers, STEPS):
                after = inertial_curve(asked.figure, name, on_progress)
        report(curve=after, printed=before, progress=(done + 1) / len(names))
    return {}


def _python(asked: MovedFigure, numbers: Material) -> str:
    changes = {name: numbers[name].value for name in asked.numbers}
    if asked.figure == ELEMENT:
        return (
            "from asperity.papers.bureau2000.numbers import printed, replaced_numbers\n"
            "from asperity.papers.bureau2000.numbers.period import one_period\n"
            "from asperity.papers.ledger.ledger import altered\n\n"
            f"numbers = altered(printed(), {changes!r})\n"
            "with replaced_numbers(numbers):\n"
            f'    table = one_period("{EXT}", V=1e-6, epsilon={stated().epsilon_eff})\n'
            "print(table)\n"
        )
    names = "CURVES, printed, replaced_numbers, solve_curves"
    return (
        f"from asperity.papers.bureau2000.numbers import {names}\n"
        "from asperity.papers.ledger.ledger import altered\n\n"
        f"numbers = altered(printed(), {changes!r})\n"
        "with replaced_numbers(numbers):\n"
        f'    table = solve_curves(CURVES["{asked.figure}"]())\n'
        "print(table)\n"
    )


def ledger(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Compute all claims; the number of finished ones is reported."""
    return {"claims": _claims(report)}


_found: list[dict[str, Any]] = []


def _claims(report: Callable[..., None]) -> list[dict[str, Any]]:
    """Verdicts by claim; a worker computes them once."""
    if not _found:
        own = find_paper(PAPER)

        def on_progress(done: int, total: int) -> None:
            report(finished=done, total=total)

        claims = own.ledger(progress=on_progress)
        fields = ("id", "computed", "rule", "verdict")
        _found.extend({f: getattr(c, f) for f in fields} for c in claims)
    return _found


ENDPOINTS = (
    Answer("paper", Nothing, overview),
    Answer("paper/figure", MovedFigure, figure),
    Job(
        "paper/inertia", MovedFigure, "asperity.app.api.paper:inertia", lane="search",
        check=check, seconds=120,
    ),
    Job("paper/ledger", Nothing, "asperity.app.api.paper:ledger", lane="paper", seconds=300),
)  # fmt: skip
