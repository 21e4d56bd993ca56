"""``asperity measure``: friction in a recording, with uncertainties and verdicts.

Options give times and spans of time themselves or in a file.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.measure.reading import FileRows, ReadingOptions
from asperity.cli.measure.source import RecordingSource, source_options
from asperity.cli.options import json_option
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.measurement.verdicts.verdict import Check


def span_of(text: str, option: str) -> tuple[float, float]:
    """Seconds of a START:END text, with or without their unit; an open end is infinite."""
    start, colon, end = (part.strip() for part in text.partition(":"))
    if not colon:
        raise InputError(f"{option} must be START:END, got '{text}'; write it like {option} 10:60")
    return (
        _seconds(start, option) if start else -math.inf,
        _seconds(end, option) if end else math.inf,
    )


def times_of(text: str, option: str) -> list[float]:
    """Seconds of a list like ``12.5,60``, or of a file with one time a line.

    Raises
    ------
    InputError
        If a part is no time, or there is none.
    """
    times = [_seconds(part, option) for part in _parts(text, option)]
    return sorted(times)


def spans_of(text: str, option: str) -> list[tuple[float, float]]:
    """Seconds of a list like ``100:110,200:300``, or of a file with one span a line."""
    spans = [span_of(part, option) for part in _parts(text, option)]
    if not all(math.isfinite(edge) for span in spans for edge in span):
        raise InputError(f"{option} must have a start and an end, got '{text}'; write both")
    return sorted(spans)


def _parts(text: str, option: str) -> list[str]:
    path = Path(text)
    if not re.fullmatch(r"[-+.\d\s,:;eE\w]*", text) or path.is_file():
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError):
            raise InputError(
                f"{option} must be times or a file that can be read, got '{text}'; check the name"
            ) from None
        # Two columns are a span.
        parts = [re.sub(r"[\s,;]+", ":", line.split("#")[0].strip()) for line in lines]
    else:
        parts = re.split(r"[,;]", text)
    result = [part.strip() for part in parts if part.strip()]
    if not result:
        raise InputError(
            f"{option} must hold times, got '{text}'; write them like {option} 12.5,60"
        )
    return result


def _seconds(part: str, option: str) -> float:
    from asperity.units import to_si

    return to_si(part if part[-1:].isalpha() else f"{part} s", "time", option)


_EPILOG = """\b
Examples:
  asperity measure recording.csv
  asperity measure recording.csv --load Fn --force Ft --unit Fn=N --unit Ft=N \\
      --frequency "120 Hz" --window 10:60 --json --plot recording.png
  asperity measure velocity_step.txt --no-modulation --plot steps.png
  asperity measure amplitudes.csv --amplitudes
  asperity measure day1/*.csv --out campaign.csv

\b
Convention: W/W0 = 1 + epsilon cos phi, phi from the measured load,
F/W0 = mean_friction + sum of mu_n cos(n phi + phase_n).

\b
Exit code 0: measured; 1: measured, but a check says bad, or rows of a table have a reason
in place of numbers; 2: bad input.
"""


@click.command(epilog=_EPILOG)
@click.argument("recordings", type=Path, nargs=-1, required=True)
@source_options
@click.option(
    "-f", "--frequency", metavar="VALUE", default="auto", show_default=True,
    help='Where to look for the modulation, like "120 Hz"; it is fitted.',
)  # fmt: skip
@click.option("--exact-frequency", is_flag=True, help="Take --frequency as it is.")
@click.option(
    "--harmonics", metavar="N", type=click.IntRange(1, 64), default=4, show_default=True,
    help="How many.",
)  # fmt: skip
@click.option(
    "--window",
    metavar="START:END",
    help="Seconds to read, like 10:60; chosen by the program if not given.",
)
@click.option("--whole-periods", is_flag=True, help="Cut the window to whole periods.")
@click.option(
    "--detrend",
    metavar="none|linear|quadratic",
    default="linear",
    show_default=True,
    help="Drift that is fitted together with the harmonics.",
)
@click.option(
    "--no-modulation",
    is_flag=True,
    help="Velocity steps and holds; by default, those of a recording whose load is constant.",
)
@click.option(
    "--steps",
    metavar="TIMES|FILE",
    help="Times of the velocity steps in seconds, like 12.5,60, or a file of them, one a line.",
)
@click.option(
    "--holds",
    metavar="TIMES|FILE",
    help="Holds as START:END in seconds, like 100:110,200:300, or a file of them, one a line.",
)
@click.option(
    "--amplitudes", is_flag=True, help="Read every modulated stretch, and print them as a table."
)
@click.option(
    "--out",
    type=Path,
    metavar="CSV|NC",
    help="Measure all recordings into one table: a row for each amplitude, step and hold.",
)
@click.option("--resume", is_flag=True, help="Go on with an interrupted table.")
@click.option(
    "--jobs",
    metavar="N",
    type=click.IntRange(1),
    help="Processes of a table; as many as cores if not given.",
)
@json_option()
@click.option("--plot", type=Path, metavar="PNG", help="Where a figure goes.")
def measure(
    recordings: tuple[Path, ...],
    source: RecordingSource,
    frequency: str,
    exact_frequency: bool,
    harmonics: int,
    window: str | None,
    whole_periods: bool,
    detrend: str,
    no_modulation: bool,
    steps: str | None,
    holds: str | None,
    amplitudes: bool,
    out: Path | None,
    resume: bool,
    jobs: int | None,
    as_json: bool,
    plot: Path | None,
) -> int:
    """Harmonics of the friction force against the measured load, with uncertainties and verdicts.

    RECORDINGS are files of a laboratory: CSV or other text, HDF5, MATLAB, TDMS or LOOK. Several
    are measured into one table with --out.
    """
    options = ReadingOptions(
        modulated=False if no_modulation else None,
        frequency=_frequency(frequency, exact_frequency),
        exact_frequency=exact_frequency,
        harmonics=harmonics,
        window=None if window is None else span_of(window, "--window"),
        whole_periods=whole_periods,
        detrend=detrend,
        steps=None if steps is None else times_of(steps, "--steps"),
        holds=None if holds is None else spans_of(holds, "--holds"),
    )
    if (steps or holds) and not no_modulation:
        raise InputError(
            "--steps and --holds must go with --no-modulation, got them without; add it"
        )
    if out is not None:
        if plot is not None or steps or holds:
            raise InputError(
                "--plot, --steps and --holds must go with one recording without --out, got both; "
                "measure that recording by itself"
            )
        return _campaign(recordings, source, options, out, resume, jobs, as_json)
    if len(recordings) > 1:
        raise InputError(
            f"--out must be given with several recordings, got {len(recordings)} without; name "
            "the table, like --out campaign.csv"
        )
    if resume or jobs is not None:
        raise InputError(
            "--resume and --jobs must go with --out, got no table; name it or leave them out"
        )
    (recording,) = recordings
    if amplitudes:
        if no_modulation or plot is not None:
            raise InputError(
                "--amplitudes must go without --no-modulation and --plot, got both; leave one out"
            )
        return _amplitudes(recording, source, options, as_json)
    if plot is not None:
        _check_picture(plot, recording)
    trace = source.read(recording)
    result, why = options.measure(trace)
    if why:
        click.echo(f"asperity: {why}", err=True)
    _print(result, recording, trace.provenance, as_json)
    if plot is not None:
        _plot(result, plot)
    return _verdict(result.checks)


def _amplitudes(
    recording: Path, source: RecordingSource, options: ReadingOptions, as_json: bool
) -> int:
    from asperity.cli.measure.text import amplitudes_text
    from asperity.cli.report import to_json
    from asperity.measurement.campaign import modulated_rows

    rows = modulated_rows(recording, options.amplitudes(source.read(recording)))
    if as_json:
        click.echo(to_json({"recording": str(recording), "amplitudes": rows}))
    else:
        click.echo(amplitudes_text(rows, recording.name))
    return int(any(row["reason"] or row["verdict"] == "bad" for row in rows))


def _campaign(
    recordings: tuple[Path, ...],
    source: RecordingSource,
    options: ReadingOptions,
    out: Path,
    resume: bool,
    jobs: int | None,
    as_json: bool,
) -> int:
    import os

    from asperity.cli.progress import bar
    from asperity.cli.report import to_json
    from asperity.measurement.campaign import run_campaign

    rows_of = FileRows(source, options)
    with bar("files") as update:
        done = run_campaign(
            recordings,
            rows_of,
            out,
            inputs=rows_of.inputs(),
            resume=resume,
            jobs=jobs or os.cpu_count() or 1,
            progress=update,
        )
    if as_json:
        numbers = {"files": done.files, "rows": done.rows, "failed": done.failed}
        click.echo(to_json({**numbers, "out": str(out)}))
    if done.sliding and options.modulated is None:
        click.echo(
            f"asperity: {done.sliding} of {done.files} files have a constant load: their velocity "
            "steps and holds are in the table, as with --no-modulation",
            err=True,
        )
    if done.failed:
        click.echo(
            f"asperity: {done.failed} of {done.rows} rows have no numbers; the column 'reason' of "
            f"{out} says why",
            err=True,
        )
    return int(done.failed > 0)


def _check_picture(path: Path, recording: Path) -> None:
    """Check the picture's path before anything is read."""
    from asperity.outputs import output_files

    if path.suffix.lower() != ".png":
        raise InputError(f"--plot must be a PNG file, got '{path}'; write it like --plot out.png")
    output_files({"--plot": path}, inputs={"recording": recording})


def _frequency(text: str, exact: bool) -> float | None:
    from asperity.units import to_si

    if text != "auto":
        return to_si(text, "frequency", "--frequency")
    if exact:
        raise InputError(
            "--exact-frequency must go with --frequency, got 'auto'; give the frequency or leave "
            "the option out"
        )
    return None


def _print(result: Any, recording: Path, provenance: dict[str, Any], as_json: bool) -> None:
    from asperity._version import __version__
    from asperity.cli.measure.text import modulated_text, sliding_text
    from asperity.cli.report import to_json
    from asperity.measurement.record import modulated_record, sliding_record

    modulated = hasattr(result, "reading")
    if as_json:
        record = modulated_record(result) if modulated else sliding_record(result)
        provenance_record = {"recording": str(recording), "version": __version__, **provenance}
        click.echo(to_json({**record, "provenance": provenance_record}))
    else:
        click.echo((modulated_text if modulated else sliding_text)(result, recording.name))


def _plot(result: Any, path: Path) -> None:
    from asperity.figures.recording import draw_modulated, draw_sliding
    from asperity.figures.style import style
    from asperity.outputs import written_file

    with style(), written_file(path, "--plot") as file:
        figure = (draw_modulated if hasattr(result, "reading") else draw_sliding)(result)
        figure.savefig(file, metadata={"Software": None})


def _verdict(checks: tuple[Check, ...]) -> int:
    for check in checks:
        if check.verdict == "bad":
            click.echo(f"asperity: {check.name} is bad: {check.sentence}", err=True)
    return int(any(check.verdict == "bad" for check in checks))
