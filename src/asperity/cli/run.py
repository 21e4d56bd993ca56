"""``asperity run``: an experiment written as text, from its first step to its last."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from asperity.cli.options import json_option
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.study.protocol import Protocol, RunSummary, Setup

_EPILOG = """\b
Examples:
  asperity run protocol.toml --out run.nc --csv --plot
  asperity run protocol.toml --out run.nc --record recording.csv
  asperity run protocol.toml --out run.nc --resume

\b
A protocol:
  law = "elasto-plastic"
  material = "bureau2000"
  steps = [
    "slide for 5 s",
    "modulate 24 % at 120 Hz for 2 s",
    "step load to 9 N",
    "ramp velocity to 100 um/s in 5 s",
    { repeat = 3, steps = ["hold 10 s", "slide at 10 um/s for 5 s"] },
  ]
  [parameters]
  K = "0.5 N/um"
  [start]
  velocity = "10 um/s"
  [solver]
  sampling = "2 kHz"

\b
Exit code 0: done; 1: the motion ended before the programme, and why is said;
2: bad input; 130: interrupted.
"""


@click.command(epilog=_EPILOG)
@click.argument("protocol", type=Path)
@click.option("--out", type=Path, metavar="NC", required=True, help="Where the motion goes.")
@click.option("--csv", "as_csv", is_flag=True, help="Write it as text too, beside --out.")
@click.option("--plot", is_flag=True, help="Draw it too, as a PNG beside --out.")
@click.option(
    "--record",
    type=Path,
    metavar="FILE",
    help="Record it with the protocol's tribometer: .csv, .txt, .h5 or .tdms.",
)
@click.option("--resume", is_flag=True, help="Go on with an interrupted run.")
@json_option()
def run(
    protocol: Path,
    out: Path,
    as_csv: bool,
    plot: bool,
    record: Path | None,
    resume: bool,
    as_json: bool,
) -> int:
    """Run a protocol: the motion of a slider under a programme of load and drive.

    PROTOCOL is a TOML file; the motion is written as NetCDF, with all that it depends on.
    """
    from asperity.cli.progress import bar
    from asperity.instrument.writers import write
    from asperity.study.protocol import (
        ProtocolError,
        load_protocol,
        record_run,
        run_protocol,
        write_csv,
    )

    _check_names(protocol, out, as_csv, plot)
    try:
        asked = load_protocol(protocol)
    except ProtocolError as error:
        return _tell(protocol, error.mistakes)
    setup = None if record is None else _setup_for(asked, record)
    total = round(1e3 * asked.programme.duration)
    with bar("ms") as update:
        done = run_protocol(
            asked, out, resume=resume, progress=lambda t: update(round(1e3 * t), total, "")
        )
    files = [out]
    if as_csv:
        files.append(write_csv(out, out.with_suffix(".csv")))
    if plot:
        files.append(_draw(out, out.with_suffix(".png")))
    if record is not None and setup is not None:
        files.append(write(record_run(setup, out), record))
    _report(asked, done, files, as_json)
    if done.stopped:
        click.echo(f"asperity: {done.stopped}", err=True)
    return 1 if done.stopped else 0


def _check_names(protocol: Path, out: Path, as_csv: bool, plot: bool) -> None:
    """Before anything is computed: a name must not cost the work."""
    if out.resolve() == protocol.resolve():
        raise InputError(
            f"--out must be another file than the protocol, got '{out}'; name it like run.nc"
        )
    for wanted, suffix in ((as_csv, ".csv"), (plot, ".png")):
        if wanted and out.suffix.lower() == suffix:
            raise InputError(
                f"--out must be another file than the {suffix} beside it, got '{out}'; "
                "name it like run.nc"
            )


def _tell(protocol: Path, mistakes: tuple[str, ...]) -> int:
    """All mistakes at once, a line each."""
    for mistake in mistakes:
        click.echo(f"asperity: {protocol}: {' '.join(mistake.split())}", err=True)
    return 2


def _setup_for(asked: Protocol, record: Path) -> Setup:
    """The protocol's tribometer, before anything is computed."""
    from asperity.instrument.writers import check_path

    if asked.setup is None:
        raise InputError(
            f"--record must go with a [tribometer] in the protocol, got '{record}' and none; "
            "describe its sensors or leave the option out"
        )
    check_path(record)
    return asked.setup


def _draw(run_file: Path, picture: Path) -> Path:
    from asperity.figures.style import style
    from asperity.figures.trajectory import draw_run
    from asperity.study.protocol import outline

    with style():
        figure = draw_run(outline(run_file))
        try:
            figure.savefig(picture, metadata={"Software": None})
        except OSError as error:
            raise InputError(
                f"--plot must be written beside --out, got '{picture}' ({error.strerror}); "
                "choose a folder that is writable and has room"
            ) from None
    return picture


def _report(asked: Protocol, done: RunSummary, files: list[Path], as_json: bool) -> None:
    from asperity.cli.report import aligned, to_json

    if as_json:
        click.echo(
            to_json(
                {
                    "rows": done.rows,
                    "events": done.events,
                    "time": done.time,
                    "duration": asked.programme.duration,
                    "stopped": done.stopped,
                    "files": [str(file) for file in files],
                }
            )
        )
        return
    rows = [
        ("time", f"{done.time:.9g} s", f"of {asked.programme.duration:.9g} s"),
        ("rows", str(done.rows), ""),
        ("events", str(done.events), ""),
        ("files", ", ".join(map(str, files)), ""),
    ]
    click.echo(f"{asked.law}\n{aligned(rows, '  ')}")
