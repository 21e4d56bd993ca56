"""Options for reading a recording: columns, units, channels; and lists of times."""

from __future__ import annotations

import re
from functools import wraps
from pathlib import Path
from typing import Any

from asperity.cli.options import (
    Command,
    Decorator,
    add_setting,
    field_option,
    option,
    pairs_of,
    stacked,
)
from asperity.errors import InputError, require

_QUESTIONS = "asperity.questions.recording"
#: Velocities for recordings without a channel of the motion of the drive.
velocities_option = field_option(f"{_QUESTIONS}:Measurement", "velocities", "VALUES")


def times_option(name: str, about: str) -> Decorator:
    """An option of times or spans; the command gets the list of their texts."""

    def listed(context: Any, option: Any, text: str | None) -> list[str] | None:
        return None if text is None else _listed_times(text, name)

    return option(name, "TIMES|FILE", about, callback=listed)


def _listed_times(text: str, option: str) -> list[str]:
    """Items of a list like ``12.5,60`` or ``100:110,200:300``, or lines of a file.

    Raises
    ------
    InputError
        If the file cannot be read, or there is no item.
    """
    path, like = Path(text), "100:110,200:300" if option == "--holds" else "12.5,60"
    # Times begin with a digit, a sign, a point, or the colon of an open span.
    if (text.strip() and not re.fullmatch(r"\s*[-+.:]*\d[-+.\s,:;\w]*", text)) or path.is_file():
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError):
            rule = "be times or a file that can be read"
            advice = f"check the name, or write them like {option} {like}"
            raise InputError(option, rule, f"'{text}'", advice) from None
        # Two columns are a span.
        parts = [re.sub(r"[\s,;]+", ":", line.split("#")[0].strip()) for line in lines]
    else:
        parts = re.split(r"[,;]", text)
    result = [part.strip() for part in parts if part.strip()]
    require(result, option, "hold times", f"'{text}'", f"write them like {option} {like}")
    return result


#: Options with the name of their field of the source, with their metavar.
_FIELDS = {
    "area": "VALUE",
    "rate": "VALUE",
    "recipe": "TOML",
    "group": "NAME",
    "format": "NAME",
    "delimiter": "SIGN",
    "decimal": "SIGN",
}
_OPTIONS = (
    option("--load", "NAME", "Column of the normal load; by default recognised by name and unit."),
    option("--force", "NAME", "Column of the shear force; by default recognised by name and unit."),
    option("--time", "NAME", "Column of the time."),
    option(
        "--column columns",
        "ROLE=NAME",
        "Column of another role: velocity, displacement or friction; repeatable.",
        multiple=True,
    ),
    option(
        "--unit units",
        "NAME=UNIT",
        "Unit of a column that the file leaves open, like Fn=N; repeatable.",
        multiple=True,
    ),
    option(
        "--channel channels",
        "NAME=EXPRESSION",
        'A channel made of others, like "load = Conf.Press - Pore.Press"; repeatable.',
        multiple=True,
    ),
    *(field_option(f"{_QUESTIONS}:Source", name, metavar) for name, metavar in _FIELDS.items()),
)


def source_options(command: Command) -> Command:
    """Options for reading a recording; the command gets `source`."""

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

        roles = pairs_of(columns, "--column", "velocity=speed", at_last=True)
        for role, chosen in COLUMN_OPTIONS.items():
            add_setting(roles, role, others.pop(chosen.lstrip("-")), "--column")
        like = '"force = 2.4 N/V * Gauge"'
        source = Source(
            # Columns of files without a heading are chosen by number.
            columns={
                role: int(name) if re.fullmatch(r"[0-9]{1,9}", name) else name
                for role, name in roles.items()
            },
            units=pairs_of(units, "--unit", "Fn=N", at_last=True),
            channels=pairs_of(channels, "--channel", like, "EXPRESSION"),
            **{name: others.pop(name) for name in _FIELDS},
        )
        return command(source=source, **others)

    return stacked(*_OPTIONS)(gathered)
