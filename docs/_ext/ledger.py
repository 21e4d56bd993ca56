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
    from asperity.ledger import Claim

_WHICH = ("counts", "exceptions", "reproduced")
_KINDS = {"fit": "fits", "arithmetic": "arithmetic", "identity": "identities"}


@cache
def _claims() -> Sequence[Claim]:
    from asperity.ledger import find_paper

    return find_paper("bureau2000").ledger(sensitivity=True)


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
            rows = [(c.place, c.statement, c.stated, _found(c), c.kind) for c in wanted]
            return [_table(("Place", "The paper states", "Stated", "Computed", "Kind"), rows)]
        rows = [
            (c.place, c.statement, f"{_found(c)}. {c.why}", f"{c.verdict} ({c.kind})")
            for c in wanted
        ]
        return [_table(("Place", "The paper states", "Computed, and what to make of it", ""), rows)]


def _found(claim: Claim) -> str:
    """What was computed, and what becomes of it within the uncertainties."""
    from asperity.ledger.page import sensitivity_text

    text = sensitivity_text(claim)
    return f"{claim.computed}. Within the uncertainties: {text}" if text else claim.computed


def _counts() -> str:
    claims = _claims()
    tests = [c for c in claims if c.is_test]
    found = {v: sum(c.verdict == v for c in tests) for v in ("reproduced", "misprint", "differs")}
    beside = []
    for kind, name in _KINDS.items():
        own = [c for c in claims if c.kind == kind]
        others = sum(c.verdict != "reproduced" for c in own)
        beside.append(
            f"{len(own)} {name}" + (f" ({others} of them not as stated)" if others else "")
        )
    return (
        f"Of {len(claims)} statements {len(tests)} are tests: {found['reproduced']} are "
        f"reproduced, {found['misprint']} are misprints and {found['differs']} differ. "
        f"Counted apart: {', '.join(beside)}."
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
