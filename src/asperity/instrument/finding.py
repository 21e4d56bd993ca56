"""What a check has found in a recording: a number and a sentence, never a silent repair."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Severity = Literal["note", "warning", "error"]


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
    """

    name: str
    severity: Severity
    number: float
    where: str
    sentence: str

    def __str__(self) -> str:
        return f"{self.severity}: {self.name} ({self.where}): {self.sentence}"
