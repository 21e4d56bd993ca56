"""Options that several commands share, with their error messages."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Callable, Iterable
from functools import reduce, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from asperity.cli.report import CHOSEN_NAMES, Output
from asperity.cli.words import POINT_OPTIONS, fields_as_options
from asperity.errors import InputError, name_by, require, symbol
from asperity.parameters import DRIVE, MACHINE, NAMES, Names, Parameter
from asperity.parameters.arguments import at_least, one_of

if TYPE_CHECKING:
    from asperity.questions.point import Point

Command = Callable[..., Any]
Decorator = Callable[[Command], Command]


def stacked(*decorators: Decorator) -> Decorator:
    """Several decorators as one; the first is the outermost."""
    return lambda command: reduce(lambda inner, add: add(inner), reversed(decorators), command)


class Count(click.ParamType):
    """A whole number.

    Parameters
    ----------
    least : int, optional
        Smallest number; without it the question or function that takes the number checks it.
    """

    name = "N"

    def __init__(self, least: int | None = None) -> None:
        self.least = least

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> int:
        """The number from its text."""
        option = "" if param is None else param.opts[0]
        try:
            count = int(value)
        except ValueError:
            raise InputError(option, "be a whole number", f"'{value}'") from None
        return count if self.least is None else at_least(self.least)(count, option)


class OnceOption(click.Option):
    """An option that may be given once only; click alone would take the last of several."""

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        """Let the parser keep every value; a switch has no value."""
        if self.is_flag:
            super().add_to_parser(parser, ctx)
            return
        parser.add_option(obj=self, opts=self.opts, dest=self.name, action="append", nargs=1)

    def consume_value(self, ctx: click.Context, opts: Any) -> Any:
        """The value, and its source."""
        values = opts.get(self.name)
        if isinstance(values, list):
            got, option = " and ".join(f"'{value}'" for value in values), self.opts[0]
            require(len(values) == 1, option, "be given once", got, "leave one out")
            opts = {**opts, self.name: values[0]}
        return super().consume_value(ctx, opts)


class FieldOption(OnceOption):
    """An option whose help has the docstring, the default and the choices of a field of a question.

    The record is imported for the help only. Without the option the default of the record applies.
    """

    def __init__(self, *names: Any, record: str = "", **look: Any) -> None:
        super().__init__(*names, **look)
        self.record = record

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Option and text, as click prints them."""
        module, _, name = self.record.partition(":")
        record = getattr(importlib.import_module(module), name)
        about = record.model_fields[self.name]
        # The field and its type in a line, and the text below.
        entry = re.compile(rf"^{self.name} : .*((?:\n    .*)+)", re.MULTILINE)
        entries = (entry.search(inspect.cleandoc(one.__doc__ or "")) for one in record.__mro__)
        self.help = next((" ".join(text[1].split()) for text in entries if text), "")
        if about.default is not None and not self.is_flag:
            self.default, self.show_default = about.default, True
        self.metavar = self.metavar or "|".join(map(str, get_args(about.annotation)))
        return super().get_help_record(ctx)


def option(names: str, metavar: str | None, about: str, kind: Any = None, **more: Any) -> Decorator:
    """An option with a value.

    Parameters
    ----------
    names : str
        Names of the option, and the name of the command's argument if it differs.
    metavar : str or None
        Placeholder of the value in the help.
    about : str
        Help text.
    kind : type, optional
    **more
        As for `click.option`.
    """
    more = {"cls": click.Option if more.get("multiple") else OnceOption, **more}
    return click.option(*names.split(), metavar=metavar, help=about, type=kind, **more)


def switch(names: str, about: str, value: bool | None = None) -> Decorator:
    """An option without a value; parameters as for `option`.

    Parameters
    ----------
    value : bool, optional
        What the command gets with the option, which is then None without it; else True and False.
    """
    look: dict[str, Any] = {} if value is None else {"flag_value": value, "default": None}
    return click.option(*names.split(), is_flag=True, help=about, **look)


