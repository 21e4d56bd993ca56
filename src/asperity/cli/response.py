"""``asperity response``: the periodic response of one operating point, or of a table of them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import option, output_options, point_options, switch
from asperity.cli.report import Output, say
from asperity.errors import require, symbol

if TYPE_CHECKING:
    from asperity.operating_point import SourcedNumber
    from asperity.orbit import PeriodicResponse
    from asperity.outputs.sections import Section
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
frequency, inertia (1 or 0), eta (N s/m), in SI or with the unit in the heading,
as "V (um/s)". What a row leaves open is taken from --law, --set, -V, -e, -f and
--material; other columns are kept. A row that cannot be solved says why in the
column 'result'.

\b
Other modulations, as columns or by --set: epsilon2, epsilon2_phase, epsilon3,
epsilon3_phase (harmonics of the load), pull, pull_phase (of the pulling
velocity over its mean), tilt (of the exciter). Angles are in rad;
--set "tilt=5 deg" is understood too.
"""

#: Outputs in the text.
_SHOWN = (
    *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"),
    *("floquet_max", "stable", "mode", "mode_frequency", "growth_rate"),
)
#: Outputs in the order of the JSON; complex ones are pairs of real and imaginary part.
_JSON = (
    *_SHOWN[:6],
    *("harmonics", "multipliers", "log_multipliers"),
    *_SHOWN[6:],
    *("converged", "result"),
)


@click.command(epilog=_EPILOG)
@point_options
@output_options(plot=True)
@switch(
    "--stick-slip",
    "Without a modulation: period, drop and durations of stick-slip, if there is any.",
)
@option("--table", "CSV", "Solve every row of a table.", Path)
@option("--out", "CSV", "Where the table with its results goes.", Path)
@switch("--resume", "Continue an interrupted table.")
def response(
    point: Point,
    output: Output,
    stick_slip: bool,
    table: Path | None,
    out: Path | None,
    resume: bool,
) -> int:
    """Periodic response to a modulated normal load.

    Mean friction, harmonics of the force and Floquet multipliers of the periodic orbit, stable or
    unstable; without inertia by default.
    """
    if stick_slip:
        alone, others = not (table or out or resume), "--table, --out or --resume"
        advice = "leave it out, or take asperity.experiment.stick_slip_response with arrays"
        require(alone, "--stick-slip", "go with one point", others, advice)
        return _stick_slip(point, output)
    if table is None:
        without, advice = not (out or resume), "name it or leave them out"
        require(without, "--out and --resume", "go with --table", "no table", advice)
        return _point(point, output)
    require(out, "--out", "be given with --table", "nothing", "name the output file")
    require(not output.plot, "--plot", "go with one point", "a table", "leave one of them out")
    assert out is not None
    return _table(table, out, point, resume, output)


def _point(point: Point, output: Output) -> int:
    from asperity.cli.progress import waiting
    from asperity.laws import get_law
    from asperity.operating_point import point_numbers, respond
    from asperity.parameters import OUTPUTS

    output.require_picture()
    numbers = point_numbers(point, "command line")
    values = {name: number.value for name, number in numbers.items()}
    with waiting("compiling the law's equations, kept for the next call"):
        result = respond(get_law(point.law), values)
    if not result.converged:
        if output.as_json:
            output.answer(lambda: _record(result, numbers), list, point.law)
        say(result.result[()])
        return 1
    about = {name: (OUTPUTS[name].unit, OUTPUTS[name].meaning) for name in _SHOWN}
    rows = [(name, getattr(result, name)[()], *about[name]) for name in _SHOWN]
    output.answer(
        lambda: _record(result, numbers),
        lambda: _sections(point.law, numbers, "response", rows, output),
        point.law,
    )
    output.draw(result.plot)
    if not result.stable:
        say(
            "the response is unstable: the slider leaves it for another motion, whose mean and "
            "harmonics differ; asperity run integrates the motion"
        )
    if result.reverses:
        say(result.result[()])
    return 0


def _record(response: PeriodicResponse, numbers: dict[str, SourcedNumber]) -> dict[str, Any]:
    """The response of one point for JSON; numbers are NaN without a converged response."""
    import numpy as np

    from asperity.materials import cited_works
    from asperity.parameters import OUTPUTS, point_parameters

    record: dict[str, Any] = {}
    for name in _JSON:
        value = np.asarray(getattr(response, name))
        if value.dtype.kind in "fc" and not response.converged:
            value = value * np.nan  # both parts of complex numbers
        record |= dict.fromkeys((name, *OUTPUTS[name].former), value)
    units = point_parameters(type(response.slider.law))
    provenance = response.provenance
    record["provenance"] = {
        "version": provenance.pop("asperity_version"),
        **provenance,
        "parameters": {
            name: {"value": number.value, "unit": units[name].unit, "from": number.origin}
            for name, number in numbers.items()
        },
        "citation": cited_works(provenance["source"]),
    }
    return record


