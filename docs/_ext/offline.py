"""Pages must be complete: a script, style, font or picture from elsewhere is a warning.

Links that a reader may follow are no assets.
"""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util import logging

_ASSET = re.compile(
    r"<(?:script|img|iframe|source|video)\b[^>]*\bsrc=[\"']?(?:https?:)?//[^>]*>"
    r"|<link\b(?=[^>]*\brel=[\"']?(?:stylesheet|preload|icon|preconnect))[^>]*\bhref=[\"']?"
    r"(?:https?:)?//[^>]*>"
    r"|@import\s+(?:url\()?[\"']?https?://|url\([\"']?https?://[^)]*\)",
)

_log = logging.getLogger(__name__)


def foreign_assets(text: str) -> list[str]:
    """What a page or a style sheet would fetch from another host."""
    return _ASSET.findall(text)


def _check(app: Sphinx, error: Exception | None) -> None:
    if error is not None or app.builder.format != "html":
        return
    for file in sorted(Path(app.outdir).rglob("*")):
        if file.suffix in (".html", ".css"):
            for asset in foreign_assets(file.read_text(encoding="utf-8")):
                _log.warning("%s would fetch %s", file.relative_to(app.outdir), asset)


def setup(app: Sphinx) -> dict[str, bool]:
    """Look at everything that was written."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
