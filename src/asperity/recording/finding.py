"""What a check has found in a recording: a number and a sentence, never a silent repair."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from asperity.errors import InputError, printable

Severity = Literal["note", "warning", "error"]

#: Findings on a file whose columns are not all that was recorded, or not under their names.
_COLUMNS = frozenset(
    {"truncated", "heading mismatch", "other length", "short column", "text column"}
)


@dataclass(frozen=True)
class Finding:
    """One thing that a reader or a check noticed in a recording.

    Attributes
    ----------
    name : str
        Short name of the defect, such as ``"gap"``, ``"nan"`` or ``"truncated"``.
    severity : {"note", "warning", "error"}
        A note changes no result, a warning can, an error means that part of the recording is
        missing or unusable.
    number : float
        How much of it there is; the sentence says in what unit.
    where : str
        Channel, row (counted from 0) and time of the first or largest occurrence.
    sentence : str
        What was found, for a person to read.

    Control characters of a damaged file are escaped, and long texts cut.
    """

    name: str
    severity: Severity
    number: float
    where: str
    sentence: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "where", printable(self.where, 200))
        object.__setattr__(self, "sentence", printable(self.sentence))

    def __str__(self) -> str:
        return f"{self.severity}: {self.name} ({self.where}): {self.sentence}"


def with_cause(error: InputError, findings: Iterable[Finding]) -> InputError:
    """An error about a column that is not in a file, with what is wrong with the file's columns.

    Parameters
    ----------
    error : InputError
        It stays as it is where nothing is wrong with them.
    findings : iterable of Finding
        What the reader noticed.
    """
    causes = [f.sentence.rstrip(".") for f in findings if f.name in _COLUMNS]
    return InputError(f"{error} ({'; '.join(causes)})") if causes else error
