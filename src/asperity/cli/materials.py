"""``asperity materials``: the published numbers that come with the package."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import output_options, switch
from asperity.cli.report import Output
from asperity.errors import require, symbol

if TYPE_CHECKING:
    from asperity.materials import Material, Number

_EPILOG = """\b
Examples:
  asperity materials
  asperity materials bureau2000
  asperity materials bureau2000 --cite

\b
kind: published (printed in the paper), fitted (printed there as the outcome of
a fit), assumed (not in the paper).
"""


@click.command(epilog=_EPILOG)
@click.argument("name", required=False)
@switch("--cite", "Print the source as BibTeX.")
@output_options()
def materials(name: str | None, cite: bool, output: Output) -> None:
    """List the materials, or every number of a material.

    NAME is a material, or the path of your TOML file.
    """
    from asperity import materials as known
    from asperity.outputs.sections import Section

    if cite:
        keys = known.available_citations() if name is None else (known.load(name).source,)
        require(all(keys), str(name), "have a source to cite", "none", "add it to the file")
        entries = {key: known.citation(key) for key in keys}
        output.answer(lambda: entries, lambda: [Section("\n\n".join(entries.values()))])
    elif name is None:
        loaded = [known.load(n) for n in known.available()]
        output.answer(
            lambda: {m.name: {"title": m.title, "source": m.source} for m in loaded},
            lambda: [Section("", rows=tuple((m.name, m.title) for m in loaded))],
            indent="",
        )
    else:
        material = known.load(name)
        head = ("name", "value", "kind", "place", "note")
        rows = tuple(
            (symbol(n), str(v), v.kind, v.place, v.note) for n, v in material.numbers.items()
        )
        table = Section(f"{material.name}: {material.title}\n", head=head, rows=rows)
        output.answer(lambda: _record(material), lambda: [table], indent="")


def _record(material: Material) -> dict[str, Any]:
    return {
        "name": material.name,
        "title": material.title,
        "source": material.source,
        "notes": material.notes.strip(),
        "numbers": {name: _number(number) for name, number in material.numbers.items()},
    }


def _number(number: Number) -> dict[str, Any]:
    """The number as printed, and in SI."""
    in_si = {
        "value": None if number.value is None else number.si,
        "uncertainty": number.si_uncertainty,
        "range": number.si_range,
        "values": number.si_values,
        "unit": number.si_unit,
    }
    return number.model_dump() | {"si": in_si}
