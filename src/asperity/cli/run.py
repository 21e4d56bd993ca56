"""``asperity run``: an experiment written as text, from its first step to its last."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from asperity.cli.options import law_option, option, output_options, switch
from asperity.cli.report import Output, save_figure, say
from asperity.errors import InputError, naming

if TYPE_CHECKING:
    from asperity.protocol import Protocol, RunSummary

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


@click.command(epilog=_EPILOG, short_help="The motion of a slider in an experiment.")
@click.argument("protocol", type=Path)
@option("--out", "NC", "Where the motion goes.", Path, required=True)
@output_options(plot=True)
@switch("--csv as_csv", "Write the motion as text too, next to --out.")
@option(
    "--record",
    "FILE",
    "Record the motion with the protocol's tribometer: .csv, .txt, .h5 or .tdms.",
    Path,
)
@law_option("Make a law of your own known to the protocol: module:Name or file.py:Name.")
@switch("--resume", "Continue an interrupted run.")
def run(
    protocol: Path,
    out: Path,
    as_csv: bool,
    output: Output,
    record: Path | None,
    law: str | None,
    resume: bool,
) -> int:
    """Run a protocol: the motion of a slider under a programme of load and drive.

    PROTOCOL is a TOML file; the motion is written as NetCDF, with all that it depends on.
    """
    from asperity.cli.progress import bar
    from asperity.outputs import output_files, require_netcdf
    from asperity.protocol import (
        load_protocol,
        outline,
        record_run,
        run_protocol,
        write_csv,
    )
    from asperity.recording.writers import check_path, write

    text = out.with_suffix(".csv") if as_csv else None
    output.require_picture(protocol)
    output_files(
        {"--out": out, "--csv": text, "--plot": output.plot, "--record": record},
        inputs={"protocol": protocol},
    )
    require_netcdf(out, "--out", "run.nc")
    with naming(symbols=str):  # protocols have the names of friction
        wanted = load_protocol(protocol)
    if law is not None and wanted.law != law:
        got = f"'{law}' and law = '{wanted.law}'"
        advice = "change one of them or leave the option out"
        raise InputError("--law", "be the law of the protocol", got, advice)
    if record is not None:
        if wanted.setup is None:
            advice = "describe its sensors or leave the option out"
            got = f"'{record}' and none"
            raise InputError("--record", "go with a [tribometer] in the protocol", got, advice)
        check_path(record, "--record")
    _check_room(wanted, out, text, record)
    with bar("ms", "motion") as update:
        done = run_protocol(
            wanted,
            out,
            resume=resume,
            progress=lambda time, end: update(round(1e3 * time), round(1e3 * end)),
        )
    files = [out]
    with _after_the_motion(files):
        if text is not None:
            files.append(write_csv(out, text))
        if output.plot is not None:
            from asperity.figures.trajectory import draw_run

            save_figure(lambda: draw_run(outline(out)), output.plot, output.names)
            files.append(output.plot)
        if record is not None and wanted.setup is not None:
            files.append(write(record_run(wanted.setup, out), record))
    _report(wanted, done, files, output)
    say(done.unstable_start, done.stopped)
    return 1 if done.stopped else 0


@contextmanager
def _after_the_motion(files: list[Path]) -> Iterator[None]:
    """On Ctrl-C, name the files that are complete: the motion and those written after it."""
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
        say(
            f"writing the integrator's steps to {out}; to measure or fit it, give the protocol a "
            '[solver] sampling, like "50 Hz"'
        )
        return
    way_out = "lower solver.sampling, shorten the steps or leave the option out"
    rows, size = f"{wanted.rows:.6g} rows", wanted.rows * wanted.row_bytes
    if text is not None:
        size += 8 * _TEXT_BYTES * wanted.rows
        require_disk(size, text.resolve().parent, "--csv", rows, way_out)
    if record is not None:
        # Signals of the motion and of the recording's channels are in memory as a whole.
        require_memory(2 * wanted.rows * wanted.row_bytes, "--record", rows, way_out)
    require_disk(size, out.resolve().parent, "solver.sampling", rows,
                 "lower the rate, shorten the steps or write to another disk")  # fmt: skip
    say(f"writing {rows}, about {size_text(size)}, to {out}")


def _report(wanted: Protocol, done: RunSummary, files: list[Path], output: Output) -> None:
    from asperity.outputs.sections import Section

    duration = wanted.programme.duration
    rows = (
        ("time", f"{done.time:.9g} s", f"of {duration:.9g} s"),
        ("rows", str(done.rows), ""),
        ("events", str(done.events), ""),
        ("files", ", ".join(map(str, files)), ""),
    )
    output.answer(
        lambda: {
            **{name: getattr(done, name) for name in ("rows", "events", "time")},
            "duration": duration,
            "stopped": done.stopped,
            "stability": done.unstable_start or None,
            "files": [str(file) for file in files],
        },
        lambda: [Section(wanted.law, rows=rows)],
        wanted.law,
    )
