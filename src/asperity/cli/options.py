"""Options that several commands share, and what they say in one sentence when misused."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import click

from asperity.errors import InputError

if TYPE_CHECKING:
    from asperity.materials import Material

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


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


def material_named(name: str | None) -> Material | None:
    """Load the material, if one is named."""
    from asperity import materials

    return None if name is None else materials.load(name)
