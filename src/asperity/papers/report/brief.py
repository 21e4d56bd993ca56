"""The head of the report: what the paper comes to, in a few sentences, and its conclusions."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from asperity.papers.ledger.claim import Claim
from asperity.papers.ledger.contents import SummaryWords
from asperity.papers.ledger.headline import Headline
from asperity.papers.report.markup import cell, rich


def brief(
    words: Sequence[SummaryWords], headlines: Sequence[Headline], claims: Sequence[Claim]
) -> str:
    """The paragraphs of the summary, then the table of conclusions."""
    known = {claim.id: claim for claim in claims}
    paragraphs = "\n".join(_paragraph(own, known) for own in words)
    return f'<div class="summary">\n{paragraphs}\n</div>\n{_conclusions(headlines, known)}'


def _paragraph(words: SummaryWords, claims: dict[str, Claim]) -> str:
    computed = {name: claim.computed for name, claim in claims.items()}
    several = len(words.sentences) > 1
    items = [
        rich(sentence.format_map(computed)) + _links(words.claims_of(sentence), claims)
        for sentence in words.sentences
    ]
    text = _list(items, "ol") if several else f"<p>{items[0]}</p>"
    listed = [claim for claim in claims.values() if claim.verdict == words.verdict]
    if words.verdict:
        entries = [
            f'<a href="#{escape(claim.id)}">{rich(claim.place)}</a>: {rich(claim.statement)}'
            for claim in listed
        ]
        text += _list(entries, "ul")
    return f'<div class="card"><h3>{rich(words.title)}</h3>{text}</div>'


def _list(items: Sequence[str], kind: str) -> str:
    return f"<{kind}>" + "".join(f"<li>{item}</li>" for item in items) + f"</{kind}>"


def _links(names: Sequence[str], claims: dict[str, Claim]) -> str:
    """A link to the entry of each claim that a sentence quotes."""
    return "".join(
        f' <a class="entry" href="#{escape(name)}">{rich(claims[name].place)}</a>' for name in names
    )


def _conclusions(headlines: Sequence[Headline], claims: dict[str, Claim]) -> str:
    rows = "\n".join(
        '<tr role="row">'
        + cell("The paper concludes", rich(h.claim), "statement")
        + cell("Found here", rich(h.found), "computed")
        + cell("Holds?", _standing(h) + _basis(h, claims), "verdict")
        + "</tr>"
        for h in headlines
    )
    heads = ("The paper concludes", "Found here", "Holds?")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        "<h3>The paper’s conclusions</h3>"
        '<table class="ledger brief" role="table" aria-label="Conclusions of the paper">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table>'
    )


def _standing(headline: Headline) -> str:
    kind, sign = ("reproduced", "✓") if headline.holds else ("differs", "≠")
    if headline.standing == "undecided":
        kind, sign = "misprint", "?"
    mark = f'<span aria-hidden="true">{sign}</span>'
    return f'<span class="chip {kind}">{mark} {headline.standing}</span>'


def _basis(headline: Headline, claims: dict[str, Claim]) -> str:
    """Links to the claims that decide."""
    links = ", ".join(
        f'<a href="#{escape(name)}" aria-label="claim {escape(name)}">{n}</a>'
        for n, name in enumerate((n for n in headline.claims if n in claims), 1)
    )
    return f'<p class="note">by claims {links}</p>' if links else ""
