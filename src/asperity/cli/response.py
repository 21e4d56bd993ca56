"""``asperity response``: the periodic response of one operating point, or of a table of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import json_option, names_option, plot_option, point_options
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.operating_point import SourcedNumber
    from asperity.orbit import PeriodicResponse
    from asperity.parameters import Names
    from asperity.questions.point import Point

_EPILOG = """\b
Examples:
  asperity response --law elasto-plastic --material bureau2000 \\
      -V "1 um/s" -e 0.24 -f "120 Hz" --set A=0.013 --set "K=0.3 N/um"
  asperity response --law elasto-plastic --material bureau2000 \\
      -V "1 um/s" -e 0.24 -f "120 Hz" --set epsilon2=0.02 --set tilt=0.03
  asperity response --table points.csv --out responses.csv --material bureau2000
  asperity response --stick-slip --law rice-ruina --material bureau2000 \\
      -V "1 um/s" --set "K=10 N/m" --set "M=0.1 kg" --inertia

\b
Convention: w(t) = W/W0 = 1 + eps cos wt,
F/W0 = mean_friction + sum of mu_n cos(n w t + phase_n).

\b
Table: columns law, A, B, D0, mu0, V0, K, M, W0, alpha, lambda, V, epsilon,
frequency, inertia (1 or 0), eta (N s/m), in SI and without units. What a row
leaves open is taken from --law, --set, -V, -e, -f and --material; other columns
are kept. A row that cannot be solved says why in the column 'result'.

