"""Pages of reports: one file each, with nothing to fetch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files

from asperity._version import __version__


def document(title: str, kicker: str, heading: str, sections: Mapping[str, str]) -> str:
    """A page as text.

    Parameters
    ----------
    title, kicker, heading : str
        Plain text.
    sections : mapping of str to str
        HTML by heading.
    """
    style = files("asperity.ledger").joinpath("page.css").read_text(encoding="utf-8")
    body = "\n".join(
        f'<section aria-label="{escape(name)}"><h2>{escape(name)}</h2>\n{content}\n</section>'
        for name, content in sections.items()
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}\n"
        "table{border-collapse:collapse;display:block;overflow-x:auto}"
        "td,th{padding:.15rem .7rem;text-align:right;white-space:nowrap}"
        "td:first-child,th:first-child{text-align:left}"
        "figure.wide{grid-template-columns:1fr}"
        "svg{max-width:100%;height:auto;background:#fff}</style>\n"
        f'</head>\n<body>\n<header><p class="kicker">{escape(kicker)}</p>'
        f"<h1>{escape(heading)}</h1></header>\n<main>\n{body}\n</main>\n"
        f"<footer>Written by asperity {__version__}.</footer>\n</body>\n</html>\n"
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of plain texts."""

    def cells(row: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(c)}</{tag}>" for c in row) + "</tr>"

    return f"<table>{cells(head, 'th')}{''.join(cells(row, 'td') for row in rows)}</table>"


def figure(svg: str, caption: str, *, wide: bool = False) -> str:
    """A figure with its caption, a plain text, beside it or, of a wide one, below."""
    shape = ' class="wide"' if wide else ""
    return f"<figure{shape}>{svg}<figcaption>{escape(caption)}</figcaption></figure>"
