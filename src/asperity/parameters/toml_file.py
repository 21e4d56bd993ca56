"""Reading of TOML files: plans, protocols, recipes, materials, and claims of papers."""

from __future__ import annotations

import errno
import os
import re
import stat
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.errors import InputError, printable
from asperity.parameters.arguments import file_path

#: Largest size of a text file (bytes): a table with a million rows of several numbers is smaller.
LARGEST = 128 * 2**20


def file_content(path: Path) -> bytes:
    """The bytes of a file.

    Raises
    ------
    OSError
        If it cannot be read, is a device, or is larger than `LARGEST`.
    """
    with path.open("rb") as stream:
        if stat.S_ISCHR(os.fstat(stream.fileno()).st_mode):
            raise OSError(errno.EINVAL, "it is a device")
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise OSError(errno.EFBIG, f"it has more than {LARGEST:,} bytes")
    return content


#: Largest nesting of tables and lists, ten times that of files written by hand.
_DEEPEST = 100
#: Integers that every TOML parser must accept.
_INTEGERS = range(-(2**63), 2**63)
#: A key of `_DEEPEST` parts or more; the time of the parser grows with the square of their number.
_LONG_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{_DEEPEST}}}"""
)


class SyntaxMistakeError(InputError):
    """A text that is not TOML.

    Attributes
    ----------
    line : int
        Line of the mistake, counted from 1.
    """

    line = 0


def toml_content(path: str | os.PathLike[str], label: str) -> tuple[Path, dict[str, Any]]:
    """Path and content of a TOML file.

    Parameters
    ----------
    path : str or path
    label : str
        Kind of the file, for messages: ``plan``, ``protocol``.

    Raises
    ------
    InputError
        If there is no such file, it cannot be read, or its text is invalid as in `parsed_toml`.
    """
    file = file_path(path, label)
    try:
        text = file_content(file).decode("utf-8-sig")
    except FileNotFoundError:
        advice = "there is none, correct the path"
        raise InputError(label, "be a file", f"'{path}'", advice) from None
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        rule = "be a readable TOML file"
        raise InputError(label, rule, f"'{path}' ({why})", "give another") from None
    return file, parsed_toml(text.replace("\r\n", "\n"), label, f"'{path}'")


def parsed_toml(text: str, label: str, source: str = "a text") -> dict[str, Any]:
    """Content of a TOML text.

    Parameters
    ----------
    text : str
    label : str
        Kind of the content, for messages.
    source : str
        Source of the text, for messages.

    Raises
    ------
    InputError
        If the text is not TOML, is nested too deeply, or has an integer of more than 64 bits, which
        a TOML parser need not accept.
    """
    deep = InputError(
        label,
        f"have at most {_DEEPEST} tables and lists in each other",
        f"more in {source}",
        "write fewer",
    )
    large = InputError(
        label,
        "have integers of at most 64 bits",
        f"a larger one in {source}",
        "write it as a decimal number",
    )
    if _LONG_KEY.search(text):
        raise deep
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what = printable(" ".join(str(error).split()))
        got, advice = f"{source} ({what})", "correct that line"
        mistake = SyntaxMistakeError(label, "be valid TOML", got, advice)
        line = re.search(r"at line (\d+)", what)  # a mistake at the end has no line
        mistake.line = int(line[1]) if line else text.count("\n") + 1
        raise mistake from None
    except RecursionError:
        raise deep from None
    except ValueError:
        # Python refuses integers of more than 4300 digits.
        raise large from None
    level: list[Any] = [content]
    for _ in range(_DEEPEST):
        inner = [v for one in level for v in (one.values() if isinstance(one, Mapping) else one)]
        if any(isinstance(v, int) and v not in _INTEGERS for v in inner):
            raise large
        level = [v for v in inner if isinstance(v, dict | list)]
    if level:
        raise deep
    return content