\b
Other modulations, as columns or by --set: epsilon2, epsilon2_phase, epsilon3,
epsilon3_phase (harmonics of the load), pull, pull_phase (of the pulling
velocity over its mean), tilt (of the exciter). Angles are in rad;
--set "tilt=5 deg" is understood too.
"""

#: Outputs that the text shows.
_SHOWN = (
    *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"),
    *("floquet_max", "stable", "mode", "mode_frequency", "growth_rate"),
)


@click.command(epilog=_EPILOG)
@point_options
@plot_option()
@names_option()
@json_option()
@click.option(
    "--stick-slip",
    is_flag=True,
    help="Without a modulation: period, drop and durations of stick-slip, if there is any.",
)
@click.option("--table", type=Path, metavar="CSV", help="Solve every row of a table.")
@click.option("--out", type=Path, metavar="CSV", help="Where the table with its results goes.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted table.")
def response(
    point: Point,
    stick_slip: bool,
    table: Path | None,
    out: Path | None,
    resume: bool,
    plot: Path | None,
    names: Names,
    as_json: bool,
) -> int:
    """Periodic response to a modulated normal load.

    Mean friction, harmonics of the force and Floquet multipliers of the periodic orbit, be it
    stable or not; without inertia by default.
    """
    if stick_slip:
        if table is not None or out is not None or resume:
            raise InputError(
                "--stick-slip must go with one point, got --table, --out or --resume; leave it "
                "out, or take asperity.experiment.stick_slip_response with arrays"
            )
        return _stick_slip(point, as_json, plot, names)
    if table is not None:
        if out is None:
            raise InputError("--out must be given with --table, got nothing; name the output file")
        if plot is not None:
            raise InputError("--plot must go with one point, got a table; leave one of them out")
        return _table(table, out, point, resume, as_json)
    if out is not None or resume:
        raise InputError(
            "--out and --resume must go with --table, got no table; name it or leave them out"
        )
    return _point(point, as_json, plot, names)


def _point(point: Point, as_json: bool, plot: Path | None, names: Names) -> int:
    from asperity.cli.report import require_picture, response_record, to_json, write_picture
    from asperity.laws import get_law
    from asperity.operating_point import point_numbers, respond

    require_picture(plot)
    numbers = point_numbers(point, "command line")
    values = {name: number.value for name, number in numbers.items()}
    result = respond(get_law(point.law), values)
    if as_json:
        click.echo(to_json(response_record(result, numbers), names, point.law))
    elif result.converged:
        click.echo(_text(point.law, result, numbers, names))
    if result.converged:
        write_picture(result, plot, names)
    if not result.converged:
        click.echo(f"asperity: {result.result[()]}", err=True)
    return 0 if result.converged else 1


def _stick_slip(point: Point, as_json: bool, plot: Path | None, names: Names) -> int:
    from asperity._version import __version__
    from asperity.cli.report import require_picture, to_json, write_picture
    from asperity.experiment import stick_slip_response
    from asperity.laws import get_law
    from asperity.operating_point import numbers_for, offered_numbers
    from asperity.parameters import MODULATION, point_parameters
    from asperity.slider.named import slider_from

    require_picture(plot)
    offered = offered_numbers(point, "command line")
    for name in ("epsilon", "frequency"):
        if name in point.parameters:
            raise InputError(
                "--stick-slip",
                "come without a modulation",
                f"{name} = {point.parameters[name]}",
                "leave it out, or leave --stick-slip out",
            )
    law, modulation = get_law(point.law), ("epsilon", "frequency", *MODULATION)
    among = {n: p for n, p in point_parameters(law).items() if n not in modulation}
    numbers = numbers_for(law.name, offered, among)
    values = {name: number.value for name, number in numbers.items()}
    result = stick_slip_response(
        slider_from(law, values), velocity=values["V"],
        inertia=bool(values.get("inertia", 0.0)), radiation_damping=values.get("eta"),
    )  # fmt: skip
    rows = result.values()
    if as_json:
        record: dict[str, Any] = {name: value for name, value, _, _ in rows}
        record |= {"result": str(result.result), "asperity_version": __version__, "law": law.name}
        click.echo(to_json({**record, "parameters": values}, names, law.name))
    else:
        texts = [
            (name, f"{value:.9g} {unit}".removesuffix(" 1"), meaning)
            for name, value, unit, meaning in rows
            if result.slips or name in ("steady", "stable")
        ]
        click.echo(_words(law.name, numbers, str(result.result), texts, names))
    if result.slips:
        write_picture(result, plot, names)
    return 0 if result.slips or result.steady else 1


def _text(
    law: str, result: PeriodicResponse, numbers: dict[str, SourcedNumber], names: Names
) -> str:
    from asperity.parameters import OUTPUTS

    outputs = []
    for name in _SHOWN:
        value = getattr(result, name)[()]
        text = ("no", "yes")[int(value)] if name == "stable" else str(value)
        if isinstance(value, float):
            text = f"{value:.9g} {OUTPUTS[name].unit}".removesuffix(" 1")
        outputs.append((name, text, OUTPUTS[name].meaning))
    return _words(law, numbers, "response", outputs, names)


def _words(
    law: str,
    numbers: dict[str, SourcedNumber],
    heading: str,
    outputs: list[tuple[str, str, str]],
    names: Names,
) -> str:
    from asperity.laws import get_law
    from asperity.outputs.tables import aligned
    from asperity.parameters import display_name, point_parameters
    from asperity.units import format_si

    chosen = get_law(law)
    kinds = point_parameters(chosen)
    inputs = [
        (
            display_name(name, names, chosen),
            format_si(number.value, kinds[name].kind, 6),
            number.origin,
        )
        for name, number in numbers.items()
    ]
    title = f"{law}, of forces per square metre: N for Pa" if names == "geophysics" else law
    return f"{title}\n{aligned(inputs, '  ')}\n{heading}\n{aligned(outputs, '  ')}"


def _table(
    table: Path,
    out: Path,
    point: Point,
    resume: bool,
    as_json: bool,
) -> int:
    from asperity.cli.progress import bar
    from asperity.cli.report import to_json
    from asperity.laws import get_law
    from asperity.operating_point import material_of, sourced_numbers
    from asperity.study.table import run_table

    law = get_law(point.law).name if point.law else None
    filled = sourced_numbers(point.parameters, material_of(point), law=law)
    with bar("point", "responses") as update:
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
