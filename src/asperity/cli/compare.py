"""``asperity compare``: which friction laws do the data exclude."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from asperity.cli.fit.command import checked_laws, fit_options
from asperity.cli.fit.data import FitData
from asperity.errors import InputError
from asperity.outputs import require_folder

_EPILOG = """\b
Example:
  asperity compare readings.csv --laws rice-ruina,linker-dieterich,elasto-plastic \\
      --material bureau2000 --free lambda,alpha,eps_ratio,A,B

\b
Each law takes those of the free parameters that it has. A law is excluded if
chi-squared has a probability below 0.001 while that of another law has not, or
if its AICc exceeds the lowest by 10 or more.
"""


@click.command(epilog=_EPILOG)
@click.option(
    "--laws",
    default="all",
    metavar="NAMES",
    help="Laws to compare: a,b,c or all; of your own as module:Name or file.py:Name.",
)
@click.option("--windows", hidden=True, metavar="SPANS")
@fit_options
@click.option("--report", type=Path, metavar="DIR", help="Folder for a page and materials.")
def compare(
    data: tuple[Path, ...],
    laws: str,
    free: list[str] | None,
    options: Mapping[str, Any],
    reading: FitData,
    windows: str | None,
    report: Path | None,
    as_json: bool,
) -> int:
    """Fit several laws to the same readings and say which the data exclude."""
    from asperity import inference
    from asperity.cli.progress import bar
    from asperity.cli.report import aligned, to_json
    from asperity.inference.comparison.record import comparison_record, laws_table

    if windows is not None:
        raise InputError(
            "--windows must go with asperity fit, got it with compare: windows of one recording "
            "overlap, so that what they say against a law does not add up; compare with --window "
            "START:END, one at a time"
        )
    if report is not None:
        require_folder(report, "--report")
    options = {**options, "prior": reading.stiffness_prior(data, options)}
    read = reading.read(data, options["fixed"])
    with bar("%", raising=False) as update:
        comparison = inference.compare(
            read,
            checked_laws(laws),
            free,
            progress=lambda done, total: update(round(100 * done / total), 100),
            **options,
        )
    if report is not None and any(j.fit.converged for j in comparison.laws.values()):
        from asperity.fit_report import write_comparison

        write_comparison(report, comparison)
    if as_json:
        click.echo(to_json(comparison_record(comparison)))
    else:
        head, rows = laws_table(comparison)
        click.echo(aligned([head, *rows]))
        click.echo(comparison.verdict)
    return 0 if all(j.fit.converged for j in comparison.laws.values()) else 1
