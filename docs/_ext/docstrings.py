"""Docstrings are written to be read in a terminal; here they are made safe for reStructuredText.

``|c_n|`` is a modulus and not a substitution, ``lambda_`` a name and not a link, ``*`` no emphasis.
"""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

_MARK = re.compile(r"[|*]")
_TRAILING = re.compile(r"(?<=\w)_(?!\w)")
_CODE = re.compile(r"(``.+?``|`[^`]+`)")
#: ``name : type`` of numpydoc, whose name napoleon escapes itself.
_FIELD = re.compile(r"\s*[\w, *]+ : ")


def escaped(lines: list[str]) -> list[str]:
    """The lines with bars and trailing underscores escaped, outside of code and literal blocks."""
    found, literal = [], None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if literal is not None and line.strip() and indent <= literal:
            literal = None
        found.append(line if literal is not None else _escape(line))
        if literal is None and line.rstrip().endswith("::") and not line.lstrip().startswith(".."):
            literal = indent
    return found


def _escape(line: str) -> str:
    head = _FIELD.match(line)
    start = head.end() if head else 0
    return line[:start] + _text(line[start:])


def _text(line: str) -> str:
    parts = _CODE.split(line)
    parts[::2] = [_TRAILING.sub(r"\\_", _MARK.sub(r"\\\g<0>", part)) for part in parts[::2]]
    return "".join(parts)


def _process(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    lines[:] = escaped(lines)
    if what == "property":
        # Else napoleon takes what stands before a colon in the first line for a type.
        lines[:0] = ["..", ""]


def setup(app: Sphinx) -> dict[str, bool]:
    """Run before napoleon, whose field lists are then made from safe text."""
    app.connect("autodoc-process-docstring", _process, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
