"""``asperity measure``: what a recording says about friction, and whether to believe it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import json_option
from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.instrument.measure import Measurement
    from asperity.instrument.measure_static import StaticMeasurement
    from asperity.instrument.quality import Check

_EPILOG = """\b
Examples:
  asperity measure recording.csv
  asperity measure recording.csv --load Fn --force Ft --unit Fn=N --unit Ft=N \\
      --frequency "120 Hz" --window 10:60 --json --plot recording.png
  asperity measure velocity_step.txt --no-modulation --plot steps.png

\b
Convention: W/W0 = 1 + epsilon cos phi, phi from the measured load,
F/W0 = mean_friction + sum of mu_n cos(n phi + phase_n).

\b
Exit code 0: measured; 1: measured, but a check says bad; 2: bad input.
"""


@click.command(epilog=_EPILOG)
@click.argument("recording", type=Path)
@click.option("--load", metavar="NAME", help="Column of the normal load; found if it is one.")
@click.option("--force", metavar="NAME", help="Column of the shear force; found if it is one.")
@click.option("--time", "time_column", metavar="NAME", help="Column of the time.")
@click.option(
    "--column",
    "columns",
    metavar="ROLE=NAME",
    multiple=True,
    help="Column of another role: velocity, displacement or friction; repeatable.",
)
@click.option(
    "--unit",
    "units",
    metavar="NAME=UNIT",
    multiple=True,
    help="Unit of a column that the file leaves open, like Fn=N; repeatable.",
)
@click.option(
    "--rate", metavar="VALUE", help='Samples per second, like "10 kHz", in place of times.'
)
@click.option("--group", metavar="NAME", help="Group of an HDF5, MATLAB or TDMS file of several.")
@click.option("--area", metavar="VALUE", help='Makes stresses forces, like "25 cm^2".')
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
@click.option("--no-modulation", is_flag=True, help="A recording without it: levels and steps.")
@json_option()
@click.option("--plot", type=Path, metavar="PNG", help="Where a figure goes.")
def measure(
    recording: Path,
    load: str | None,
    force: str | None,
    time_column: str | None,
    columns: tuple[str, ...],
    units: tuple[str, ...],
    rate: str | None,
    group: str | None,
    area: str | None,
    frequency: str,
    exact_frequency: bool,
    harmonics: int,
    window: str | None,
    whole_periods: bool,
    detrend: str,
    no_modulation: bool,
    as_json: bool,
    plot: Path | None,
) -> int:
    """Harmonics of the friction force against the measured load, with uncertainties and verdicts.

    RECORDING is a file of a laboratory: CSV or other text, HDF5, MATLAB, TDMS or LOOK.
    """
    from asperity.instrument.readers import read

    start = _frequency(frequency, exact_frequency)
    between = None if window is None else _window(window)
    if plot is not None:
        _check_picture(plot)
    roles = {"W": load, "F": force, "time": time_column} | dict(_pairs(columns, "--column"))
    chosen = {role: _place(name) for role, name in roles.items() if name is not None}
    named = dict(_pairs(units, "--unit")) or None
    trace = read(recording, columns=chosen or None, units=named, rate=rate, group=group)
    if area is not None:
        from asperity.instrument.conversions import stress_to_force

        trace = stress_to_force(trace, area)
    found: Measurement | StaticMeasurement
    if no_modulation:
        from asperity.instrument.measure_static import measure_static

        found = measure_static(trace, window=between)
    else:
        from asperity.instrument.measure import measure as measure_modulated

        found = measure_modulated(
            trace,
            frequency=start,
            harmonics=harmonics,
            window=between,
            detrend=detrend,
            only_whole_periods=whole_periods,
            refine=not exact_frequency,
        )
    _print(found, recording, trace.provenance, as_json)
    if plot is not None:
        _plot(found, plot)
    return _verdict(found.checks)


def _check_picture(path: Path) -> None:
    """Before anything is read: a mistake must not cost the work."""
    if path.suffix.lower() != ".png":
        raise InputError(f"--plot must be a PNG file, got '{path}'; write it like --plot out.png")
    if not path.parent.is_dir():
        raise InputError(
            f"--plot must lie in a folder that exists, got '{path}'; make the folder or choose "
            "another"
        )


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


def _window(text: str) -> tuple[float, float]:
    """Seconds, with or without their unit; an open end is the recording's own."""
    from asperity.units import to_si

    start, colon, end = (part.strip() for part in text.partition(":"))
    if not colon:
        raise InputError(f"--window must be START:END, got '{text}'; write it like --window 10:60")

    def seconds(part: str, otherwise: float) -> float:
        if not part:
            return otherwise
        return to_si(part if part[-1].isalpha() else f"{part} s", "time", "--window")

    return seconds(start, float("-inf")), seconds(end, float("inf"))


def _pairs(texts: tuple[str, ...], option: str) -> list[tuple[str, str]]:
    pairs = []
    for text in texts:
        name, _, value = (part.strip() for part in text.rpartition("="))
        if not name or not value:
            raise InputError(
                f"{option} must be NAME=VALUE, got '{text}'; write it like {option} "
                + ("velocity=speed" if option == "--column" else "Fn=N")
            )
        pairs.append((name, value))
    return pairs


def _place(name: str) -> str | int:
    """Files without headers have columns by number."""
    return int(name) if name.isdigit() else name


def _print(found: Any, recording: Path, provenance: dict[str, Any], as_json: bool) -> None:
    from asperity._version import __version__
    from asperity.cli.measure_text import modulated_text, static_text
    from asperity.cli.report import to_json
    from asperity.instrument.measure_record import modulated_record, static_record

    modulated = hasattr(found, "reading")
    if as_json:
        record = modulated_record(found) if modulated else static_record(found)
        told = {"recording": str(recording), "version": __version__, **provenance}
        click.echo(to_json({**record, "provenance": told}))
    else:
        click.echo((modulated_text if modulated else static_text)(found, recording.name))


def _plot(found: Any, path: Path) -> None:
    from asperity.figures.recording import draw_modulated, draw_static
    from asperity.figures.style import style

    with style():
        figure = (draw_modulated if hasattr(found, "reading") else draw_static)(found)
        try:
            figure.savefig(path, metadata={"Software": None})
        except OSError as error:
            raise InputError(
                f"--plot must be a file that can be written, got '{path}' ({error.strerror}); "
                "choose another place"
            ) from None


def _verdict(checks: tuple[Check, ...]) -> int:
    for check in checks:
        if check.verdict == "bad":
            click.echo(f"asperity: {check.name} is bad: {check.sentence}", err=True)
    return int(any(check.verdict == "bad" for check in checks))
