"""``asperity materials``: the published numbers that come with the package."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import json_option
from asperity.errors import InputError

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
@click.option("--cite", is_flag=True, help="Print the source as BibTeX.")
@json_option()
def materials(name: str | None, cite: bool, as_json: bool) -> int:
    """List the materials, or every number of one.

    NAME is a material, or the path of your TOML file.
    """
    if cite:
        return _cite(name, as_json)
    from asperity import materials as known
    from asperity.cli.report import to_json
    from asperity.outputs.tables import aligned

    if name is not None:
        material = known.load(name)
        click.echo(to_json(_record(material)) if as_json else _text(material))
        return 0
    loaded = [known.load(n) for n in known.available()]
    if as_json:
        click.echo(to_json({m.name: {"title": m.title, "source": m.source} for m in loaded}))
    else:
        click.echo(aligned((m.name, m.title) for m in loaded))
    return 0


def _cite(name: str | None, as_json: bool) -> int:
    from asperity import materials as known
    from asperity.cli.report import to_json

    keys = known.available_citations() if name is None else (known.load(name).source,)
    if not all(keys):
        raise InputError(f"{name} must have a source to cite, got none; add it to the file")
    entries = {key: known.citation(key) for key in keys}
    click.echo(to_json(entries) if as_json else "\n\n".join(entries.values()))
    return 0


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


def _text(material: Material) -> str:
    from asperity.outputs.tables import aligned

    rows = [("name", "value", "kind", "place", "note")]
    rows += [(n, str(v), v.kind, v.place, v.note) for n, v in material.numbers.items()]
    return f"{material.name}: {material.title}\n\n{aligned(rows)}"
