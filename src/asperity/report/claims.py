"""The ledger of claims as JSON, as CSV and as a table of the page."""

from __future__ import annotations

import csv
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity._version import __version__
from asperity.materials import citation
from asperity.report.markup import cell, rich

if TYPE_CHECKING:
    from asperity.study.claims import Claim

#: Verdicts in the order of the page, with the sign that goes before each and what it means.
VERDICTS: Mapping[str, tuple[str, str]] = {
    "reproduced": ("✓", "the models give what the paper states"),
    "misprint": ("✎", "a printed formula fails, the one derived from the paper's equations holds"),
    "differs": ("≠", "the models do not give what the paper states"),
}
_FIELDS = ("id", "place", "statement", "stated", "computed", "verdict", "rule", "how", "why")


def counts(claims: Sequence[Claim]) -> dict[str, int]:
    """Number of claims by verdict, zero included."""
    found = Counter[str](claim.verdict for claim in claims)
    return {verdict: found[verdict] for verdict in VERDICTS}


def write_json(claims: Sequence[Claim], path: Path) -> None:
    """All claims with their numbers, and what they are about."""
    record = {
        "paper": citation("bureau2000"),
        "asperity_version": __version__,
        "verdicts": {name: meaning for name, (_, meaning) in VERDICTS.items()},
        "counts": counts(claims),
        "claims": [_record(claim) for claim in claims],
    }
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8", newline="\n")


def write_csv(claims: Sequence[Claim], path: Path) -> None:
    """One claim a row, without its separate numbers."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(_FIELDS)
        table.writerows([_record(claim)[name] for name in _FIELDS] for claim in claims)


def _record(claim: Claim) -> dict[str, Any]:
    record = {name: getattr(claim, name, "") for name in _FIELDS}
    numbers = getattr(claim, "numbers", {})
    # JSON has no NaN and no infinity.
    return record | {"numbers": {k: v if math.isfinite(v) else None for k, v in numbers.items()}}


def chip(verdict: str) -> str:
    """A verdict as a coloured word with its sign, for eyes that do not see the colour."""
    sign = VERDICTS[verdict][0]
    return f'<span class="chip {verdict}"><span aria-hidden="true">{sign}</span> {verdict}</span>'


def table(claims: Sequence[Claim]) -> str:
    """The ledger, with radio buttons that filter it by verdict without any script."""
    found = counts(claims)
    choices = [("all", "all", len(claims)), *((v, v, found[v]) for v in VERDICTS)]
    buttons = "".join(
        f'<input type="radio" name="show" id="show-{key}"{" checked" * (key == "all")}>'
        f'<label for="show-{key}">{name} <b>{count}</b></label>'
        for key, name, count in choices
    )
    rows = "\n".join(_row(claim) for claim in claims)
    heads = ("Place", "The paper states", "Stated", "Computed", "Verdict")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        f'<div class="filter" role="group" aria-label="Show claims by verdict">{buttons}'
        '<table class="ledger" role="table" aria-label="Claims of the paper">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table></div>'
    )


def _row(claim: Claim) -> str:
    statement = f"<p>{rich(claim.statement)}</p>" + _note("", claim.why)
    computed = (
        f"<p>{rich(claim.computed)}</p>"
        + _note("How", claim.how)
        + _note("Rule", getattr(claim, "rule", ""))
    )
    cells = (
        cell("Place", rich(claim.place), "place"),
        cell("Statement", statement, "statement"),
        cell("Stated", rich(claim.stated), "stated"),
        cell("Computed", computed, "computed"),
        cell("Verdict", chip(claim.verdict), "verdict"),
    )
    return f'<tr role="row" class="{claim.verdict}" id="{escape(claim.id)}">{"".join(cells)}</tr>'


def _note(head: str, text: str) -> str:
    if not text:
        return ""
    return f'<p class="note">{f"<b>{head}:</b> " if head else ""}{rich(text)}</p>'
