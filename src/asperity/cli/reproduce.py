"""``asperity reproduce``: every result of the paper as figures, tables and a list of claims."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from asperity.errors import InputError


@click.command(epilog="Example: asperity reproduce --out report")
@click.option(
    "--out", type=Path, metavar="DIR", required=True, help="Folder for the report; made if absent."
)
def reproduce(out: Path) -> int:
    """Reproduce Bureau, Baumberger and Caroli (2000).

    Writes the figures (PNG, PDF and CSV), claims.json, claims.csv and index.html, which is the
    place to start reading.
    """
    _check_writable(out)
    from asperity.cli.progress import bar
    from asperity.report import reproduce as reproduce_paper

    try:
        with bar("step") as update:
            summary = reproduce_paper(
                out, progress=lambda label, done, total: update(done, total, label)
            )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted; the report in {out} is not complete, repeat the command"
        ) from None
    for line in summary.lines():
        click.echo(line)
    click.echo(f"\nReport: {out / 'index.html'}")
    return 1 if summary.failed else 0


def _check_writable(folder: Path) -> None:
    """Find out before the work, not after it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Permission bits do not tell for root, full disks and read-only mounts: write and see.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"out must be a folder that can be written, got '{folder}' ({error.strerror}); "
            "choose another"
        ) from None
