"""Options that several commands share, and what they say in one sentence when misused."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.materials import Material

Command = Callable[..., Any]
Decorator = Callable[[Command], Command]


def material_option() -> Decorator:
    """``--material``."""
    return click.option(
        "--material",
        metavar="NAME",
        help="Take the numbers that are not given from a material, such as bureau2000, or from "
        "a TOML file of your own.",
    )


def set_option(example: str) -> Decorator:
    """``--set``, to be repeated."""
    return click.option(
        "--set",
        "settings",
        metavar="NAME=VALUE",
        multiple=True,
        help=f"A number with its unit, instead of the material's; repeatable. Example: {example}",
    )


def json_option() -> Decorator:
    """``--json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text.")


_POINT = (
    click.option("--law", metavar="NAME", help="Friction law, such as elasto-plastic."),
    material_option(),
    click.option("-V", "--velocity", metavar="VALUE", help='Pulling velocity, like "1 um/s".'),
    click.option(
        "-e", "--epsilon", metavar="VALUE", help="Relative amplitude of the load, 0 to < 1."
    ),
    click.option("-f", "--frequency", metavar="VALUE", help='Modulation frequency, like "120 Hz".'),
    click.option("--inertia", is_flag=True, help="Let the mass of the slider count."),
    click.option(
        "--radiation-damping",
        metavar="VALUE",
        help='Force of radiated waves per velocity, like "500 N*s/m".',
    ),
    set_option('--set A=0.013 --set "K=0.3 N/um"'),
)


def point_options(command: Command) -> Command:
    """Options of an operating point: law, material, and numbers.

    The command is called with `law` and `material` as they were given, and with `given`, the texts
    of the numbers by their names.
    """

    @wraps(command)
    def gathered(
        *,
        velocity: str | None,
        epsilon: str | None,
        frequency: str | None,
        inertia: bool,
        radiation_damping: str | None,
        settings: tuple[str, ...],
        **others: Any,
    ) -> Any:
        given = settings_of(settings)
        add_setting(given, "V", velocity)
        add_setting(given, "epsilon", epsilon)
        add_setting(given, "frequency", frequency)
        add_setting(given, "inertia", "1" if inertia else None)
        add_setting(given, "eta", radiation_damping)
        return command(given=given, **others)

    found: Command = gathered
    for option in reversed(_POINT):
        found = option(found)
    return found


def settings_of(pairs: Iterable[str]) -> dict[str, str]:
    """Split ``NAME=VALUE`` texts.

    Raises
    ------
    InputError
        If one has no name or value, or a name is given twice.
    """
    found: dict[str, str] = {}
    for pair in pairs:
        name, _, value = (part.strip() for part in pair.partition("="))
        if not name or not value:
            raise InputError(
                f"--set must be NAME=VALUE, got '{pair}'; write it like --set \"K=0.2 N/um\""
            )
        add_setting(found, name, value)
    return found


def add_setting(settings: dict[str, str], name: str, value: str | None) -> None:
    """Add a value that another option gives, if it does; twice the same name is an error."""
    if value is None:
        return
    if name in settings:
        raise InputError(
            f"{name} must be given once, got '{settings[name]}' and '{value}'; leave one out"
        )
    settings[name] = value


def law_named(name: str | None) -> str:
    """Name of the law, which must be given."""
    from asperity.laws import registered

    if name is None:
        raise InputError(
            f"--law must be given, got nothing; choose one of {', '.join(sorted(registered()))}"
        )
    return name


def material_named(name: str | None) -> Material | None:
    """Load the material, if one is named."""
    from asperity import materials

    return None if name is None else materials.load(name)
