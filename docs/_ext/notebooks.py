"""Tutorials as executed notebooks, written next to their pages, with a link at the end of each.

Nothing runs while the pages are built: what a block prints stands on the page, where the tests of
the pages compare it with what it prints, and pictures are those of the page.
"""

import json
import re
from base64 import b64encode
from pathlib import Path

_BLOCK = re.compile(r"^```(\S*) *([^\n]*)\n(.*?)^```\s*$", re.M | re.S)
_ROLE = re.compile(r"\{doc\}`(?:\.\./)?([^`<]+)`")


def cells(source: str, folder: Path) -> list[dict]:
    """Cells of a notebook: a page's text and pictures, and each of its ``python`` blocks.

    The ``text`` block behind one is its output; commands are for a terminal, and stay as text.

    Parameters
    ----------
    source : str
    folder : Path
        That of the page, which pictures are relative to.
    """
    made: list[dict] = []
    text: list[str] = []
    pictures: dict[str, dict[str, str]] = {}

    def close() -> None:
        whole = _ROLE.sub(r"`\1`", "".join(text)).strip()
        text.clear()
        if whole:
            made.append(cell("markdown", whole))
            if pictures:
                made[-1]["attachments"] = dict(pictures)
                pictures.clear()

    end, ran, count = 0, False, 0
    for block in _BLOCK.finditer(source):
        between = source[end : block.start()]
        if between.strip():
            ran = False
        text.append(between)
        kind, body = block[1], block[3]
        if kind == "python":
            close()
            count += 1
            made.append(cell("code", body.rstrip("\n"), count))
            ran = True
        elif kind == "text" and ran:
            lines = body.splitlines(keepends=True)
            made[-1]["outputs"] = [{"name": "stdout", "output_type": "stream", "text": lines}]
        elif kind == "{image}":
            file = folder / block[2]
            pictures[file.name] = {"image/png": b64encode(file.read_bytes()).decode()}
            said = re.search(r":alt: (.*)", body)
            text.append(f"![{said[1] if said else ''}](attachment:{file.name})\n")
        elif kind == "console":
            commands = [line for line in body.splitlines() if line.startswith(("$ ", "    "))]
            text.append("```\n" + "\n".join(commands) + "\n```\n")
        elif kind.startswith("{"):
            pass
        else:
            text.append(block[0])
        end = block.end()
    text.append(source[end:])
    close()
    return made


def cell(kind: str, source: str, count: int | None = None) -> dict:
    """A cell in the format of Jupyter, version 4.4; of code with its number."""
    content = {"cell_type": kind, "metadata": {}, "source": source.splitlines(keepends=True)}
    if kind == "code":
        content |= {"execution_count": count, "outputs": []}
    return content


def notebook(source: str, folder: Path) -> str:
    """A page of a folder as a notebook, JSON."""
    about = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    content = {
        "cells": cells(source, folder),
        "metadata": about,
        "nbformat": 4,
        "nbformat_minor": 4,
    }
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
        target.write_text(notebook(source, Path(app.srcdir) / "tutorials"), encoding="utf-8")


def setup(app) -> dict:
    """Called by Sphinx."""
    app.connect("source-read", add_link)
    app.connect("build-finished", write)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
