"""The runnable parts of a page, and the comparison of outputs with those that the page shows.

In a page,

- a ``python`` block runs, in the namespace of the page;
- a ``text`` block directly after a ``python`` block is the output of that block;
- a ``console`` block has commands after ``$ ``, each followed by its output; an exit code that
  is not 0 is written as ``# exit 2``;
- a ``code-block`` with a file's name as caption is that file;
- ``...`` matches anything: as a line any number of lines, at the end of a line the rest of it.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
PAGES = [page for page in PAGES if "_build" not in page.parts]

#: Relative difference of printed numbers that platforms may cause.
RELATIVE = 1e-7

_BLOCK = re.compile(
    r"^(?P<fence>`{3,})(?P<info>[^\n`]*)\n(?P<body>.*?)^(?P=fence)\s*$", re.M | re.S
)
_CAPTION = re.compile(r"^:caption: (?P<name>\S+)\n\n", re.M)
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?%?(?![\w])", re.I)


@dataclass(frozen=True)
class Snippet:
    """One runnable part: ``python``, ``console`` or ``file``."""

    kind: str
    text: str
    line: int
    prints: str | None = None
    name: str = ""


@dataclass(frozen=True)
class Command:
    """A line of a console block, with its output and its exit code."""

    arguments: list[str]
    prints: str
    exit_code: int


def snippets(page: Path) -> list[Snippet]:
    """Runnable parts of a page, in their order."""
    source = page.read_text(encoding="utf-8")
    parts: list[Snippet] = []
    end = 0
    for block in _BLOCK.finditer(source):
        info, body = block["info"].strip(), block["body"]
        line = source.count("\n", 0, block.start()) + 1
        follows = not source[end : block.start()].strip()
        end = block.end()
        if info in ("python", "console"):
            parts.append(Snippet(info, body, line))
        elif info == "text" and follows and parts and parts[-1].kind == "python":
            last = parts[-1]
            parts[-1] = Snippet(last.kind, last.text, last.line, prints=body)
        elif info.startswith("{code-block}") and (caption := _CAPTION.match(body)):
            parts.append(Snippet("file", body[caption.end() :], line, name=caption["name"]))
        elif info.startswith("{literalinclude}"):
            parts.append(Snippet("include", "", line, name=info.split()[1]))
    return parts


def commands(text: str) -> list[Command]:
    """The commands of a console block."""
    listed = []
    for part in re.split(r"^\$ ", text, flags=re.M)[1:]:
        line, _, prints = re.sub(r"\\\n\s*", "", part).partition("\n")
        code = re.search(r"# exit (\d+)\s*$", line)
        arguments = shlex.split(line, comments=True)
        listed.append(Command(arguments, prints, int(code[1]) if code else 0))
    return listed


def difference(shown: str, printed: str) -> str:
    """The first difference of an output from what the page shows; empty if there is none."""
    wanted, got = _lines(shown), _lines(printed)
    i = 0
    for k, line in enumerate(wanted):
        if line == "...":
            following = wanted[k + 1] if k + 1 < len(wanted) else None
            if following is None:
                return ""
            while i < len(got) and not _same(following, got[i]):
                i += 1
            continue
        if i >= len(got):
            return f"missing: {line}"
        if not _same(line, got[i]):
            return f"page:    {line}\nprinted: {got[i]}"
        i += 1
    return f"more is printed: {got[i]}" if i < len(got) else ""


def _lines(text: str) -> list[str]:
    lines = (" ".join(line.split()) for line in text.splitlines())
    return [line for line in lines if line]


def _same(shown: str, printed: str) -> bool:
    if shown.endswith(" ...") and shown != "...":
        start = shown.removesuffix(" ...")
        length = len(start.split())
        return _same(start, " ".join(printed.split()[:length]))
    if _NUMBER.sub("#", shown) != _NUMBER.sub("#", printed):
        return False
    pairs = zip(_NUMBER.findall(shown), _NUMBER.findall(printed), strict=True)
    return all(_close(a, b) for a, b in pairs)


def _close(shown: str, printed: str) -> bool:
    a, b = (float(text.rstrip("%")) for text in (shown, printed))
    mantissa, _, exponent = shown.lower().rstrip("%").partition("e")
    digits = mantissa.partition(".")[2]
    if not digits and not exponent:
        return a == b  # a count, or a whole percentage
    # Printed numbers are rounded: their last digits may differ by one.
    unit = 10.0 ** (int(exponent or 0) - len(digits))
    return abs(a - b) <= max(RELATIVE * abs(a), 1.01 * unit)