def _stick_slip(point: Point, output: Output) -> int:
    from asperity._version import __version__
    from asperity.experiment import stick_slip_response
    from asperity.laws import Law, get_law
    from asperity.operating_point import point_numbers
    from asperity.parameters import MODULATION, canonical_name, point_parameters
    from asperity.slider.parameters import slider_from

    output.require_picture()
    law: type[Law] = get_law(point.law) if point.law else Law
    known = point_parameters(law)
    modulation = ("epsilon", "frequency", *MODULATION)
    for name, value in point.parameters.items():
        advice = "leave it out, or leave --stick-slip out"
        without = canonical_name(name, known) not in modulation
        rule, got = "come without a modulation", f"{name} = {value}"
        require(without, "--stick-slip", rule, got, advice)
    among = {n: p for n, p in known.items() if n not in modulation}
    numbers = point_numbers(point, "command line", among)
    values = {name: number.value for name, number in numbers.items()}
    result = stick_slip_response(
        slider_from(law, values), velocity=values["V"],
        inertia=bool(values.get("inertia", 0.0)), radiation_damping=values.get("eta"),
    )  # fmt: skip
    rows = result.values()
    shown = [row for row in rows if result.slips or row[0] in ("steady", "stable")]
    about = {"result": str(result.result), "asperity_version": __version__, "law": law.name}
    output.answer(
        lambda: {**{name: value for name, value, *_ in rows}, **about, "parameters": values},
        lambda: _sections(law.name, numbers, str(result.result), shown, output),
        law.name,
    )
    if result.slips:
        output.draw(result.plot)
    elif output.plot is not None:
        say(f"there is no figure {output.plot}: {result.result}")
    return 0 if result.slips or result.steady else 1


def _sections(
    law: str, numbers: dict[str, SourcedNumber], heading: str, outputs: list[Any], output: Output
) -> list[Section]:
    """Inputs with their sources, and outputs: rows of name, value, unit and meaning."""
    from asperity.laws import get_law
    from asperity.outputs.sections import Section
    from asperity.parameters import point_parameters
    from asperity.units import format_si

    kinds = point_parameters(get_law(law))
    inputs = [
        (symbol(name), format_si(number.value, kinds[name].kind, 6), number.origin)
        for name, number in numbers.items()
    ]
    rows = []
    for name, value, unit, meaning in outputs:
        if value == "" or (isinstance(value, float) and not math.isfinite(value)):
            continue  # a law without states has no modes
        text = f"{value:.9g} {unit}".removesuffix(" 1") if isinstance(value, float) else str(value)
        yes_or_no = name in ("stable", "steady")
        rows.append((name, ("no", "yes")[int(value)] if yes_or_no else text, symbol(meaning)))
    stresses = output.names == "geophysics"
    title = f"{law}, of forces per square metre: N for Pa" if stresses else law
    return [Section(title, rows=tuple(inputs)), Section(heading, rows=tuple(rows))]


def _table(table: Path, out: Path, point: Point, resume: bool, output: Output) -> int:
    from asperity.cli.progress import bar
    from asperity.laws import get_law
    from asperity.operating_point import material_of, sourced_numbers
    from asperity.outputs.sections import Section
    from asperity.parameters.parameter import count_text
    from asperity.study.table import run_table

    law = get_law(point.law).name if point.law else None
    filled = sourced_numbers(point.parameters, material_of(point), "command line", law)
    values = {name: number.value for name, number in filled.items()}
    given = [name for name, number in filled.items() if number.origin == "command line"]
    with bar("point", "responses") as update:
        done = run_table(
            table, out, law=law, filled=values, given=given, resume=resume, progress=update
        )
    output.answer(
        lambda: {"rows": done.rows, "failed": done.failed, "out": str(out)},
        lambda: [Section("", (f"{count_text(done.rows, 'row')} in {out}",))],
    )
    if done.failed:
        say(
            f"{done.failed} of {done.rows} rows have no response; the column 'result' of {out} "
            "says why"
        )
    return 1 if done.failed else 0
