"""The directive ``claims``: the ledger of the paper's claims, computed while the page is built.

``{claims} counts`` is a sentence, ``{claims} exceptions`` a table of what is not reproduced as
printed, ``{claims} reproduced`` a table of the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from asperity.study.claims import Claim

_WHICH = ("counts", "exceptions", "reproduced")


@cache
def _claims() -> Sequence[Claim]:
    from asperity.study.claims import ledger

    return ledger()


class Claims(SphinxDirective):
    """See the module."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Compute, and lay out."""
        # Numbers are of the code, not of the page: the page is read again whenever it is built.
        self.env.note_reread()
        which = directives.choice(self.arguments[0], _WHICH)
        if which == "counts":
            return [nodes.paragraph(text=_counts())]
        wanted = [c for c in _claims() if (c.verdict == "reproduced") == (which == "reproduced")]
        if which == "reproduced":
            rows = [(c.place, c.statement, c.stated, c.computed) for c in wanted]
            return [_table(("Place", "The paper states", "Stated", "Computed"), rows)]
        rows = [(c.place, c.statement, f"{c.computed}. {c.why}", c.verdict) for c in wanted]
        return [_table(("Place", "The paper states", "Computed, and what to make of it", ""), rows)]


def _counts() -> str:
    claims = _claims()
    found = {v: sum(c.verdict == v for c in claims) for v in ("reproduced", "misprint", "differs")}
    return (
        f"Of {len(claims)} statements, {found['reproduced']} are reproduced, "
        f"{found['misprint']} are misprints and {found['differs']} differ."
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> nodes.table:
    table = nodes.table(classes=["ledger"])
    group = nodes.tgroup(cols=len(head))
    group += [nodes.colspec(colwidth=1) for _ in head]
    group += nodes.thead("", _row(head))
    group += nodes.tbody("", *(_row(row) for row in rows))
    table += group
    return table


def _row(texts: Sequence[str]) -> nodes.row:
    return nodes.row("", *(nodes.entry("", nodes.paragraph(text=text)) for text in texts))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("claims", Claims)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
