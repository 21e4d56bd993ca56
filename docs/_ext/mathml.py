"""Formulas as MathML, which every current browser sets by itself: no script, no font, no network.

LaTeX is converted while the pages are built. What the converter does not know it passes on as
text; here that is a warning, so that a page never shows a bare command.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging

#: Commands of the pages that the converter lacks.
_OPERATORS = re.compile(r"\\(arg)\b")
_LEFT_OVER = re.compile(r"\\[A-Za-z]+|<m[ion]>&</m[ion]>")

_SPACE = "http://www.w3.org/1998/Math/MathML"
ElementTree.register_namespace("", _SPACE)
_ROWS = {f"{{{_SPACE}}}{name}" for name in ("math", "mrow", "mstyle", "mtd")}

_log = logging.getLogger(__name__)


def to_mathml(latex: str, *, display: bool, where: Any = None) -> str:
    """One formula as a ``<math>`` element; a command that is not known is warned about."""
    source = _OPERATORS.sub(r"\\operatorname{\1}", " ".join(latex.split()))
    found = convert(source, display="block" if display else "inline")
    if unknown := _LEFT_OVER.findall(found):
        _log.warning("no MathML for %s", ", ".join(sorted(set(unknown))), location=where)
        return found
    root = ElementTree.fromstring(found)
    for operator in list(root.iter(f"{{{_SPACE}}}mo")):
        if operator.text == "∞":  # a number, and no sign
            operator.tag = f"{{{_SPACE}}}mi"
    for row in [element for element in root.iter() if element.tag in _ROWS]:
        _mark_signs(row)
        _set_functions_apart(row)
    _pair_bars(root)
    return ElementTree.tostring(root, encoding="unicode")


def _mark_signs(row: ElementTree.Element) -> None:
    """A minus behind a bracket, a relation or a blank is a sign, and no difference."""
    for before, minus in pairwise(row):
        opens = before.tag.endswith("}mspace") or (before.text or "x") in "([=,→≈"
        if minus.tag.endswith("}mo") and minus.text == "−" and opens:
            minus.set("form", "prefix")


def _pair_bars(root: ElementTree.Element) -> None:
    """Bars of a modulus belong to what they enclose; alone they would be spaced like a sign."""
    single = [mo for mo in root.iter(f"{{{_SPACE}}}mo") if mo.text == "|"]
    bars = [mo for mo in single if not {"fence", "minsize"} & set(mo.attrib)]
    if len(bars) % 2:
        return
    for i, bar in enumerate(bars):
        bar.attrib = {"form": "postfix" if i % 2 else "prefix", "stretchy": "false"}


def _set_functions_apart(row: ElementTree.Element) -> None:
    """Thin spaces about the names of functions, as printers set them: g sin x, not gsinx."""
    children = list(row)
    row[:] = []
    for before, child, after in zip(
        [None, *children[:-1]], children, [*children[1:], None], strict=True
    ):
        name = _is_function(child)
        if name and before is not None and not _is_operator(before) and not _is_function(before):
            row.append(_thin_space())
        row.append(child)
        if name and after is not None and not _is_operator(after):
            row.append(_thin_space())


def _is_function(element: ElementTree.Element) -> bool:
    """Whether it is a word such as ln, with or without an exponent."""
    first = element[0] if len(element) else element
    return first.tag.endswith("}mi") and len(first.text or "") > 1 and (first.text or "").isalpha()


def _is_operator(element: ElementTree.Element) -> bool:
    return element.tag.endswith(("}mo", "}mspace"))


def _thin_space() -> ElementTree.Element:
    return ElementTree.Element(f"{{{_SPACE}}}mspace", width="0.167em")


def _inline(self: Any, node: nodes.math) -> None:
    self.body.append(to_mathml(node.astext(), display=False, where=node))
    raise nodes.SkipNode


def _display(self: Any, node: nodes.math_block) -> None:
    self.body.append(self.starttag(node, "div", CLASS="math"))
    self.body.append(to_mathml(node.astext(), display=True, where=node))
    self.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
