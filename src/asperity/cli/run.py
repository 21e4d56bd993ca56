"""``asperity run``: an experiment written as text, from its first step to its last."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from asperity.cli.options import json_option, law_option, names_option, plot_option
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.parameters import Names
    from asperity.protocol import Protocol, RecordingSetup, RunSummary

_EPILOG = """\b
Examples:
  asperity run protocol.toml --out run.nc --csv --plot run.png
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
Exit code 0: done; 1: the motion ended before the programme, with the reason;
2: bad input; 130: interrupted.
"""


@click.command(epilog=_EPILOG)
@click.argument("protocol", type=Path)
@click.option("--out", type=Path, metavar="NC", required=True, help="Where the motion goes.")
@plot_option()
@names_option()
@json_option()
@click.option("--csv", "as_csv", is_flag=True, help="Write it as text too, next to --out.")
@click.option(
    "--record",
    type=Path,
    metavar="FILE",
    help="Record it with the protocol's tribometer: .csv, .txt, .h5 or .tdms.",
)
@law_option("Make a law of your own known to the protocol: module:Name or file.py:Name.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted run.")
def run(
    protocol: Path,
    out: Path,
    as_csv: bool,
    plot: Path | None,
    names: Names,
    record: Path | None,
    law: str | None,
    resume: bool,
    as_json: bool,
) -> int:
    """Run a protocol: the motion of a slider under a programme of load and drive.

    PROTOCOL is a TOML file; the motion is written as NetCDF, with all that it depends on.
    """
    from asperity.cli.progress import bar
    from asperity.cli.report import require_picture, save_figure
    from asperity.outputs import output_files
    from asperity.protocol import (
        ProtocolError,
        load_protocol,
        outline,
        record_run,
        run_protocol,
        write_csv,
    )
    from asperity.recording.writers import write

    text = out.with_suffix(".csv") if as_csv else None
    require_picture(plot, protocol)
    output_files(
        {"--out": out, "--csv": text, "--plot": plot, "--record": record},
        inputs={"protocol": protocol},
    )
    try:
        wanted = load_protocol(protocol)
        if law is not None and wanted.law != law:
            raise InputError(
                f"--law must be the law of the protocol, got '{law}' and law = '{wanted.law}'; "
                "change one of them or leave the option out"
            )
    except ProtocolError as error:
        return _print_mistakes(protocol, error.mistakes)
    setup = None if record is None else _setup_for(wanted, record)
    _check_room(wanted, out, text, record)
    with bar("ms", "motion") as update:

        def in_milliseconds(time: float, end: float) -> None:
            update(round(1e3 * time), round(1e3 * end), "")

        done = run_protocol(wanted, out, resume=resume, progress=in_milliseconds)
    statement = done.unstable_start
    files = [out]
    with _after_the_motion(files):
        if text is not None:
            files.append(write_csv(out, text))
        if plot is not None:
            from asperity.figures.trajectory import draw_run

            save_figure(lambda: draw_run(outline(out)), plot, names)
            files.append(plot)
        if record is not None and setup is not None:
            files.append(write(record_run(setup, out), record))
    _report(wanted, done, files, as_json, statement)
    if statement:
        click.echo(f"asperity: {statement}", err=True)
    if done.stopped:
        click.echo(f"asperity: {done.stopped}", err=True)
    return 1 if done.stopped else 0


@contextmanager
def _after_the_motion(files: list[Path]) -> Iterator[None]:
    """On Ctrl-C, say that the motion is finished and which other files are."""
    from asperity.cli.progress import interruptible

    try:
        with interruptible():
            yield
    except KeyboardInterrupt:
        written = ", ".join(f"'{file}'" for file in files)
        raise KeyboardInterrupt(
            f"interrupted after the motion was finished; {written} "
            f"{'is' if len(files) == 1 else 'are'} whole, and nothing else was written"
        ) from None


#: Bytes of a number in a text file, with its comma.
_TEXT_BYTES = 18


def _check_room(wanted: Protocol, out: Path, text: Path | None, record: Path | None) -> None:
    """Print the size of the run; refuse one that disk or memory cannot hold."""
    from asperity.outputs import require_disk, require_memory, size_text

    if wanted.rows is None:
        click.echo(f"asperity: writing the integrator's steps to {out}", err=True)
        return
    way_out = "lower solver.sampling, shorten the steps or leave the option out"
    rows, size = f"{wanted.rows:.6g} rows", wanted.rows * wanted.row_bytes
    if text is not None:
        size += 7 * _TEXT_BYTES * wanted.rows
        require_disk(size, text.resolve().parent, "--csv", rows, way_out)
    if record is not None:
        # A recording is made of whole signals: those of the motion and those of its channels.
        require_memory(2 * wanted.rows * wanted.row_bytes, "--record", rows, way_out)
    require_disk(size, out.resolve().parent, "solver.sampling", rows,
                 "lower the rate, shorten the steps or write to another disk")  # fmt: skip
    click.echo(f"asperity: writing {rows}, about {size_text(size)}, to {out}", err=True)


def _print_mistakes(protocol: Path, mistakes: tuple[str, ...]) -> int:
    """A line for each mistake."""
    for mistake in mistakes:
        click.echo(f"asperity: {protocol}: {' '.join(mistake.split())}", err=True)
    return 2


def _setup_for(wanted: Protocol, record: Path) -> RecordingSetup:
    """The protocol's tribometer, before anything is computed."""
    from asperity.recording.writers import check_path

    if wanted.setup is None:
        raise InputError(
            f"--record must go with a [tribometer] in the protocol, got '{record}' and none; "
            "describe its sensors or leave the option out"
        )
    check_path(record)
    return wanted.setup


def _report(
    wanted: Protocol, done: RunSummary, files: list[Path], as_json: bool, statement: str
) -> None:
    from asperity.cli.report import to_json
    from asperity.outputs.tables import aligned

    if as_json:
        click.echo(
            to_json(
                {
                    "rows": done.rows,
                    "events": done.events,
                    "time": done.time,
                    "duration": wanted.programme.duration,
                    "stopped": done.stopped,
                    "stability": statement or None,
                    "files": [str(file) for file in files],
                }
            )
        )
        return
    rows = [
        ("time", f"{done.time:.9g} s", f"of {wanted.programme.duration:.9g} s"),
        ("rows", str(done.rows), ""),
        ("events", str(done.events), ""),
        ("files", ", ".join(map(str, files)), ""),
    ]
    click.echo(f"{wanted.law}\n{aligned(rows, '  ')}")
