"""Bad input to a command: one sentence on stderr, exit code 2."""

from click.testing import Result


def refused(result: Result, *parts: str) -> None:
    """Exactly one line that says these things, and exit code 2."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.startswith("asperity: ")
    assert result.stderr.count("\n") == 1
    assert result.stderr.endswith("\n")
    for part in parts:
        assert part in result.stderr
