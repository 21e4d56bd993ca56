"""A group of commands, each imported when it is called; an error is one sentence."""

from __future__ import annotations

import importlib
import re
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

import click

from asperity.cli.progress import INTERRUPTED, MESSAGE, ending_at_once
from asperity.cli.words import in_options
from asperity.errors import InputError, naming, printable, require_known

_BAD_INPUT = 2
#: Example of a missing option by its metavar, if its help has no example.
_EXAMPLES = {
    "CSV": "table.csv",
    "NC": "motion.nc",
    "PNG": "picture.png",
    "DIR": "folder",
    "OUTPUT": "delta_mu",
    "AXIS": "V",
}
_EXAMPLE_IN_HELP = re.compile(r'like ("[^"]+")')
#: Example of a missing argument by its name.
_ARGUMENTS = {
    "data": "recording.csv",
    "paper": "bureau2000",
    "plan": "plan.toml",
    "protocol": "protocol.toml",
    "readings": "bureau2000 readings.csv",
    "recordings": "recording.csv",
    "store": "results.zarr",
}


class Shell(click.Group):
    """A group of commands, each imported from its module when it is called.

    A command returns its exit code, None for 0. `InputError` and click's errors become one line on
    stderr and exit code 2, Ctrl-C one line and 130.

    Parameters
    ----------
    commands : mapping of str to str
        Module of every command.
    """

    def __init__(self, *args: Any, commands: Mapping[str, str], **options: Any) -> None:
        super().__init__(*args, **options)
        self.modules = dict(commands)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands."""
        return sorted(self.modules)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        """Import a command; the error for an unknown name has the nearest one."""
        require_known(cmd_name, self.modules, "command", "be a known one")
        command: click.Command = getattr(importlib.import_module(self.modules[cmd_name]), cmd_name)
        return command

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = False,
        **extra: Any,
    ) -> NoReturn:
        """Run a command, and end with its exit code.

        Click's standalone mode is not used, because its messages have several lines.
        """
        with ending_at_once(), _warnings_as_sentences(), naming(in_options):
            try:
                code = super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
            except InputError as error:
                code = _print_error(str(error), _BAD_INPUT)
            except click.Abort as abort:
                code = _print_error(str(abort.__cause__ or "") or MESSAGE, INTERRUPTED)
            except click.ClickException as error:
                code = _print_error(str(_as_input_error(error)), _BAD_INPUT)
        sys.exit(code)


def _as_input_error(error: click.ClickException) -> InputError:
    """Click's message about options and arguments as an `InputError`."""
    command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else ""
    if isinstance(error, click.MissingParameter) and error.param is not None:
        name, metavar = error.param.opts[-1], error.param.metavar or ""
        if isinstance(error.param, click.Argument):
            like = f"{command} {_ARGUMENTS[name]}" if name in _ARGUMENTS else ""
            name = name.upper()
        else:
            in_help = _EXAMPLE_IN_HELP.search(getattr(error.param, "help", None) or "")
            like = f"{name} {in_help[1] if in_help else _EXAMPLES.get(metavar, metavar)}"
        advice = f"add it, like {like}" if like else "add it"
        return InputError(name, "be given", "nothing", advice)
    if isinstance(error, click.NoSuchOption):
        near = [f"did you mean '{name}'?" for name in error.possibilities or ()]
        advice = next(iter(near), f"{command} --help lists them")
        return InputError(error.option_name, f"be an option of {command}", "", advice)
    text = error.format_message().rstrip(".")
    if isinstance(error, click.UsageError) and "unexpected extra argument" in text:
        surplus = text.partition("(")[2].rpartition(")")[0]
        advice = 'quote a value that has blanks, like -V "1 um/s"'
        return InputError(f"the arguments of {command}", "be fewer", f"'{surplus}' too", advice)
    return InputError(text)


@contextmanager
def _warnings_as_sentences() -> Iterator[None]:
    """Show a library's warning as one line without the path of its source, once for each text."""
    earlier, shown = warnings.showwarning, set()

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        text = printable(str(message))
        if issubclass(category, RuntimeWarning) and " encountered in " in text:
            text = f"a number of the computation exceeded the range of doubles ({text})"
        if text not in shown:
            shown.add(text)
            click.echo(f"asperity: warning: {text}", err=True)

    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = earlier


def _print_error(message: str, code: int) -> int:
    """Print a message as one line; the user's text in it may have line breaks."""
    click.echo("asperity: " + " ".join(message.split()), err=True)
    return code
