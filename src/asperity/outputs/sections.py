"""Sections of a report as text for a terminal, as HTML or as JSON values, and pages of HTML."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any, NamedTuple

from asperity._version import __version__
from asperity.errors import printable

Row = Sequence[str]


class Section(NamedTuple):
    """A part of a report.

    Attributes
    ----------
    title : str
    sentences : tuple of str
        Sentences before the table.
    head : tuple of str
        Headings of the columns; empty for a table without headings.
    rows : tuple of tuple of str
    warnings : tuple of str
    """

    title: str
    sentences: tuple[str, ...] = ()
    head: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    warnings: tuple[str, ...] = ()


def records(sections: Iterable[Section]) -> list[dict[str, Any]]:
    """Sections as JSON values."""
    return [section._asdict() for section in sections]


def aligned(rows: Iterable[Row], indent: str = "") -> str:
    """Rows of text in columns, two blanks apart."""
    # Names and titles may come from files, with any characters.
    table = [[printable(cell, 9 * len(cell)) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return "\n".join(
        (indent + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True))).rstrip()
        for row in table
    )


def as_text(sections: Iterable[Section], indent: str = "  ") -> str:
    """Sections as lines of a terminal, with `indent` before the rows of tables."""
    lines: list[str] = []
    for section in sections:
        lines += [section.title] if section.title else []
        lines += section.sentences
        if section.rows:
            lines.append(
                aligned([*([section.head] if section.head else []), *section.rows], indent)
            )
        lines += [f"warning: {warning}" for warning in section.warnings]
    return "\n".join(lines)


def html_table(head: Row, rows: Iterable[Row]) -> str:
    """A table of plain texts."""

    def cells(row: Row, tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(c)}</{tag}>" for c in row) + "</tr>"

    top = cells(head, "th") if head else ""
    return f"<table>{top}{''.join(cells(row, 'td') for row in rows)}</table>"


def as_html(sections: Iterable[Section]) -> str:
    """Sections as HTML."""
    parts = []
    for section in sections:
        parts += [f"<h3>{escape(section.title)}</h3>"] if section.title else []
        parts += [f"<p>{escape(sentence)}</p>" for sentence in section.sentences]
        parts += [html_table(section.head, section.rows)] if section.rows else []
        listed = "".join(f"<li>{escape(warning)}</li>" for warning in section.warnings)
        parts += [f"<ul>{listed}</ul>"] if listed else []
    return "\n".join(parts)


def html_page(
    title: str, header: str, sections: Mapping[str, tuple[str, str]], footer: str = ""
) -> str:
    """A page in one file without external resources, with a link to each of its sections.

    Parameters
    ----------
    title : str
        Plain text.
    header, footer : str
        HTML; the footer follows the name of the program.
    sections : mapping of str to (str, str)
        Anchor and HTML of each section by its heading.
    """
    body = "\n".join(
        f'<section id="{key}" aria-labelledby="{key}-head"><h2 id="{key}-head">{name}</h2>\n'
        f"{content}\n</section>"
        for name, (key, content) in sections.items()
    )
    links = "".join(f'<a href="#{key}">{name}</a>' for name, (key, _) in sections.items())
    page, style = (
        files("asperity.outputs").joinpath(name).read_text(encoding="utf-8")
        for name in ("page.html", "page.css")
    )
    return Template(page).substitute(
        title=escape(title), style=style, header=header, links=links, sections=body,
        version=__version__, footer=footer,
    )  # fmt: skip


def two_digits(doubt: float) -> str:
    """An uncertainty with two digits, zeros included: "0.10", "12", "1.2e-05"."""
    text = f"{doubt:#.2g}"
    return f"{float(text):g}" if "e+" in text else text.rstrip(".")


def rounded(value: float, doubt: float) -> tuple[str, str]:
    """A number and its uncertainty, rounded to two uncertain digits.

    The uncertainty is empty if it is unknown or not larger than the rounding error of a double.
    """
    seen = doubt > 4 * sys.float_info.epsilon * abs(value)
    if not (math.isfinite(doubt) and doubt > 0 and seen and math.isfinite(value)):
        return f"{value:.9g}", ""
    last = math.floor(math.log10(doubt)) - 1
    if value and (max(abs(value), doubt) < 1e-3 or abs(value) >= 1e6):
        power = math.floor(math.log10(abs(value)))
        return f"{value:.{max(0, min(15, power - last))}e}", f"+- {doubt:.1e}"
    places = max(0, min(15, -last))
    # Without the sign of a zero.
    return f"{round(value, places) + 0.0:.{places}f}", f"+- {two_digits(doubt)}"
