"""The command line, called in this process."""

import functools
from collections.abc import Callable

import pytest
from click.testing import CliRunner, Result

from asperity.cli.main import main

Call = Callable[..., Result]


@pytest.fixture
def asperity() -> Call:
    """Call the command with arguments; the result has `exit_code`, `stdout` and `stderr`."""
    return functools.partial(_call, CliRunner())


def _call(runner: CliRunner, *arguments: object) -> Result:
    result = runner.invoke(main, [str(a) for a in arguments], prog_name="asperity")
    # A traceback is never an answer.
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result