def field_option(record: str, field: str, metavar: str | None = None, short: str = "") -> Decorator:
    """The option of a field of a question, with the text of the record's docstring.

    Parameters
    ----------
    record : str
        The record, as ``module:Name``.
    field : str
    metavar : str, optional
        Placeholder of the value in the help: "N" for a whole number, empty for the choices of the
        field; None for a switch.
    short : str
        A second name of the option.
    """
    names = f"{short} --{field.replace('_', '-')} {field}"
    # With is_flag=False Click allows to leave out the value.
    look: dict[str, Any] = {"is_flag": True} if metavar is None else {}
    kind = Count() if metavar == "N" else None
    return option(names, metavar, "", kind, cls=FieldOption, record=record, **look)


def material_option() -> Decorator:
    """``--material``."""
    return option(
        "--material",
        "NAME",
        "Take the numbers that are not given from a material, such as bureau2000, or a TOML file.",
    )


def set_option(
    example: str, meaning: str = "A number with its unit, instead of the material's"
) -> Decorator:
    """``--set``, which may be repeated."""
    about = f"{meaning}; repeatable. Example: {example}"
    return option("--set settings", "NAME=VALUE", about, multiple=True)


def output_options(*, plot: bool = False) -> Decorator:
    """``--json``, ``--names`` and, with a figure, ``--plot``; the command gets `output`."""

    def with_options(command: Command) -> Command:
        @wraps(command)
        def gathered(
            *, as_json: bool, names: Names, plot: Path | None = None, **others: Any
        ) -> Any:
            return command(output=Output(as_json, names, plot), **others)

        return stacked(*(_OUTPUT if plot else _OUTPUT[1:]))(gathered)

    return with_options


_OUTPUT = (
    option("--plot", "PNG", "Where a figure goes.", Path),
    option(
        "--names",
        "|".join(NAMES),
        "Names on screen, in figures and options: A, B, D0, K/W0 (friction), or a, b, D_c, "
        "k/sigma_n (geophysics).",
        default=NAMES[0],
        is_eager=True,
        callback=lambda context, option, names: _chosen(context, one_of(names, NAMES, "--names")),
    ),
    switch("--json as_json", "Print JSON instead of text."),
)


def _chosen(context: click.Context, names: str) -> str:
    """Use the chosen set of names in messages too."""
    if names != NAMES[0]:
        from asperity.laws.registry import symbols_of

        name_by(symbols=symbols_of("geophysics"))
    chosen: str = context.meta.setdefault(CHOSEN_NAMES, names)
    return chosen


def point_options(command: Command) -> Command:
    """Options of an operating point; the command gets `point`, a `Point`."""
    named = [p for p in (*DRIVE.values(), *MACHINE.values()) if p.options]

    @wraps(command)
    def gathered(
        *, law: str | None, material: str | None, settings: tuple[str, ...], **others: Any
    ) -> Any:
        given = settings_of(settings)
        of_set = {f"numbers.{name}": "--set" for name in given}
        for parameter in named:
            value = others.pop(parameter.argument)
            if parameter.rule == "switch":
                value = "1" if value else None
            add_setting(given, parameter.name, value)
        with fields_as_options({**POINT_OPTIONS, **of_set}):
            return command(point=point_of(law, material, given), **others)

    drive = [_option(parameter) for parameter in DRIVE.values() if parameter.options]
    machine = [_option(parameter) for parameter in MACHINE.values() if parameter.options]
    numbers = set_option('--set A=0.013 --set "K=0.3 N/um"')
    return stacked(law_option(), material_option(), *drive, numbers, *machine)(gathered)


