"""The one page that shows everything, with nothing to fetch from elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from asperity._version import __version__
from asperity.materials import citation
from asperity.report import claims as ledger
from asperity.report import virtual
from asperity.report.headlines import Headline
from asperity.report.markup import cell, embedded_png, rich
from asperity.report.parameters import table as parameter_table

if TYPE_CHECKING:
    from asperity.study.claims import Claim
    from asperity.study.paper.virtual import VirtualNumbers

_TITLE = "Shear response of a frictional interface to a normal load modulation"
_AUTHORS = "L. Bureau, T. Baumberger and C. Caroli, Phys. Rev. E 62, 6810 (2000)"


@dataclass(frozen=True)
class Plate:
    """A figure as the page shows it: `FigureNumbers` or `Schematic`, and its files."""

    name: str
    place: str
    title: str
    caption: str
    alt: str
    png: Path
    files: Sequence[str]


def build_page(
    plates: Sequence[Plate],
    claims: Sequence[Claim],
    headlines: Sequence[Headline],
    experiment: Sequence[VirtualNumbers],
) -> str:
    """The page as text.

    Parameters
    ----------
    plates : sequence of Plate
        In the order of the paper; those of the experiment among them.
    claims : sequence of Claim
    headlines : sequence of Headline
    experiment : sequence of VirtualNumbers
    """
    simulated = {figure.name for figure in experiment}
    parts = {
        "In brief": ("brief", _brief(headlines)),
        "Figures": ("figures", _figures(p for p in plates if p.name not in simulated)),
        "A virtual experiment": (
            "experiment",
            virtual.introduction(experiment)
            + _figures(p for p in plates if p.name in simulated)
            + virtual.findings_table(experiment),
        ),
        "Claims": ("claims", _ledger(claims)),
        "Parameters": ("parameters", parameter_table()),
        "Sources": ("sources", _sources()),
    }
    sections = "\n".join(
        f'<section id="{key}" aria-labelledby="{key}-head"><h2 id="{key}-head">{name}</h2>\n'
        f"{content}\n</section>"
        for name, (key, content) in parts.items()
    )
    links = "".join(f'<a href="#{key}">{name}</a>' for name, (key, _) in parts.items())
    style = files("asperity.report").joinpath("page.css").read_text(encoding="utf-8")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>Reproduced: {_TITLE}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        f"{_header(ledger.counts(claims))}\n"
        f'<nav aria-label="Sections">{links}</nav>\n<main>\n{sections}\n</main>\n'
        f"<footer>Written by asperity {__version__}. Figures (PNG, PDF), their numbers (CSV) and "
        "the claims (JSON, CSV) lie beside this page.</footer>\n</body>\n</html>\n"
    )


def _header(counts: Mapping[str, int]) -> str:
    tiles = "".join(
        f'<li class="{verdict}"><b>{count}</b> {verdict}<span>{rich(meaning)}</span></li>'
        for (verdict, count), (_, meaning) in zip(
            counts.items(), ledger.VERDICTS.values(), strict=True
        )
    )
    return (
        f'<header><p class="kicker">A reproduction</p><h1>{_TITLE}</h1><p class="by">{_AUTHORS}</p>'
        f"<p>{sum(counts.values())} quantitative and comparative statements of the paper, each "
        f'computed again from its own equations and numbers:</p><ul class="tiles">{tiles}</ul>'
        "</header>"
    )


def _brief(headlines: Sequence[Headline]) -> str:
    rows = "\n".join(
        '<tr role="row">'
        + cell("The paper concludes", rich(h.claim), "statement")
        + cell("Found here", rich(h.found), "computed")
        + cell("", _holds(holds=h.holds), "verdict")
        + "</tr>"
        for h in headlines
    )
    heads = ("The paper concludes", "Found here", "Holds?")
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    return (
        '<table class="ledger brief" role="table" aria-label="Conclusions of the paper">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{rows}\n</tbody></table>'
    )


def _holds(*, holds: bool) -> str:
    kind, sign, word = ("reproduced", "✓", "holds") if holds else ("differs", "≠", "does not hold")
    return f'<span class="chip {kind}"><span aria-hidden="true">{sign}</span> {word}</span>'


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


def _ledger(claims: Sequence[Claim]) -> str:
    return (
        "<p>Verdicts follow from a rule that was fixed beforehand for each claim. The measured "
        "points of the paper are in its figures only, not in its text; no claim here rests on "
        f"them.</p>\n{ledger.table(claims)}"
    )


def _sources() -> str:
    keys = ("bureau2000", "linker1992", "rice1983", "ruina1983", "cochard2003", "brown1985")
    entries = "\n".join(f"<li>{_reference(citation(key))}</li>" for key in keys)
    return (
        f"<ul>\n{entries}\n</ul>\n<p>Quasi-static periodic responses, found as periodic orbits and "
        "converged to a relative 10^-8 in mean, μ₁, μ₂ and Floquet multipliers; stable and "
        "unstable ones alike. Conventions: W = W₀ (1 + ε cos ωt), F/W₀ = mean + Σ μₙ cos(nωt + "
        "φₙ), peak amplitudes.</p>"
    ).replace("10^-8", "10<sup>−8</sup>")


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
