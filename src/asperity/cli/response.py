"""``asperity response``: the periodic response of one operating point, or of a table of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from asperity.cli.options import json_option, law_named, material_named, point_options
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.solve import PeriodicResponse
    from asperity.study.operating_point import Sourced

_EPILOG = """\b
Examples:
  asperity response --law elasto-plastic --material bureau2000 \\
      -V "1 um/s" -e 0.24 -f "120 Hz" --set A=0.013 --set "K=0.3 N/um"
  asperity response --table points.csv --out responses.csv --material bureau2000

\b
Convention: w(t) = W/W0 = 1 + eps cos wt,
F/W0 = mean_friction + sum of mu_n cos(n w t + phase_n).

\b
Table: columns law, A, B, D0, mu0, V0, K, M, W0, alpha, lambda, V, epsilon,
frequency, inertia (1 or 0), eta (N s/m), in SI and without units. What a row
leaves open is taken from --law, --set, -V, -e, -f and --material; other columns
are kept. A row that cannot be solved says why in the column 'result'.
"""


@click.command(epilog=_EPILOG)
@point_options
@click.option("--table", type=Path, metavar="CSV", help="Solve every row of a table.")
@click.option("--out", type=Path, metavar="CSV", help="Where the table with its results goes.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted table.")
@json_option()
def response(
    law: str | None,
    material: str | None,
    given: dict[str, str],
    table: Path | None,
    out: Path | None,
    resume: bool,
    as_json: bool,
) -> int:
    """Periodic response to a modulated normal load.

    Mean friction, harmonics of the force and Floquet multipliers of the periodic orbit, be it
    stable or not; without inertia unless it is asked for.
    """
    if table is not None:
        if out is None:
            raise InputError("--out must be given with --table, got nothing; name the output file")
        return _table(table, out, law, material, given, resume, as_json)
    if out is not None or resume:
        raise InputError(
            "--out and --resume must go with --table, got no table; name it or leave them out"
        )
    return _point(law, material, given, as_json)


def _point(law: str | None, material: str | None, given: dict[str, str], as_json: bool) -> int:
    from asperity.cli.report import response_record, to_json
    from asperity.laws import get_law
    from asperity.study.operating_point import (
        numbers_for,
        quantities,
        refuse_foreign,
        respond,
        sourced_numbers,
    )

    law = law_named(law)
    refuse_foreign(law, given)
    numbers = numbers_for(law, sourced_numbers(given, material_named(material), "command line"))
    found = respond(get_law(law), {name: number.value for name, number in numbers.items()})
    if as_json:
        units = {name: quantity.unit for name, quantity in quantities(get_law(law)).items()}
        click.echo(to_json(response_record(found, numbers, units)))
    elif found.converged:
        click.echo(_text(law, found, numbers))
    if not found.converged:
        click.echo(f"asperity: {found.result[()]}", err=True)
    return 0 if found.converged else 1


def _text(law: str, found: PeriodicResponse, numbers: dict[str, Sourced]) -> str:
    from asperity.cli.report import aligned
    from asperity.laws import get_law
    from asperity.study.operating_point import quantities
    from asperity.units import format_si

    kinds = quantities(get_law(law))
    inputs = [
        (name, format_si(number.value, kinds[name].kind, 6), number.origin)
        for name, number in numbers.items()
    ]
    outputs = [
        ("mean_friction", f"{found.mean_friction:.9g}", "mean of F/W0"),
        ("delta_mu", f"{found.delta_mu:.9g}", "mean_friction - mu_ss(V)"),
        ("mu1", f"{found.mu1:.9g}", "amplitude of F/W0 at f"),
        ("mu2", f"{found.mu2:.9g}", "amplitude of F/W0 at 2f"),
        ("phase1", f"{found.phase1:.9g} rad", "against the load"),
        ("phase2", f"{found.phase2:.9g} rad", "against the load"),
        ("floquet_max", f"{found.floquet_max:.9g}", "largest modulus of the multipliers"),
        ("stable", "yes" if found.stable else "no", f"leading mode: {found.mode[()]}"),
        ("mode_frequency", f"{found.mode_frequency:.6g} Hz", "of the leading mode, modulo f"),
    ]
    return f"{law}\n{aligned(inputs, '  ')}\nresponse\n{aligned(outputs, '  ')}"


def _table(
    table: Path,
    out: Path,
    law: str | None,
    material: str | None,
    given: dict[str, str],
    resume: bool,
    as_json: bool,
) -> int:
    from asperity.cli.progress import bar
    from asperity.cli.report import to_json
    from asperity.laws import get_law
    from asperity.study.operating_point import sourced_numbers
    from asperity.study.table import run_table

    if law is not None:
        get_law(law)
    filled = sourced_numbers(given, material_named(material))
    with bar("point") as update:
        done = run_table(
            table,
            out,
            law=law,
            filled={name: number.value for name, number in filled.items()},
            resume=resume,
            progress=lambda solved, rows: update(solved, rows, ""),
        )
    if as_json:
        click.echo(to_json({"rows": done.rows, "failed": done.failed, "out": str(out)}))
    if done.failed:
        click.echo(
            f"asperity: {done.failed} of {done.rows} rows have no response; the column 'result' of "
            f"{out} says why",
            err=True,
        )
    return 1 if done.failed else 0
