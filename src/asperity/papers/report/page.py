"""The one page that shows everything, with nothing to fetch from elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from asperity._version import __version__
from asperity.materials import citation
from asperity.papers.ledger.claim import Claim
from asperity.papers.ledger.headline import Headline
from asperity.papers.measured_points import RULE, CurveComparison
from asperity.papers.report import ledger
from asperity.papers.report.brief import brief
from asperity.papers.report.markup import cell, embedded_png, rich
from asperity.papers.report.parameters import table as parameter_table

if TYPE_CHECKING:
    from asperity.papers.ledger.contents import About
    from asperity.papers.paper import Paper


@dataclass(frozen=True)
class Plate:
    """A figure as the page shows it, and its files."""

    name: str
    place: str
    title: str
    caption: str
    alt: str
    png: Path
    files: Sequence[str]


@dataclass(frozen=True)
class PlateGroup:
    """A section of figures, with the HTML before and after them."""

    key: str
    title: str
    before: str
    plates: Sequence[Plate]
    after: str


def build_page(
    paper: Paper,
    groups: Sequence[PlateGroup],
    claims: Sequence[Claim],
    headlines: Sequence[Headline],
    agreement: Sequence[CurveComparison] = (),
) -> str:
    """The page as text.

    Parameters
    ----------
    paper : Paper
    groups : sequence of PlateGroup
        The sections of figures, in their order on the page.
    claims : sequence of Claim
    headlines : sequence of Headline
    agreement : sequence of CurveComparison
        Of measured points with the curves, where points were given.
    """
    about = paper.contents.paper
    parts = {
        "In brief": ("brief", brief(paper.contents.summary, headlines, claims)),
        **{
            group.title: (group.key, group.before + _figures(group.plates) + group.after)
            for group in groups
        },
        **({"Measured points": ("points", _agreement(agreement))} if agreement else {}),
        "Claims": ("claims", _ledger(paper, claims)),
        "Parameters": ("parameters", parameter_table(paper)),
        "Sources": ("sources", _sources(about)),
    }
    sections = "\n".join(
        f'<section id="{key}" aria-labelledby="{key}-head"><h2 id="{key}-head">{name}</h2>\n'
        f"{content}\n</section>"
        for name, (key, content) in parts.items()
    )
    links = "".join(f'<a href="#{key}">{name}</a>' for name, (key, _) in parts.items())
    style = files("asperity.papers.report").joinpath("page.css").read_text(encoding="utf-8")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>Reproduced: {escape(about.title)}</title>\n<style>\n{style}</style>\n</head>\n"
        "<body>\n"
        f"{_header(about, claims)}\n"
        f'<nav aria-label="Sections">{links}</nav>\n<main>\n{sections}\n</main>\n'
        f"<footer>Written by asperity {__version__}. Figures (PNG, PDF), their numbers (CSV) and "
        "the claims (JSON, CSV) lie beside this page.</footer>\n</body>\n</html>\n"
    )


def _header(about: About, claims: Sequence[Claim]) -> str:
    tests = sum(claim.is_test for claim in claims)
    return (
        f'<header><p class="kicker">A reproduction</p><h1>{escape(about.title)}</h1>'
        f'<p class="by">{escape(about.authors)}, {escape(about.journal)}</p>'
        f"<p>{len(claims)} quantitative and comparative statements of the paper, each computed "
        f"again from its own equations and numbers. {tests} of them could have come out "
        f"otherwise; each number leads to its entries:</p>{ledger.tiles(claims)}"
        f"<p>{escape(ledger.beside_text(claims))}</p></header>"
    )


def _agreement(agreement: Sequence[CurveComparison]) -> str:
    rows = "\n".join(
        '<tr role="row">'
        + cell(
            "Points",
            rich(one.figure.replace("-0", " ").replace("-", " ").capitalize()) or "all",
            "statement",
        )
        + cell("Quantity", rich(f"{one.observable}, {one.law}".lstrip(", ")), "statement")
        + cell("χ²", f"{one.chi_squared:.4g} for {one.points}, p = {one.p_value:.2g}", "computed")
        + cell("Verdict", _agreement_chip(one), "verdict")
        + "</tr>"
        for one in agreement
    )
    heads = ("Points", "Quantity", "χ²", "Verdict")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        f"<p>The points that were given, against the curves. Rule: {rich(RULE)}.</p>"
        '<table class="ledger" role="table" aria-label="Agreement of measured points">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table>'
        '<p class="files"><a href="data/points.csv">CSV</a> <a href="agreement.json">JSON</a></p>'
    )


def _agreement_chip(one: CurveComparison) -> str:
    kind, sign = {
        "agrees": ("reproduced", "✓"), "disagrees": ("differs", "≠"), "undecided": ("misprint", "?")
    }[one.verdict]  # fmt: skip
    return f'<span class="chip {kind}"><span aria-hidden="true">{sign}</span> {one.verdict}</span>'


def _figures(plates: Iterable[Plate]) -> str:
    return "\n".join(map(_figure, plates))


def _figure(plate: Plate) -> str:
    links = " ".join(f'<a href="{escape(name)}">{_kind(name)}</a>' for name in plate.files)
    return (
        f'<figure id="{plate.name}">{embedded_png(plate.png, plate.alt)}'
        f'<figcaption><p class="kicker">{plate.place}</p><h3>{rich(plate.title)}</h3>'
        f'<p>{rich(plate.caption)}</p><p class="files">{links}</p></figcaption></figure>'
    )


def _kind(name: str) -> str:
    kind = name.rsplit(".", 1)[1].upper()
    return f"{kind} of the model" if "-model." in name else kind


def _ledger(paper: Paper, claims: Sequence[Claim]) -> str:
    ends = "; ".join(rich(f"{u.quantity}: {u.note}") for u in paper.contents.uncertainty)
    varied = (
        "\n<p>Numbers that rest on uncertain quantities are computed at the ends of the "
        f"uncertainties too ({ends}).</p>"
    )
    return (
        "<p>Verdicts follow from a rule that was fixed beforehand for each claim. The measured "
        "points of a paper are in its figures only, not in its text; no claim here rests on "
        f"them.</p>{varied if ends else ''}\n{ledger.entries(claims)}"
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
