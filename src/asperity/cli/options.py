"""Options that several commands share, with their error messages."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from asperity.cli.words import POINT_OPTIONS, fields_as_options
from asperity.errors import InputError
from asperity.parameters import DRIVE, MACHINE, NAMES, Parameter

if TYPE_CHECKING:
    from asperity.materials import Material
    from asperity.questions.point import Point

Command = Callable[..., Any]
Decorator = Callable[[Command], Command]


class Count(click.ParamType):
    """A whole number; its limits are those of the question or the function that takes it."""

    name = "N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> int:
        """The number that a text is."""
        try:
            return int(value)
        except ValueError:
            option = "" if param is None else param.opts[0]
            rule = "be a whole number"
            raise InputError(option, rule, f"'{value}'", "correct the value") from None


class FieldOption(click.Option):
    """An option with the default and the choices of a field of a question, which its help shows.

    The record is imported for the help only; without the option the default of the record applies.
    """

    def __init__(self, *names: Any, record: str = "", **look: Any) -> None:
        super().__init__(*names, **look)
        self.record = record

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Option and text, as click prints them."""
        module, _, name = self.record.partition(":")
        about = getattr(importlib.import_module(module), name).model_fields[self.name]
        if about.default is not None and not self.is_flag:
            self.default, self.show_default = about.default, True
        self.metavar = self.metavar or "|".join(map(str, get_args(about.annotation)))
        return super().get_help_record(ctx)


def field_option(
    record: str, field: str, help_text: str, metavar: str | None = None, short: str = ""
) -> Decorator:
    """The option of a field of a question.

    Parameters
    ----------
    record : str
        Its place, as ``module:Name``.
    field : str
    help_text : str
    metavar : str, optional
        What is given: empty for the choices of the field, "N" for a whole number; None for a
        switch.
    short : str
        A second name of the option.
    """
    names = [*([short] if short else []), f"--{field.replace('_', '-')}", field]
    # Click takes an option that is said to be no switch for one whose value may be left out.
    look: dict[str, Any] = {"is_flag": True} if metavar is None else {"metavar": metavar}
    kind = Count() if metavar == "N" else None
    return click.option(*names, cls=FieldOption, record=record, help=help_text, type=kind, **look)


def material_option() -> Decorator:
    """``--material``."""
    return click.option(
        "--material",
        metavar="NAME",
        help="Take the numbers that are not given from a material, such as bureau2000, or from "
        "a TOML file.",
    )


def set_option(
    example: str, meaning: str = "A number with its unit, instead of the material's"
) -> Decorator:
    """``--set``, to be repeated."""
    return click.option(
        "--set",
        "settings",
        metavar="NAME=VALUE",
        multiple=True,
        help=f"{meaning}; repeatable. Example: {example}",
    )


def json_option() -> Decorator:
    """``--json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text.")


def names_option() -> Decorator:
    """``--names``."""
    return click.option(
        "--names",
        type=click.Choice(NAMES),
        default=NAMES[0],
        help="Names on screen and in figures: A, B, D0, K/W0, or geophysics: a, b, D_c, k/sigma_n.",
    )


def plot_option() -> Decorator:
    """``--plot``."""
    return click.option("--plot", type=Path, metavar="PNG", help="Where a figure goes.")


def point_options(command: Command) -> Command:
    """Options of an operating point; the command gets `point`, a `Point`."""
    named = [p for p in (*DRIVE.values(), *MACHINE.values()) if p.options]

    @wraps(command)
    def gathered(
        *, law: str | None, material: str | None, settings: tuple[str, ...], **others: Any
    ) -> Any:
        given = settings_of(settings)
        for parameter in named:
            value = others.pop(parameter.argument)
            if parameter.rule == "switch":
                value = "1" if value else None
            add_setting(given, parameter.name, value)
        with fields_as_options(POINT_OPTIONS):
            return command(point=point_of(law, material, given), **others)

    result: Command = set_option('--set A=0.013 --set "K=0.3 N/um"')(gathered)
    for parameter in reversed(named):
        result = _option(parameter)(result)
    result = material_option()(result)
    return law_option()(result)


def law_option(
    help_text: str = (
        "Friction law, such as elasto-plastic, or a law of yours as module:Name or file.py:Name."
    ),
) -> Decorator:
    """``--law``; a law given by its place is imported and registered, and its name passed on."""
    return click.option("--law", metavar="NAME", callback=_named_law, help=help_text)


def law_options() -> Decorator:
    """``--law`` that may be repeated, as `law_option`; the command gets `laws`."""
    return click.option(
        "--law",
        "laws",
        metavar="NAME",
        multiple=True,
        callback=lambda context, option, texts: tuple(
            str(_named_law(context, option, text)) for text in texts
        ),
        help="Friction law, such as rice-ruina, or a law of yours as module:Name or file.py:Name; "
        "of a comparison, repeatable.",
    )


def _named_law(context: click.Context, option: click.Parameter, text: str | None) -> str | None:
    if text is None or ":" not in text:
        return text
    from asperity.laws import known_law

    with fields_as_options(POINT_OPTIONS):
        return known_law(text)


def _option(parameter: Parameter) -> Decorator:
    """The option of a parameter, which the command gets under the name of its argument."""
    meaning = parameter.meaning[0].upper() + parameter.meaning[1:]
    if parameter.rule == "switch":
        return click.option(
            *parameter.options, parameter.argument, is_flag=True, help=f"{meaning}."
        )
    return click.option(
        *parameter.options,
        parameter.argument,
        metavar="VALUE",
        help=f'{meaning}, like "{parameter.example}".',
    )


def settings_of(pairs: Iterable[str], option: str = "--set") -> dict[str, str]:
    """Split ``NAME=VALUE`` texts of an option that may be repeated.

    Raises
    ------
    InputError
        If one has no name or value, or a name is given twice.
    """
    result: dict[str, str] = {}
    for pair in pairs:
        name, _, value = (part.strip() for part in pair.partition("="))
        if not name or not value:
            raise InputError(
                f"{option} must be NAME=VALUE, got '{pair}'; write it like {option} \"K=0.2 N/um\""
            )
        add_setting(result, name, value)
    return result


def add_setting(settings: dict[str, str], name: str, value: str | None) -> None:
    """Add a value that another option gives, if it does; twice the same name is an error."""
    if value is None:
        return
    if name in settings:
        raise InputError(
            f"{name} must be given once, got '{settings[name]}' and '{value}'; leave one out"
        )
    settings[name] = value


def point_of(law: str | None, material: str | None, given: dict[str, str]) -> Point:
    """The operating point of options."""
    from asperity.questions.point import Point

    return Point(law=law or "", material=material or "", parameters=given)


def material_named(name: str | None) -> Material | None:
    """Load the material, if one is named."""
    from asperity import materials

    with fields_as_options(POINT_OPTIONS):
        return None if name is None else materials.load(name)