def law_option(
    help_text: str = (
        "Friction law, such as elasto-plastic, or a law of yours as module:Name or file.py:Name."
    ),
) -> Decorator:
    """``--law``; a law given as module:Name or file.py:Name is imported and registered."""
    return option(
        "--law",
        "NAME",
        help_text,
        callback=lambda context, option, text: None if text is None else known_place(text),
    )


def law_options(command: Command) -> Command:
    """``--law``, which may be repeated, and ``--laws`` with commas; the command gets `laws`."""

    def names(context: click.Context, option: click.Parameter, texts: tuple[str, ...]) -> Any:
        parts = (part.strip() for text in texts for part in text.split(","))
        return tuple(known_place(part) for part in parts if part)

    return option(
        "--law --laws laws",
        "NAME",
        "Friction law, such as rice-ruina, or one of your own as module:Name or file.py:Name; "
        "compare takes several, each with --law or as a,b,c, or all, which is its default.",
        multiple=True,
        callback=names,
    )(command)


def known_place(text: str) -> str:
    """Name of a law; a law given as module:Name or file.py:Name is imported and registered."""
    if ":" not in text:
        return text
    from asperity.laws import known_law

    with fields_as_options(POINT_OPTIONS):
        return known_law(text)


def _option(parameter: Parameter) -> Decorator:
    """The option of a parameter; the command gets its value as the parameter's `argument`."""
    names = " ".join((*parameter.options, parameter.argument))
    meaning = parameter.meaning[0].upper() + parameter.meaning[1:]
    if parameter.rule == "switch":
        return switch(names, f"{meaning}.")
    return option(names, "VALUE", f'{meaning}, like "{parameter.example}".')


def pairs_of(
    texts: Iterable[str], option: str, like: str, form: str = "VALUE", *, at_last: bool = False
) -> dict[str, str]:
    """Values by name, from ``NAME=VALUE`` texts of an option that may be repeated.

    Parameters
    ----------
    texts : iterable of str
    option : str
    like : str
        An example of a text.
    form : str
        Name of the value in messages.
    at_last : bool
        Whether a name may have an ``=``: a text is then split at its last ``=``.

    Raises
    ------
    InputError
        If a text has no name or no value, or a name is given twice.
    """
    pairs: dict[str, str] = {}
    for text in texts:
        split = text.rpartition("=") if at_last else text.partition("=")
        name, _, value = map(str.strip, split)
        advice = f"write it like {option} {like}"
        require(name and value, option, f"be NAME={form}", f"'{text}'", advice)
        add_setting(pairs, name, value, option)
    return pairs


def settings_of(texts: Iterable[str], option: str = "--set") -> dict[str, str]:
    """Values by the name of their parameter, from texts as in `pairs_of`."""
    settings: dict[str, str] = {}
    for name, value in pairs_of(texts, option, f'"{symbol("K")}=0.2 N/um"').items():
        add_setting(settings, parameter_name(name), value, option)
    return settings


def parameter_name(name: str) -> str:
    """The name of a parameter from its name in the set that ``--names`` chooses."""
    context = click.get_current_context(silent=True)
    if context is None or context.meta.get(CHOSEN_NAMES, NAMES[0]) == NAMES[0]:
        return name
    from asperity.laws import get_law
    from asperity.parameters.table import parameter_named

    law = context.params.get("law") or next(iter(context.params.get("laws") or ()), "all")
    return parameter_named(name, None if law == "all" else get_law(law))


def add_setting(settings: dict[str, str], name: str, value: str | None, option: str = "") -> None:
    """Add a value unless it is None; a name that has a value already is an error."""
    if value is None:
        return
    field, twice = f"{option} {symbol(name)}".strip(), f"'{settings.get(name)}' and '{value}'"
    require(name not in settings, field, "be given once", twice, "leave one out")
    settings[name] = value


def point_of(law: str | None, material: str | None, given: dict[str, str]) -> Point:
    """The operating point that options describe."""
    from asperity.questions.point import Point

    return Point(law=law or "", material=material or "", parameters=given)
