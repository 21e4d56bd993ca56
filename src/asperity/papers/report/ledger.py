"""The ledger of claims as JSON, as CSV and as entries of the page."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from asperity._version import __version__
from asperity.materials import citation
from asperity.papers.ledger.claim import KINDS, Claim
from asperity.papers.report.markup import rich

if TYPE_CHECKING:
    from asperity.papers.paper import Paper

#: Verdicts in the order of the page, with the sign that goes before each and what it means.
VERDICTS: Mapping[str, tuple[str, str]] = {
    "reproduced": ("✓", "the models give what the paper states"),
    "misprint": ("✎", "a printed formula fails, the one derived from the paper's equations holds"),
    "differs": ("≠", "the models do not give what the paper states"),
}
#: What each kind of claim is.
KIND_TEXTS: Mapping[str, str] = {
    "test": "the models could have contradicted the statement",
    "fit": "a parameter was fitted to what is judged",
    "arithmetic": "the paper's printed numbers alone decide",
    "identity": "true of the model by construction",
}
_FIELDS = (
    "id", "place", "statement", "stated", "kind", "computed", "verdict", "rule", "how", "why"
)  # fmt: skip


def counts(claims: Sequence[Claim]) -> dict[str, int]:
    """Number of claims by verdict, zero included."""
    found = Counter[str](claim.verdict for claim in claims)
    return {verdict: found[verdict] for verdict in VERDICTS}


def counts_by_kind(claims: Sequence[Claim]) -> dict[str, dict[str, int]]:
    """Number of claims by kind and verdict."""
    return {kind: counts([c for c in claims if c.kind == kind]) for kind in KINDS}


def beside_text(claims: Sequence[Claim]) -> str:
    """How many claims are no tests, in a sentence; empty if all are."""
    parts = []
    for kind, one, several in (
        ("fit", "fit", "fits"),
        ("arithmetic", "calculation with printed numbers", "calculations with printed numbers"),
        ("identity", "identity", "identities"),
    ):
        own = counts([c for c in claims if c.kind == kind])
        total, others = sum(own.values()), sum(own.values()) - own["reproduced"]
        if total:
            name = one if total == 1 else several
            parts.append(f"{total} {name}" + f" ({others} not as stated)" * bool(others))
    return f"Counted apart: {', '.join(parts)}." if parts else ""


def write_json(paper: Paper, claims: Sequence[Claim], path: Path) -> None:
    """All claims with their numbers and sensitivities, and what they are about."""
    about = paper.contents.paper
    record = {
        "paper": citation(about.source) if about.source else about.short,
        "asperity_version": __version__,
        "verdicts": {name: meaning for name, (_, meaning) in VERDICTS.items()},
        "kinds": dict(KIND_TEXTS),
        "counts": counts_by_kind(claims),
        "uncertainties": {u.quantity: u.note for u in paper.contents.uncertainty},
        "claims": [claim.as_dict() for claim in claims],
    }
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8", newline="\n")


def write_csv(claims: Sequence[Claim], path: Path) -> None:
    """One claim a row, without its separate numbers."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(_FIELDS)
        table.writerows([getattr(claim, name) for name in _FIELDS] for claim in claims)


def chip(verdict: str) -> str:
    """A verdict as a coloured word with its sign, for eyes that do not see the colour."""
    sign = VERDICTS[verdict][0]
    return f'<span class="chip {verdict}"><span aria-hidden="true">{sign}</span> {verdict}</span>'


#: Filters: name in addresses, and what they show.
_FILTERS = (
    ("all", "all"),
    ("reproduced", "reproduced"),
    ("misprint", "misprint"),
    ("differs", "differs"),
    ("apart", "fits, arithmetic, identities"),
)


def tiles(claims: Sequence[Claim]) -> str:
    """Numbers of tests by verdict, each a link that shows those claims alone."""
    found = counts([claim for claim in claims if claim.is_test])
    own = "".join(
        f'<li class="{verdict}"><a href="#show-{verdict}"><b>{found[verdict]}</b> {verdict}'
        f"<span>{rich(meaning)}</span></a></li>"
        for verdict, (_, meaning) in VERDICTS.items()
    )
    return f'<ul class="tiles">{own}</ul>'


def entries(claims: Sequence[Claim]) -> str:
    """The ledger, each claim folded, with links that filter it without any script.

    A link to ``#show-misprint`` makes that element the page's target, and the style sheet hides
    the claims of other verdicts. Without such a target what is not as stated is shown; a link to a
    claim always shows it.
    """
    found = counts([claim for claim in claims if claim.is_test])
    totals = found | {"all": len(claims), "apart": sum(not claim.is_test for claim in claims)}
    anchors = "".join(f'<span class="filter" id="show-{key}"></span>' for key, _ in _FILTERS)
    links = "".join(
        f'<a href="#show-{key}">{name} <b>{totals[key]}</b></a>' for key, name in _FILTERS
    )
    rows = "\n".join(_entry(claim) for claim in claims)
    return (
        f'{anchors}<p class="filters" role="group" aria-label="Show claims">'
        f'<a href="#claims">not as stated <b>{_not_as_stated(claims)}</b></a>{links}</p>\n'
        f'<div class="claims">\n{rows}\n</div>'
    )


def _not_as_stated(claims: Sequence[Claim]) -> int:
    return sum(claim.verdict != "reproduced" for claim in claims)


def _entry(claim: Claim) -> str:
    kind = "test" if claim.is_test else "apart"
    notes = (
        ("", claim.why),
        ("Stated", claim.stated),
        ("Computed", claim.computed),
        ("How", claim.how),
        ("Rule", claim.rule),
        ("Within the uncertainties", sensitivity_text(claim)),
    )
    return (
        f'<details class="claim {claim.verdict} {kind}" id="{escape(claim.id)}">'
        f'<summary><span class="place">{rich(claim.place)}</span>'
        f'<span class="statement">{rich(claim.statement)}</span>'
        f'<span class="verdict">{chip(claim.verdict)}{_kind(claim)}</span></summary>'
        f"{''.join(_note(head, text) for head, text in notes)}"
        f'<p class="note"><a href="#{escape(claim.id)}">Link to this entry</a></p></details>'
    )


def _note(head: str, text: str) -> str:
    if not text:
        return ""
    return f"<p>{f'<b>{head}:</b> ' if head else ''}{rich(text)}</p>"


def _kind(claim: Claim) -> str:
    return "" if claim.is_test else f' <span class="kind">{claim.kind}</span>'


def sensitivity_text(claim: Claim) -> str:
    """The claim's numbers at the ends of the published uncertainties, in a line."""
    parts = []
    for own in claim.sensitivity:
        low, high = own.ends
        ranges = [f"{name} {a:.3g} to {b:.3g}" for name, (a, b) in _leading(own.numbers)]
        changed = [
            f"{verdict} at {end}"
            for end, verdict in zip((low, high), own.verdicts, strict=True)
            if verdict != claim.verdict
        ]
        text = f"{low} to {high}: {', '.join(ranges)}"
        parts.append(text + (f" ({', '.join(changed)})" if changed else ""))
    return "; ".join(parts)


def _leading(numbers: Mapping[str, tuple[float, float]]) -> list[tuple[str, tuple[float, float]]]:
    """The first and the last number: what lies between is in claims.json."""
    items = list(numbers.items())
    return items if len(items) <= 2 else [items[0], items[-1]]
