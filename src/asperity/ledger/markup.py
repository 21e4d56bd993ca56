"""Plain text to HTML, with Greek letters, subscripts and powers."""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Iterable, Mapping, Sequence
from html import escape, unescape
from pathlib import Path

from asperity.parameters.arguments import typed

#: Names of Greek letters. In HTML the letters have the same names, but for eps.
_GREEK = re.compile(
    r"\b(alpha|beta|Delta|eps|eta|gamma|kappa|lambda|mu|omega|Phi|pi|Sigma|sigma|theta)(?=\b|[_\d])"
)
_RULES: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), shown)
    for pattern, shown in (
        (r"\bum\b", "µm"),
        # A number in powers of ten, before minus signs change.
        (r"\b(\d+(?:\.\d+)?)e([+-]?)0*(\d+)\b", r"\1 × 10^\g<2>\g<3>"),
        (r"(?<![\d.])1 × 10\^", "10^"),
        (r"10\^\+", "10^"),
        (r"\^\(([^()]*)\)", r"<sup>\1</sup>"),
        (r"\^(-?\d+(?:\.\d+)?)", r"<sup>\1</sup>"),
        (r"(?<=\w)_(eff|asp|ss|st|pl|el|r|s|c|p|z|0z|n|h)\b", r"<sub>\1</sub>"),
        (r"\b([ΔWKVDPRhμσΣΦωwFXJ])([012])(z?)\b", r"\1<sub>\2\3</sub>"),
        (r"\bKc\b", "K<sub>c</sub>"),
        (r"(?<![\w.&#])-(?=[\dA-Zμελκ])", "−"),
        (r"(?<= )-(?= )", "−"),
        (r"&gt;&gt;", "≫"),
        (r"&lt;&lt;", "≪"),
        (r"&gt;=", "≥"),
        (r"&lt;=", "≤"),
        (r"\+−|\+-", "±"),
        (r"\bsqrt\(", "√("),
        (r"(?<=\w)'", "’"),
        # No line break between a number and its unit, or its symbol.
        (r"(?<=\d) (?=(?:%|[µmkc]?m\b|m?bar|atm|[kM]?Hz|N\b|kg|Pa|K\b|s\b))", "\u00a0"),
        (r"(?<=[\w>]) ([=≈×]) (?=[−\d])", "\u00a0\\1\u00a0"),
    )
)


def _greek(name: re.Match[str]) -> str:
    return unescape(f"&{name[1].replace('eps', 'epsi')};")


@typed
def rich(text: str) -> str:
    """Escape a plain text, and set Greek letters, indices and powers as in eps_eff and 1e-3."""
    shown = _GREEK.sub(_greek, escape(str(text), quote=False))
    for pattern, replacement in _RULES:
        shown = pattern.sub(replacement, shown)
    return shown


@typed
def table(
    heads: Mapping[str, str], rows: Iterable[Sequence[str]], label: str, kind: str = "ledger"
) -> str:
    """A table whose cells repeat the head of their column, for screens too narrow for columns.

    Parameters
    ----------
    heads : mapping of str to str
        Head of each column, and the class of its cells.
    rows : iterable of sequence of str
        HTML of the cells.
    label : str
        Label of the table for screen readers.
    kind : str
        Class of the table.
    """
    head = "".join(f'<th scope="col" role="columnheader">{name}</th>' for name in heads)
    body = "\n".join(
        '<tr role="row">'
        + "".join(
            f'<td role="cell" class="{name}" data-head="{escape(column)}">{cell}</td>'
            for (column, name), cell in zip(heads.items(), row, strict=True)
        )
        + "</tr>"
        for row in rows
    )
    return (
        f'<table class="{kind}" role="table" aria-label="{label}">'
        f'<thead role="rowgroup"><tr role="row">{head}</tr></thead>'
        f'<tbody role="rowgroup">\n{body}\n</tbody></table>'
    )


def embedded_png(path: Path, alt: str) -> str:
    """An image element with embedded data."""
    content = path.read_bytes()
    pixels = struct.unpack(">II", content[16:24])
    data = base64.b64encode(content).decode("ascii")
    # Pictures have 200 pixels an inch, pages 96.
    width, height = (round(side * 96 / 200) for side in pixels)
    return (
        f'<img src="data:image/png;base64,{data}" alt="{escape(alt)}" '
        f'width="{width}" height="{height}">'
    )
