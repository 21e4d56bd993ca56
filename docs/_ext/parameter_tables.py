"""The pages' tables of parameters and outputs, made from `asperity.parameters` when they are built.

``{parameters} interface`` (parameters of the laws), ``{parameters} experiment`` and
``{parameters} outputs`` are tables. A law that is registered when the pages are built is in them.
"""

from __future__ import annotations

from collections.abc import Sequence

from docutils import nodes
from docutils.parsers.rst import directives
from docutils.statemachine import StringList
from parameter_rows import WHICH, table
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Parameters(SphinxDirective):
    """See the module."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Lay the table out, its cells read as the page's own text."""
        # The tables are of the code, not of the page: the page is read again at every build.
        self.env.note_reread()
        rows = table(directives.choice(self.arguments[0], WHICH))
        width = len(rows[0])
        group = nodes.tgroup(cols=width)
        group += [nodes.colspec(colwidth=1) for _ in range(width)]
        group += nodes.thead("", self._row(rows[0]))
        group += nodes.tbody("", *(self._row(row) for row in rows[1:]))
        return [nodes.table("", group)]

    def _row(self, cells: Sequence[str]) -> nodes.row:
        row = nodes.row()
        for cell in cells:
            entry = nodes.entry()
            self.state.nested_parse(StringList([cell], source=""), 0, entry)
            row += entry
        return row


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("parameters", Parameters)
    return {"parallel_read_safe": True}
