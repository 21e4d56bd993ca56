"""Tutorials as notebooks: text and Python of a page, written next to it, with a link at its end."""

import json
import re
from pathlib import Path

_BLOCK = re.compile(r"^```(\S*)[^\n]*\n(.*?)^```\s*$", re.M | re.S)
_ROLE = re.compile(r"\{doc\}`(?:\.\./)?([^`<]+)`")


def cells(source: str) -> list[dict]:
    """Cells of a notebook: a page's text, and each of its ``python`` blocks.

    What a block prints is left out, as it comes when the notebook runs; commands are for a
    terminal, and stay as text.
    """
    made: list[dict] = []
    text: list[str] = []

    def close() -> None:
        whole = _ROLE.sub(r"`\1`", "".join(text)).strip()
        text.clear()
        if whole:
            made.append(cell("markdown", whole))

    end, ran = 0, False
    for block in _BLOCK.finditer(source):
        between = source[end : block.start()]
        if between.strip():
            ran = False
        text.append(between)
        kind, body = block[1], block[2]
        if kind == "python":
            close()
            made.append(cell("code", body.rstrip("\n")))
            ran = True
        elif kind == "console":
            commands = [line for line in body.splitlines() if line.startswith(("$ ", "    "))]
            text.append("```\n" + "\n".join(commands) + "\n```\n")
        elif kind.startswith("{") or (kind == "text" and ran):
            pass
        else:
            text.append(block[0])
        end = block.end()
    text.append(source[end:])
    close()
    return made


def cell(kind: str, source: str) -> dict:
    """A cell in the format of Jupyter, version 4.4."""
    content = {"cell_type": kind, "metadata": {}, "source": source.splitlines(keepends=True)}
    if kind == "code":
        content |= {"execution_count": None, "outputs": []}
    return content


def notebook(source: str) -> str:
    """A page as a notebook, JSON."""
    about = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    content = {"cells": cells(source), "metadata": about, "nbformat": 4, "nbformat_minor": 4}
    return json.dumps(content, indent=1)


def add_link(app, page: str, source: list[str]) -> None:
    """The link at the end of a tutorial that has Python to run."""
    if not page.startswith("tutorials/") or "```python" not in source[0]:
        return
    name = f"{page.removeprefix('tutorials/')}.ipynb"
    app.env.tutorial_sources = getattr(app.env, "tutorial_sources", {}) | {name: source[0]}
    source[0] += (
        "\n\n```{raw} html\n"
        f'<p><a href="{name}" download>This page as a notebook</a>: run it, change it.</p>\n```\n'
    )


def write(app, error: Exception | None) -> None:
    """Write the notebooks next to the pages."""
    if error is not None or app.builder.format != "html":
        return
    for name, source in getattr(app.env, "tutorial_sources", {}).items():
        target = Path(app.outdir) / "tutorials" / name
        target.write_text(notebook(source), encoding="utf-8")


def setup(app) -> dict:
    """Called by Sphinx."""
    app.connect("source-read", add_link)
    app.connect("build-finished", write)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
