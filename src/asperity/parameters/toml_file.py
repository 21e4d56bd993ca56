"""Files that a user writes as TOML."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

from asperity.errors import InputError
from asperity.parameters.arguments import file_path


def toml_content(path: str | os.PathLike[str], label: str) -> tuple[Path, dict[str, Any]]:
    """Path and content of a TOML file.

    Parameters
    ----------
    path : str or path
    label : str
        What the file is, for messages: ``plan``, ``protocol``.

    Raises
    ------
    InputError
        If there is no such file, it cannot be read, or it is not TOML.
    """
    file = file_path(path, label)
    try:
        return file, tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise InputError(
            f"{label} must be a file, got '{path}'; there is none, correct the path"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(
            f"{label} must be a readable TOML file, got '{path}' ({why}); give another"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"{label} must be valid TOML, got '{path}' ({' '.join(str(error).split())}); "
            "correct that line"
        ) from None
