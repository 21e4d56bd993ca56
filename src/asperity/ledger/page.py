"""The report page of a paper: one HTML file without external resources."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from asperity.ledger.claims import Claim, Headline
from asperity.ledger.markup import embedded_png, rich, table
from asperity.ledger.points import RULE, CurveComparison
from asperity.ledger.sentences import fill, names_in
from asperity.materials import citation
from asperity.outputs.sections import html_page
from asperity.parameters.arguments import one_of

if TYPE_CHECKING:
    from asperity.ledger.contents import About, SummaryWords
    from asperity.ledger.figures import PaperFigure, Section
    from asperity.ledger.paper import Paper

#: Verdicts in the order of the page, with the sign and the meaning of each.
VERDICT_TEXTS: Mapping[str, tuple[str, str]] = {
    "reproduced": ("✓", "the models give what the paper states"),
    "misprint": ("✎", "a printed formula fails, the one derived from the paper's equations holds"),
    "differs": ("≠", "the models do not give what the paper states"),
    "undecided": ("?", "a number that the rule needs is missing, or the rule does not fit"),
}
#: Meaning of each kind of claim.
KIND_TEXTS: Mapping[str, str] = {
    "test": "the models could have contradicted the statement",
    "fit": "a parameter was fitted to what is judged",
    "arithmetic": "the paper's printed numbers alone decide",
    "identity": "true of the model by construction",
}


def build_page(
    paper: Paper,
    folder: Path,
    shown: Sequence[tuple[Section, Sequence[PaperFigure]]],
    claims: Sequence[Claim],
    headlines: Sequence[Headline],
    agreement: Sequence[CurveComparison] = (),
) -> str:
    """The page as text.

    Parameters
    ----------
    paper : Paper
    folder : Path
        Folder of the report, which has the pictures already.
    shown : sequence of (Section, sequence of PaperFigure)
        The sections in their order on the page, and their figures.
    claims : sequence of Claim
    headlines : sequence of Headline
    agreement : sequence of CurveComparison
        Agreement of measured points with the curves, where points were given.
    """
    about, known = paper.contents.paper, {claim.id: claim for claim in claims}
    pictures = {figure.name: _picture(figure, folder) for _, figures in shown for figure in figures}
    summary = "\n".join(_paragraph(words, known, pictures) for words in paper.contents.summary)
    brief = f'<div class="summary">\n{summary}\n</div>\n{_conclusions(headlines, known)}'
    parts = {
        "In brief": ("brief", brief),
        **{
            section.title: (
                section.key,
                section.before(figures)
                + "\n".join(_figure(figure, folder) for figure in figures)
                + section.after(figures),
            )
            for section, figures in shown
        },
        **({"Measured points": ("points", _agreement(agreement))} if agreement else {}),
        "Claims": ("claims", _ledger(paper, claims)),
        "Parameters": ("parameters", _parameters(paper)),
        "Sources": ("sources", _sources(about)),
    }
    head = (
        f'<p class="kicker">A reproduction</p><h1>{escape(about.title)}</h1>'
        f'<p class="by">{escape(about.authors)}, {escape(about.journal)}</p>'
        f"<p>{len(claims)} quantitative and comparative statements of the paper, each computed "
        "again from its own equations and numbers.</p>"
    )
    footer = (
        " Figures (PNG, PDF), their numbers (CSV) and the claims (JSON, CSV) are in the folder of "
        "this page."
    )
    return html_page(f"Reproduced: {about.title}", head, parts, footer)


def _agreement(agreement: Sequence[CurveComparison]) -> str:
    kinds = {"agrees": "reproduced", "disagrees": "differs", "undecided": "undecided"}
    rows = [
        (
            rich(curve.figure.replace("-0", " ").replace("-", " ").capitalize()) or "all",
            rich(f"{curve.observable}, {curve.law}".lstrip(", ")),
            f"{curve.chi_squared:.4g} for {curve.points}, p = {curve.p_value:.2g}",
            _chip(kinds[curve.verdict], curve.verdict),
        )
        for curve in agreement
    ]
    heads = {"Points": "statement", "Quantity": "statement", "χ²": "computed", "Verdict": "verdict"}
    return (
        f"<p>The points that were given, against the curves. Rule: {rich(RULE)}.</p>"
        f"{table(heads, rows, 'Agreement of measured points')}"
        '<p class="files"><a href="data/points.csv">CSV</a> <a href="agreement.json">JSON</a></p>'
    )


def _chip(kind: str, word: str) -> str:
    """A word in the colour and with the sign of a verdict: some readers do not see the colour."""
    sign, _ = VERDICT_TEXTS[kind]
    return f'<span class="chip {kind}"><span aria-hidden="true">{sign}</span> {word}</span>'


def _picture(shown: PaperFigure, folder: Path) -> str:
    """The picture of a figure with its title, as a link to its entry."""
    image = embedded_png(folder / f"figures/{shown.name}.png", shown.alt)
    return f'<a href="#{shown.name}">{image}<span>{shown.place}: {rich(shown.title)}</span></a>'


def _figure(shown: PaperFigure, folder: Path) -> str:
    files = [f"figures/{shown.name}.{kind}" for kind in ("png", "pdf")]
    files += [f"data/{table.name}.csv" for table in shown.tables]
    links = " ".join(
        f'<a href="{escape(name)}">{Path(name).suffix[1:].upper()}'
        f"{' of the model' * ('-model.' in name)}{' of the points' * ('-points.' in name)}</a>"
        for name in files
    )
    return (
        f'<figure id="{shown.name}">{embedded_png(folder / files[0], shown.alt)}'
        f'<figcaption><p class="kicker">{shown.place}</p><h3>{rich(shown.title)}</h3>'
        f'<p>{rich(shown.caption)}</p><p class="files">{links}</p></figcaption></figure>'
    )


def _ledger(paper: Paper, claims: Sequence[Claim]) -> str:
    ends = "; ".join(rich(f"{u.quantity}: {u.note}") for u in paper.contents.uncertainty)
    varied = (
        "\n<p>Numbers that follow from uncertain quantities are computed at the ends of the "
        f"uncertainties too ({ends}).</p>"
    )
    return (
        f"<p>{sum(claim.is_test for claim in claims)} of the {len(claims)} statements could have "
        f"come out otherwise; each number leads to its entries:</p>{_tiles(claims)}"
        f"<p>{escape(_counted_apart(claims))}</p>"
        "<p>Verdicts follow from a rule that was fixed beforehand for each claim.</p>"
        f"{varied if ends else ''}\n{_entries(claims)}"
    )


def _sources(about: About) -> str:
    keys = [key for key in (about.source, *about.citations) if key]
    entries = "\n".join(f"<li>{_reference(citation(key))}</li>" for key in keys)
    method = f"\n<p>{rich(about.method)}</p>" if about.method else ""
    return f"<ul>\n{entries}\n</ul>{method}"


def _reference(entry: str) -> str:
    """A BibTeX entry as a line of text; its DOI is the only address on the page."""
    field = {name: value.strip("{}") for name, value in re.findall(r"(\w+)\s*=\s*(\{.*\})", entry)}
    field = {name: value.replace("{", "").replace("}", "") for name, value in field.items()}
    where = " ".join(field[name] for name in ("journal", "volume") if name in field)
    text = f"{field['author'].replace(' and ', '; ')} ({field['year']}). {field['title']}. {where}"
    text = escape(f"{text}, {field['pages']}.".replace("--", "–"))
    if "doi" not in field:
        return text
    return f'{text} <a href="https://doi.org/{field["doi"]}">doi:{field["doi"]}</a>'


# --- The head of the page: summary and conclusions ------------------------------------------------


def _paragraph(words: SummaryWords, claims: dict[str, Claim], pictures: Mapping[str, str]) -> str:
    computed = {name: claim.computed for name, claim in claims.items()}
    items = [
        rich(fill(sentence, computed, "summary.sentences"))
        + "".join(
            f' <a class="entry" href="#{escape(name)}">{rich(claims[name].place)}</a>'
            for name in names_in(sentence)
        )
        for sentence in words.sentences
    ]
    text = _list(items, "ol") if len(items) > 1 else f"<p>{items[0]}</p>"
    if words.verdict:
        entries = [
            f'<a href="#{escape(claim.id)}">{rich(claim.place)}</a>: {rich(claim.statement)}'
            for claim in claims.values()
            if claim.verdict == words.verdict
        ]
        text += _list(entries, "ul")
    if words.figures:
        beside = "".join(
            pictures[one_of(name, pictures, "summary.figures")] for name in words.figures
        )
        text = f'<div class="beside">{beside}</div>{text}'
    return f'<div class="card"><h3>{rich(words.title)}</h3>{text}</div>'


def _list(items: Sequence[str], kind: str) -> str:
    return f"<{kind}>" + "".join(f"<li>{item}</li>" for item in items) + f"</{kind}>"


def _conclusions(headlines: Sequence[Headline], claims: dict[str, Claim]) -> str:
    rows = []
    for h in headlines:
        kind = "undecided" if h.standing == "undecided" else "differs"
        chip = _chip("reproduced" if h.holds else kind, h.standing)
        rows.append((rich(h.claim), rich(h.result), chip + _basis(h, claims)))
    heads = {"The paper concludes": "statement", "Computed here": "computed", "Holds?": "verdict"}
    return (
        "<h3>The paper’s conclusions</h3>"
        f"{table(heads, rows, 'Conclusions of the paper', 'ledger brief')}"
    )


def _basis(headline: Headline, claims: dict[str, Claim]) -> str:
    """Links to the claims that decide a conclusion."""
    links = ", ".join(
        f'<a href="#{escape(name)}" aria-label="claim {escape(name)}">{n}</a>'
        for n, name in enumerate((n for n in headline.claims if n in claims), 1)
    )
    return f'<p class="note">by claims {links}</p>' if links else ""


# --- The claims ----------------------------------------------------------------------------------


def counts(claims: Sequence[Claim]) -> dict[str, int]:
    """Number of claims by verdict; a zero is left out for "undecided" only."""
    number = Counter[str](claim.verdict for claim in claims)
    return {v: number[v] for v in VERDICT_TEXTS if number[v] or v != "undecided"}


def _counted_apart(claims: Sequence[Claim]) -> str:
    """How many claims are no tests, in a sentence; empty if all are."""
    parts = []
    for kind, singular, plural in (
        ("fit", "fit", "fits"),
        ("arithmetic", "calculation with printed numbers", "calculations with printed numbers"),
        ("identity", "identity", "identities"),
    ):
        verdicts = [claim.verdict for claim in claims if claim.kind == kind]
        others = len(verdicts) - verdicts.count("reproduced")
        if verdicts:
            name = singular if len(verdicts) == 1 else plural
            parts.append(f"{len(verdicts)} {name}" + f" ({others} not as stated)" * bool(others))
    return f"Counted apart: {', '.join(parts)}." if parts else ""


#: Filters: name in addresses, and what they show.
_FILTERS = (
    *((name, name) for name in ("all", *VERDICT_TEXTS)),
    ("apart", "fits, arithmetic, identities"),
)


def _tiles(claims: Sequence[Claim]) -> str:
    """Numbers of tests by verdict, each a link that shows those claims alone."""
    number = counts([claim for claim in claims if claim.is_test])
    tiles = "".join(
        f'<li class="{verdict}"><a href="#show-{verdict}"><b>{number[verdict]}</b> {verdict}'
        f"<span>{rich(meaning)}</span></a></li>"
        for verdict, (_, meaning) in VERDICT_TEXTS.items()
        if verdict in number
    )
    return f'<ul class="tiles">{tiles}</ul>'


def _entries(claims: Sequence[Claim]) -> str:
    """The ledger, each claim folded, with links that filter it without any script.

    A link to ``#show-misprint`` makes that element the page's target, and the style sheet hides
    the claims of other verdicts. Without such a target what is not as stated is shown; a link to a
    claim always shows it.
    """
    totals = counts([claim for claim in claims if claim.is_test])
    totals |= {"all": len(claims), "apart": sum(not claim.is_test for claim in claims)}
    filters = [(key, name) for key, name in _FILTERS if key in totals]
    anchors = "".join(f'<span class="filter" id="show-{key}"></span>' for key, _ in filters)
    links = "".join(
        f'<a href="#show-{key}">{name} <b>{totals[key]}</b></a>' for key, name in filters
    )
    others = sum(claim.verdict != "reproduced" for claim in claims)
    rows = "\n".join(_entry(claim) for claim in claims)
    return (
        f'{anchors}<p class="filters" role="group" aria-label="Show claims">'
        f'<a href="#claims">not as stated <b>{others}</b></a>{links}</p>\n'
        f'<div class="claims">\n{rows}\n</div>'
    )


def _entry(claim: Claim) -> str:
    kind = "test" if claim.is_test else "apart"
    counted_as = "" if claim.is_test else f' <span class="kind">{claim.kind}</span>'
    chip = _chip(claim.verdict, claim.verdict)
    notes = (
        ("", claim.why),
        ("Stated", claim.stated),
        ("Computed", claim.computed),
        ("How", claim.how),
        ("Rule", claim.rule),
        ("Within the uncertainties", sensitivity_text(claim)),
    )
    shown = [
        f"<p>{f'<b>{head}:</b> ' if head else ''}{rich(text)}</p>" for head, text in notes if text
    ]
    return (
        f'<details class="claim {claim.verdict} {kind}" id="{escape(claim.id)}">'
        f'<summary><span class="place">{rich(claim.place)}</span>'
        f'<span class="statement">{rich(claim.statement)}</span>'
        f'<span class="verdict">{chip}{counted_as}</span></summary>'
        f"{''.join(shown)}"
        f'<p class="note"><a href="#{escape(claim.id)}">Link to this entry</a></p></details>'
    )


def sensitivity_text(claim: Claim) -> str:
    """The claim's numbers at the ends of the published uncertainties, in a line."""
    parts = []
    for varied in claim.sensitivity:
        low, high = varied.ends
        items = list(varied.numbers.items())
        # claims.json has all of them.
        shown = items if len(items) <= 2 else [items[0], items[-1]]
        ranges = ", ".join(f"{name} {a:.3g} to {b:.3g}" for name, (a, b) in shown)
        changed = ", ".join(
            f"{verdict} at {end}"
            for end, verdict in zip((low, high), varied.verdicts, strict=True)
            if verdict != claim.verdict
        )
        parts.append(f"{low} to {high}: {ranges}" + (f" ({changed})" if changed else ""))
    return "; ".join(parts)


# --- The numbers of the paper ---------------------------------------------------------------------


def _parameters(paper: Paper) -> str:
    """The numbers with uncertainty, kind and place."""
    rows = []
    for name, (symbol, meaning) in paper.contents.paper.parameters.items():
        number = paper.numbers[name]
        value = str(number).replace(" um", " µm")
        texts = map(rich, (symbol, meaning, value, number.kind, number.place))
        rows.append((*texts, rich(number.note) or "–"))
    heads = {
        "Symbol": "symbol", "What it is": "statement", "Value": "stated", "Kind": "kind",
        "Place": "place", "Remark": "note",
    }  # fmt: skip
    return (
        "<p>As the paper gives them. <em>Fitted</em>: the result of a fit; <em>assumed</em> here, "
        "because the paper does not give it.</p>"
        f"{table(heads, rows, 'Parameters', 'ledger numbers')}"
    )
