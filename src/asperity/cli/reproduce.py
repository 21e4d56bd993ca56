"""``asperity reproduce``: every result of the paper as figures, tables and a list of claims."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(epilog="Example: asperity reproduce --out report")
@click.option(
    "--out", type=Path, metavar="DIR", required=True, help="Folder for the report; made if absent."
)
def reproduce(out: Path) -> int:
    """Reproduce Bureau, Baumberger and Caroli (2000).

    Writes the figures (PNG, PDF and CSV), claims.json, claims.csv and index.html, which is the
    place to start reading.
    """
    from asperity.cli.progress import bar
    from asperity.report import reproduce as reproduce_paper

    try:
        with bar("step") as update:
            summary = reproduce_paper(
                out, progress=lambda label, done, total: update(done, total, label)
            )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted; {out} is as it was, repeat the command for the report"
        ) from None
    for line in summary.lines():
        click.echo(line)
    click.echo(f"\nReport: {out / 'index.html'}")
    return 1 if summary.failed else 0
