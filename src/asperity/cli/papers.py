"""``asperity recipe`` and ``asperity reproduce``: a paper's procedure, and all its results."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import option, output_options, settings_of
from asperity.cli.report import Output
from asperity.cli.words import fields_as_options
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.ledger import RecipeResult
    from asperity.outputs.sections import Section

_EPILOG = """\b
Example:
  asperity recipe bureau2000 readings.csv --thresholds bifurcation.csv \\
      --fix "K=0.2 N/um" --fix "W0=7 N"

\b
Readings: a table as for 'asperity fit'. Rows with epsilon = 0 and mean_friction,
at two velocities or more, give B - A; rows with epsilon above 0 and delta_mu
give eps_ratio and bound alpha; mu1 gives lambda. Cells may be empty.

\b
Thresholds: bifurcations between steady sliding and stick-slip, one a row, in SI or
with units in the heading: V, K_over_W0 (1/m), K_over_W0_err, frequency (Hz) of
the first oscillations, frequency_err. They give A, B and D0.
"""


#: Numbers that may be the same for all rows of the readings.
_OF_ROWS = ("V", "epsilon", "frequency")


@click.command(epilog=_EPILOG, short_help="Parameters by the steps of a paper.")
@click.argument("paper")
@click.argument("readings", nargs=-1, required=True, type=Path)
@option("--thresholds", "CSV", "Table of bifurcations.", Path, required=True)
@option(
    "--fix fixes",
    "NAME=VALUE",
    "K, W0, V0; V, epsilon, frequency of all rows.",
    multiple=True,
)
@output_options()
def recipe(
    paper: str,
    readings: tuple[Path, ...],
    thresholds: Path,
    fixes: tuple[str, ...],
    output: Output,
) -> int:
    """Parameters by the steps of a PAPER, compared with the numbers that it prints.

    For bureau2000: A, B and D0 from steady sliding and its bifurcation, eps_ratio from the drop of
    the mean, lambda from mu1, a bound on alpha from the drop; uncertainties of all steps.
    """
    from asperity import inference
    from asperity.cli.progress import bar
    from asperity.inference.tables.table import joined
    from asperity.ledger import available, find_paper

    if not find_paper(paper).has("recipe"):
        others = [name for name in available() if find_paper(name).has("recipe")]
        advice = f"name {' or '.join(others) or 'another paper'}"
        raise InputError("paper", "have a recipe", f"'{paper}', which has none", advice)
    steps: Any = find_paper(paper).module("recipe")
    bifurcations = steps.read_thresholds(thresholds)
    fixed = settings_of(fixes, "--fix")
    of_rows = {name: text for name, text in fixed.items() if name in _OF_ROWS}
    with fields_as_options({"fixed": "--fix"}):
        tables = [inference.read_table(path, of_rows) for path in readings]
    table = tables[0] if len(tables) == 1 else joined(tables)[0]
    with bar("step", "recipe") as update:
        result = steps.paper_procedure(table, bifurcations, fixed=fixed, progress=update)
    output.answer(result.record, lambda: [_section(result)], indent="")
    return 0


def _section(result: RecipeResult) -> Section:
    """Computed and published numbers in a table."""
    from asperity.outputs.sections import Section

    rows = []
    for name, r in result.numbers.items():
        here = f"{r.value:.4g} +- {r.se:.2g} {r.unit}".rstrip()
        if r.upper_limit_95 is not None:
            here = f"below {r.upper_limit_95:.3g} (95 %)"
        paper = ""
        if r.published is not None:
            paper = f"{r.published:.4g}"
            if r.published_uncertainty:
                paper += f" +- {r.published_uncertainty:.2g}"
            paper = f"{paper} {r.unit}".rstrip() + f" ({r.published_place})"
        apart = "" if r.deviation is None else f"{r.deviation:+.1f} s.d."
        rows.append((str(r.step), name, here, paper, apart, r.how))
    head = ("step", "", "here", "paper", "", "from")
    return Section("", head=head, rows=tuple(rows), warnings=tuple(result.warnings))


@click.command(
    epilog="Example: asperity reproduce --out report",
    short_help="Reproduce a paper, statement by statement.",
)
@click.argument("paper", required=False)
@option("--out", "DIR", "Folder for the report; made if absent.", Path, required=True)
@option(
    "--data",
    "CSV",
    "Measured or digitised points to draw and to compare with the curves; columns figure, "
    "observable, series, x, y, y_err, source.",
    Path,
)
def reproduce(paper: str | None, out: Path, data: Path | None) -> int:
    """Reproduce a PAPER; without a name, the first paper in alphabetical order.

    Writes the figures (PNG, PDF and CSV), claims.json, claims.csv and index.html, which is the
    place to start reading; with --data also agreement.json and data/points.csv. Papers are found
    as entry points of the group asperity.papers.
    """
    from asperity.cli.progress import bar
    from asperity.ledger import find_paper, reproduce as reproduce_paper

    try:
        with bar("step") as update:
            summary = reproduce_paper(
                find_paper(paper),
                out,
                progress=update,
                data=data,
            )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted; {out} is as it was, repeat the command for the report"
        ) from None
    for line in summary.lines():
        click.echo(line)
    click.echo(f"\nReport: {out / 'index.html'}")
    return 1 if summary.failed else 0
