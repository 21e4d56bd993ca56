"""How a recording is read: the options of ``asperity measure`` on files, columns and units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.recording.trace import Trace


Command = Callable[..., Any]


@dataclass(frozen=True)
class RecordingSource:
    """The choices with which files are read; one for all files of a campaign.

    Attributes
    ----------
    columns : dict of str to str or int
        Column of each role that was chosen.
    units : dict of str to str
        Unit of a column, by its name.
    rate, group, area, format, delimiter, decimal : str or None
        As the options of these names.
    channels : dict of str to str
        Expressions of channels, by name.
    recipe : Path or None
        Reduction file.
    """

    columns: dict[str, str | int]
    units: dict[str, str]
    rate: str | None = None
    group: str | None = None
    area: str | None = None
    channels: dict[str, str] = field(default_factory=dict)
    recipe: Path | None = None
    format: str | None = None
    delimiter: str | None = None
    decimal: str | None = None

    def read(self, path: Path) -> Trace:
        """Read one file.

        Raises
        ------
        InputError
            If it cannot be read; the message names the options.
        """
        from asperity.recording.readers import read

        trace = read(
            path,
            columns=self.columns or None,
            units=self.units or None,
            channels=self.channels,
            recipe=self.recipe,
            rate=self.rate,
            group=self.group,
            format=self.format,
            delimiter=self.delimiter,
            decimal=self.decimal,
        )
        if self.area is not None:
            from asperity.recording.conversions import stress_to_force

            trace = stress_to_force(trace, self.area)
        return trace


_OPTIONS = (
    click.option("--load", metavar="NAME", help="Column of the normal load; found if it is one."),
    click.option("--force", metavar="NAME", help="Column of the shear force; found if it is one."),
    click.option("--time", "time_column", metavar="NAME", help="Column of the time."),
    click.option(
        "--column",
        "columns",
        metavar="ROLE=NAME",
        multiple=True,
        help="Column of another role: velocity, displacement or friction; repeatable.",
    ),
    click.option(
        "--unit",
        "units",
        metavar="NAME=UNIT",
        multiple=True,
        help="Unit of a column that the file leaves open, like Fn=N; repeatable.",
    ),
    click.option(
        "--rate", metavar="VALUE", help='Samples per second, like "10 kHz", in place of times.'
    ),
    click.option(
        "--group", metavar="NAME", help="Group of an HDF5, MATLAB or TDMS file of several."
    ),
    click.option(
        "--channel",
        "channels",
        metavar="NAME=EXPRESSION",
        multiple=True,
        help='A channel made of others, like "load = Conf.Press - Pore.Press"; repeatable.',
    ),
    click.option(
        "--recipe", type=Path, metavar="TOML", help="Reduction file: columns, units and channels."
    ),
    click.option("--format", metavar="NAME", help="Format of the file, or a reader's of your own."),
    click.option("--delimiter", metavar="SIGN", help="Of a text: a character, tab or blank."),
    click.option("--decimal", metavar="SIGN", help="Decimal mark of a text: . or ,"),
    click.option("--area", metavar="VALUE", help='Makes stresses forces, like "25 cm^2".'),
)


def source_options(command: Command) -> Command:
    """Options that say how a recording is read; the command is called with `source`."""

    @wraps(command)
    def gathered(
        *,
        load: str | None,
        force: str | None,
        time_column: str | None,
        columns: tuple[str, ...],
        units: tuple[str, ...],
        rate: str | None,
        group: str | None,
        area: str | None,
        channels: tuple[str, ...],
        recipe: Path | None,
        format: str | None,
        delimiter: str | None,
        decimal: str | None,
        **others: Any,
    ) -> Any:
        roles = {"W": load, "F": force, "time": time_column}
        roles |= dict(name_value_pairs(columns, "--column"))
        chosen = {role: _name_or_number(name) for role, name in roles.items() if name is not None}
        named = dict(name_value_pairs(units, "--unit"))
        made = expressions_of(channels)
        source = RecordingSource(
            chosen, named, rate, group, area, made, recipe, format, delimiter, decimal
        )
        return command(source=source, **others)

    result: Command = gathered
    for option in reversed(_OPTIONS):
        result = option(result)
    return result


def name_value_pairs(texts: tuple[str, ...], option: str) -> list[tuple[str, str]]:
    """Split ``NAME=VALUE`` texts at the last ``=``.

    Raises
    ------
    InputError
        If a text has no name or no value.
    """
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


def expressions_of(texts: tuple[str, ...]) -> dict[str, str]:
    """Expressions of channels by name, from ``NAME=EXPRESSION`` texts.

    Raises
    ------
    InputError
        If a text has no name or no expression, or a name is given twice.
    """
    made: dict[str, str] = {}
    for text in texts:
        name, _, expression = (part.strip() for part in text.partition("="))
        if not name or not expression:
            raise InputError(
                f"--channel must be NAME=EXPRESSION, got '{text}'; write it like "
                '--channel "force = 2.4 N/V * Gauge"'
            )
        if name in made:
            raise InputError(f"--channel must be given once for '{name}', got two; leave one out")
        made[name] = expression
    return made


def _name_or_number(name: str) -> str | int:
    """Columns of files without headers are chosen by number: in the digits 0 to 9."""
    return int(name) if name.isascii() and name.isdigit() and len(name) < 10 else name
