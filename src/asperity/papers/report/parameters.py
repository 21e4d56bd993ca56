"""The numbers that the figures rest on, as the paper gives them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from asperity.materials import Number
from asperity.papers.report.markup import cell, rich

if TYPE_CHECKING:
    from asperity.papers.paper import Paper


def provenance_lines(paper: Paper) -> list[str]:
    """Name, value, unit and kind of every number shown, for the heads of the CSV files."""
    numbers = paper.numbers
    return [
        f"  {name} = {numbers[name]} ({numbers[name].kind})"
        for name in paper.contents.paper.parameters
    ]


def table(paper: Paper) -> str:
    """The numbers with uncertainty, kind and place."""
    rows = "\n".join(
        _row(*shown, paper.numbers[name]) for name, shown in paper.contents.paper.parameters.items()
    )
    heads = ("Symbol", "What it is", "Value", "Kind", "Place", "Remark")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        "<p>As the paper gives them. <em>Fitted</em> by its authors; <em>assumed</em> here, "
        "because the paper does not give it.</p>"
        '<table class="ledger numbers" role="table" aria-label="Parameters">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table>'
    )


def _row(symbol: str, meaning: str, number: Number) -> str:
    value = str(number).replace(" um", " µm")
    cells = (
        cell("Symbol", rich(symbol), "symbol"),
        cell("What it is", rich(meaning), "statement"),
        cell("Value", rich(value), "stated"),
        cell("Kind", number.kind, "kind"),
        cell("Place", rich(number.place), "place"),
        cell("Remark", rich(number.note) or "–", "note"),
    )
    return f'<tr role="row">{"".join(cells)}</tr>'
