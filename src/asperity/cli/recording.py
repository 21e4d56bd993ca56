"""Options on how a recording is read: columns, units, channels; and lists of times."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click

from asperity.errors import InputError, require

Command = Callable[..., Any]


def listed_times(text: str, option: str) -> list[str]:
    """Parts of a list like ``12.5,60`` or ``100:110,200:300``, or of a file with one a line.

    Raises
    ------
    InputError
        If the file cannot be read, or there is no part.
    """
    path = Path(text)
    if not re.fullmatch(r"[-+.\d\s,:;eE\w]*", text) or path.is_file():
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError):
            rule = "be times or a file that can be read"
            raise InputError(option, rule, f"'{text}'", "check the name") from None
        # Two columns are a span.
        parts = [re.sub(r"[\s,;]+", ":", line.split("#")[0].strip()) for line in lines]
    else:
        parts = re.split(r"[,;]", text)
    result = [part.strip() for part in parts if part.strip()]
    require(result, option, "hold times", f"'{text}'", f"write them like {option} 12.5,60")
    return result


_OPTIONS = (
    click.option(
        "--load",
        metavar="NAME",
        help="Column of the normal load; by default recognised by name and unit.",
    ),
    click.option(
        "--force",
        metavar="NAME",
        help="Column of the shear force; by default recognised by name and unit.",
    ),
    click.option("--time", metavar="NAME", help="Column of the time."),
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
    click.option("--area", metavar="VALUE", help='Makes stresses forces, like "25 cm^2".'),
    click.option(
        "--rate", metavar="VALUE", help='Samples per second, like "10 kHz", in place of times.'
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
    click.option(
        "--group", metavar="NAME", help="Group of an HDF5, MATLAB or TDMS file of several."
    ),
    click.option("--format", metavar="NAME", help="Format of the file, or name of a reader."),
    click.option("--delimiter", metavar="SIGN", help="Of a text: a character, tab or blank."),
    click.option("--decimal", metavar="SIGN", help="Decimal mark of a text: . or ,"),
)
#: Options that are fields of the source under the same name.
_FIELDS = ("rate", "group", "area", "recipe", "format", "delimiter", "decimal")


def source_options(command: Command) -> Command:
    """Options that say how a recording is read; the command is called with `source`."""

    @wraps(command)
    def gathered(
        *,
        columns: tuple[str, ...],
        units: tuple[str, ...],
        channels: tuple[str, ...],
        **others: Any,
    ) -> Any:
        from asperity.questions.options import COLUMN_OPTIONS
        from asperity.questions.recording import Source

        roles = {role: others.pop(o.lstrip("-")) for role, o in COLUMN_OPTIONS.items()}
        roles |= dict(_name_value_pairs(columns, "--column"))
        source = Source(
            columns={role: _name_or_number(n) for role, n in roles.items() if n is not None},
            units=dict(_name_value_pairs(units, "--unit")),
            channels=_expressions_of(channels),
            **{name: others.pop(name) for name in _FIELDS},
        )
        return command(source=source, **others)

    result: Command = gathered
    for option in reversed(_OPTIONS):
        result = option(result)
    return result


def _name_value_pairs(texts: tuple[str, ...], option: str) -> list[tuple[str, str]]:
    """Split ``NAME=VALUE`` texts at the last ``=``."""
    pairs = []
    for text in texts:
        name, _, value = (part.strip() for part in text.rpartition("="))
        like = "velocity=speed" if option == "--column" else "Fn=N"
        given, advice = name and value, f"write it like {option} {like}"
        require(given, option, "be NAME=VALUE", f"'{text}'", advice)
        pairs.append((name, value))
    return pairs


def _expressions_of(texts: tuple[str, ...]) -> dict[str, str]:
    """Expressions of channels by name, from ``NAME=EXPRESSION`` texts."""
    made: dict[str, str] = {}
    for text in texts:
        name, _, expression = (part.strip() for part in text.partition("="))
        like = 'write it like --channel "force = 2.4 N/V * Gauge"'
        require(name and expression, "--channel", "be NAME=EXPRESSION", f"'{text}'", like)
        once = f"be given once for '{name}'"
        require(name not in made, "--channel", once, "two", "leave one out")
        made[name] = expression
    return made


def _name_or_number(name: str) -> str | int:
    """Columns of files without headers are chosen by number: in the digits 0 to 9."""
    return int(name) if name.isascii() and name.isdigit() and len(name) < 10 else name
