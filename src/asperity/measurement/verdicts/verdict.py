"""Verdicts: every doubt about a recording as a number, a threshold and a sentence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "suspicious", "bad"]

_ORDER: tuple[Verdict, ...] = ("ok", "suspicious", "bad")


@dataclass(frozen=True)
class Check:
    """One question to a recording, and its answer.

    Attributes
    ----------
    name : str
        Short name, such as ``"stick-slip"``.
    number : float
        What was measured; the sentence says of what.
    suspicious, bad : float
        Where the verdicts begin: numbers above, or below if `suspicious` is the larger of the two.
    verdict : {"ok", "suspicious", "bad"}
    sentence : str
        For a person to read.
    """

    name: str
    number: float
    suspicious: float
    bad: float
    verdict: Verdict
    sentence: str

    def __str__(self) -> str:
        return f"{self.verdict}: {self.name}: {self.sentence}"


def judged(
    name: str,
    number: float,
    limits: tuple[float, float],
    sentence: str,
    *,
    significant: bool = True,
) -> Check:
    """A check whose verdict follows from two limits.

    Parameters
    ----------
    name : str
    number : float
    limits : (float, float)
        Where it becomes suspicious and where bad; the larger first if small numbers are bad.
    sentence : str
    significant : bool
        A number that noise explains is ok however large it is.
    """
    suspicious, bad = limits
    small_is_bad = suspicious > bad

    def beyond(limit: float) -> bool:
        return number < limit if small_is_bad else number > limit

    verdict: Verdict = "ok"
    if significant and beyond(suspicious):
        verdict = "bad" if beyond(bad) else "suspicious"
    return Check(name, float(number), float(suspicious), float(bad), verdict, sentence)


def worst(checks: Iterable[Check]) -> Verdict:
    """The gravest verdict; ``"ok"`` if there is none."""
    return max((check.verdict for check in checks), key=_ORDER.index, default="ok")


def percent(share: float) -> str:
    """A share in two digits, for a sentence."""
    return f"{float(f'{100 * share:.2g}'):g} %"
