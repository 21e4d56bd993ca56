"""How a recording is read: the options of ``asperity measure`` on files, columns and units.

Errors of the library name the option in place of the argument.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.recording.trace import Trace


#: Options that choose the column of a role; other roles have --column.
_OPTION_OF_ROLE = {"W": "--load", "F": "--force", "time": "--time"}
#: Beginnings of the library's sentences, and the words of the command line for them.
_SUBJECTS = {
    "measure.window": "--window",
    "measure.detrend": "--detrend",
    "measure.load": "--load",
    "measure.force": "--force",
    "measure.steps": "--steps",
    "measure.holds": "--holds",
    "measure.frequency": "--frequency",
    "measure.trace": "the recording",
    "lock_in.detrend": "--detrend",
    "lock_in.harmonics": "--harmonics",
    "lock_in.frequency": "--frequency",
    "lock_in.load and force": "the load and the force",
    "lock_in.load": "the load",
    "lock_in.time": "the time column",
    "read.rate": "--rate",
    "read.group": "--group",
    "read.format": "--format",
    "read.delimiter": "--delimiter",
    "read.decimal": "--decimal",
    "read.columns": "--column",
    "read.units": "--unit",
    "stress_to_force.area": "--area",
    "recording.path": "the recording",
    "slice.start and slice.end": "--window",
}


@contextmanager
def naming_options() -> Iterator[None]:
    """Raise an `InputError` of the library anew, with options named instead of arguments."""
    try:
        yield
    except InputError as error:
        raise InputError(in_options(str(error))) from None


def in_options(sentence: str) -> str:
    """A sentence of the library with options in place of arguments.

    Parameters
    ----------
    sentence : str

    Returns
    -------
    str
    """
    for name, option in _SUBJECTS.items():
        if sentence.startswith(f"{name} "):
            sentence = option + sentence[len(name) :]
            break
    sentence = re.sub(
        r"^Trace\.channel must name (a|one) channel, got '([\w ]+)'", _missing, sentence
    )
    sentence = re.sub(
        r"^columns\['(\w+)'\]", lambda match: _OPTION_OF_ROLE.get(match[1], "--column"), sentence
    )
    sentence = re.sub(r"^units\['[^']*'\]", "--unit", sentence)
    sentence = re.sub(r"^Trace\.channel\b", "--column", sentence)
    # Messages about unread columns name arguments of the library too.
    sentence = re.sub(r"columns=\{'(\w+)': (?:'([^']*)'|(\d+))\}", _column, sentence)
    sentence = re.sub(r"units=\{'([^']*)': '([^']*)'\}", r"""--unit "\1=\2\"""", sentence)
    return re.sub(r"units=\{'([^']*)': \.\.\.\}", r"""--unit "\1=UNIT\"""", sentence)


def _missing(match: re.Match[str]) -> str:
    how_many, name = match[1], match[2]
    if name in _OPTION_OF_ROLE:
        got = "none" if how_many == "a" else "several"
        return f"{_OPTION_OF_ROLE[name]} must name {how_many} column, got {got}"
    return f"--column must name {how_many} column, got '{name}'"


def _column(match: re.Match[str]) -> str:
    role, name = match[1], match[2] if match[2] is not None else match[3]
    shown = f'"{name}"' if re.search(r"[^\w.]", name) else name
    if role in _OPTION_OF_ROLE:
        return f"{_OPTION_OF_ROLE[role]} {shown}"
    return f'--column "{role}={name}"'


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
