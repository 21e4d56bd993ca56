"""Findings: the defects of a recording, each as a number and a sentence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from asperity.arrays import Float
from asperity.errors import InputError, printable
from asperity.parameters.arguments import typed

Severity = Literal["note", "warning", "error"]

#: Findings that may explain why a column is missing or has a wrong name.
_COLUMNS = frozenset(
    {
        "truncated",
        "heading mismatch",
        "other length",
        "several clocks",
        "short column",
        "text column",
    }
)


@typed
@dataclass(frozen=True)
class Finding:
    """A defect of a recording, or an assumption of its reader.

    Attributes
    ----------
    name : str
        Short name of the defect, such as ``"gap"``, ``"missing values"`` or ``"truncated"``.
    severity : {"note", "warning", "error"}
        A note changes no result, a warning can, an error means that part of the recording is
        missing or unusable.
    number : float
        Size of the defect; the sentence has the unit.
    where : str
        Channel, row (counted from 0) and time of the first or largest occurrence.
    sentence : str
        The sentence for the user.

    Notes
    -----
    Control characters of a damaged file are escaped, and long texts are cut.
    """

    name: str
    severity: Severity
    number: float
    where: str
    sentence: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "where", printable(self.where, 200))
        object.__setattr__(self, "sentence", printable(self.sentence))

    def concerns(self, channel: str) -> bool:
        """Whether the finding is about this channel."""
        return self.where == channel or self.where.startswith(f"{channel}, ")

    def __str__(self) -> str:
        return f"{self.severity}: {self.name} ({self.where}): {self.sentence}"


def at_row(channel: str, row: int, time: Float) -> str:
    """Where a finding is: a channel or time, a row, and its time (s)."""
    return f"{channel}, row {row}, t = {time[row]:.10g} s"


def with_cause(error: InputError, findings: Iterable[Finding]) -> InputError:
    """An error about a missing column, with the findings about the columns of the file added.

    Parameters
    ----------
    error : InputError
        Returned unchanged if no finding is about missing columns.
    findings : iterable of Finding
        Findings of the reader.
    """
    causes = [f.sentence.rstrip(".") for f in findings if f.name in _COLUMNS]
    return error.noting(f" ({'; '.join(causes)})") if causes else error
