"""``asperity design``: which operating points to measure next."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from asperity.cli.options import Count, option, output_options
from asperity.cli.report import Output
from asperity.errors import symbol, symbols

if TYPE_CHECKING:
    from asperity.inference import Design
    from asperity.outputs.sections import Section

_EPILOG = """\b
Examples:
  asperity design plan.toml
  asperity design plan.toml --simulate 200 --csv points.csv --json

\b
A plan names the law, its free parameters with the values that are expected,
the ranges of V, epsilon, frequency and other settings, what is measured with
which noise, a number of points or a time, and an aim: parameters to measure or
a rival law to exclude. Quantities carry their unit. docs/design.md has a plan
line by line, examples/load_on_age.toml is one.
"""


@click.command(epilog=_EPILOG)
@click.argument("plan", type=Path)
@option(
    "--simulate",
    "N",
    "Fit N synthetic sets of readings and compare the spread of the estimates.",
    Count(0),
    default=0,
)
@option("--csv table", "CSV", "Write the points as a table for `response`.", Path)
@output_options()
def design(plan: Path, simulate: int, table: Path | None, output: Output) -> int:
    """Operating points that measure parameters or exclude a law best.

    The answer has the points, the expected standard errors, and the number of readings of an even
    grid with the same interval, in multiples of the design's.
    """
    from asperity import inference
    from asperity.cli.progress import bar
    from asperity.outputs import output_file, write_table, written_file

    target = None
    if table is not None:
        target = output_file(table, "--csv", example="points.csv", inputs={"plan": plan})
    checked = inference.read_plan(plan)
    with bar("step", "design") as update:
        result = inference.design(checked, simulate=simulate, progress=update)
    if target is not None:
        rows = result.rows()
        with written_file(target) as fresh:
            write_table(fresh, rows[0], [row.values() for row in rows])
    output.answer(result.record, lambda: _sections(result), checked.truth.law.name)
    aims = checked.question.measure
    return int(any(math.isinf(result.parameters[name].se) for name in aims))


def _sections(result: Design) -> list[Section]:
    """A design as sections of text."""
    from asperity.outputs.sections import Section
    from asperity.parameters import point_parameters
    from asperity.units import format_si

    plan = result.plan
    known = point_parameters(plan.truth.law)
    axes = list(plan.axes)
    rows = []
    for p in result.points:
        settings = [format_si(p.setting[n], known[n].kind, 4) for n in axes]
        predicted = [f"{v:.4g} +- {e:.1g}" for v, e in p.predicted.values()]
        rows.append((*settings, str(p.readings), *predicted))
    aim = f"to measure {symbols(plan.question.measure)}"
    if plan.rival is not None:
        aim = f"to exclude {plan.rival.law.name}"
    title = f"{plan.truth.law.name}: {result.readings} readings {aim}"
    points = Section(title, head=(*map(symbol, axes), "readings", *plan.noise), rows=tuple(rows))
    numbers = tuple(
        (symbol(n), f"{p.value:.4g}", f"{p.se:.3g}", f"{p.se_even_grid:.3g}", p.unit)
        for n, p in result.parameters.items()
    )
    head = ("", "expected", "std. error", "even grid", "")
    grid = " x ".join(f"{m} {symbol(n)}" for n, m in zip(axes, result.grid_levels, strict=True))
    what = "chi-squared" if plan.rival is not None else "interval"
    fewer = "infinitely many" if math.isinf(result.fewer) else f"{result.fewer:.3g}"
    if math.isnan(result.fewer):
        fewer = "an unknown number of"
    lines = [
        f"{fewer} times fewer readings than an even grid for the same {what} ({grid}; "
        f"{result.grid_usable[0]} of {result.grid_usable[1]} usable)",
        f"efficiency at least {result.efficiency:.3f}, with whole numbers of readings "
        f"{result.efficiency_whole:.3f}",
        f"{result.candidates} of {result.combinations} combinations can be used",
        *(f"  {count} cannot: {reason}" for reason, count in result.left_out.items()),
    ]
    if plan.rival is not None:
        lines.append(_separation(result, plan.rival.law.name))
    for axis, levels in result.alone.items():
        best = min(levels, key=lambda level: level[2])
        several = [f"{format_si(v, known[axis].kind, 3)}: {more:.3g}" for v, _, more in levels]
        lines.append(
            f"readings at one {symbol(axis)} alone, in multiples of the design's: "
            f"{', '.join(several)}; best {format_si(best[0], known[axis].kind, 3)}"
        )
    sections = [
        points,
        Section("parameters", head=head, rows=numbers),
        Section("", tuple(lines)),
    ]
    if plan.question.time is not None:
        spent = f"time {result.spent:.4g} s of {plan.budget:.4g} s"
        sections.insert(1, Section("", (spent,)))
    if (s := result.simulation) is not None:
        decided = "" if s.decided is None else f", {s.decided:.3g} of them exclude the rival"
        spread = tuple(
            (symbol(n), f"{x:.3g} +- {s.uncertainty[n]:.1g}", f"{result.parameters[n].se:.3g}")
            for n, x in s.spread.items()
        )
        title = f"{s.sets} simulated fits{decided}"
        sections.append(Section(title, head=("", "spread", "expected"), rows=spread))
    return [*sections, Section("", warnings=tuple(result.warnings))]


def _separation(result: Design, rival: str) -> str:
    """A sentence on how well a design excludes a rival."""
    values = "; ".join(f"{symbol(n)} = {v:.4g}" for n, v in (result.rival_values or {}).items())
    chi2, chi2_grid, probable, on_grid = (
        f"{x:.{digits}g}" if x is not None and math.isfinite(x) else "unknown"
        for x, digits in (
            (result.chi2, 4),
            (result.chi2_even_grid, 4),
            (result.probability, 3),
            (result.probability_even_grid, 3),
        )
    )
    return (
        f"expected chi-squared {chi2} (even grid {chi2_grid}), "
        f"probability of deciding {probable} (even grid {on_grid}); "
        f"{rival} comes nearest with {values}"
    )
