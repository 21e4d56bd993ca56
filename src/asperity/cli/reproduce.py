"""``asperity reproduce``: every result of a paper as figures, tables and a list of claims."""

from __future__ import annotations

from pathlib import Path

import click

from asperity.cli.options import option


@click.command(epilog="Example: asperity reproduce --out report")
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
    """Reproduce a PAPER, the first one in alphabetical order if none is named.

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
