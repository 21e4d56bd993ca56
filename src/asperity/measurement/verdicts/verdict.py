"""Verdicts: every doubt about a recording as a number, a threshold and a sentence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf
from typing import ClassVar, Literal

from asperity.parameters.parameter import Drawn, SummaryLine

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
        The measured number; the sentence says what it is.
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


class Limits(dict[str, tuple[float, float]]):
    """Where the number of each check becomes suspicious and where bad, by the check's name.

    The larger of the two comes first where small numbers are bad.
    """

    def check(self, name: str, number: float, sentence: str, *, significant: bool = True) -> Check:
        """A check whose verdict follows from its limits.

        Parameters
        ----------
        name : str
            One of the keys.
        number : float
        sentence : str
        significant : bool
            A number that noise explains is ok however large it is.
        """
        suspicious, bad = self[name]
        small_is_bad = suspicious > bad

        def beyond(limit: float) -> bool:
            # A number that is not known is beyond every limit.
            return not (number >= limit if small_is_bad else number <= limit)

        verdict: Verdict = "ok"
        if significant and beyond(suspicious):
            verdict = "bad" if beyond(bad) else "suspicious"
        return Check(name, float(number), float(suspicious), float(bad), verdict, sentence)


#: Findings of a recording, as shares of the window where they can be; those of other names are
#: judged by their severity.
FINDINGS = Limits(
    {
        "saturation": (0.0, 0.01),
        "spike": (0.0, 0.001),
        "repeated time": (0.0, 0.05),
        "missing values": (0.0, 0.25),
        "infinite": (0.0, 0.25),
        "gap": (0.0, 0.25),
        "uneven sampling": (20.0, 1000.0),
    }
)
#: A modulated load. Of a force made of a friction coefficient small numbers are suspicious and none
#: is bad; a line at a harmonic of the mains is judged by epsilon, small being bad.
LOCK_IN = Limits(
    {
        "modulation": (20.0, 5.0),
        "periods": (5.0, 2.0),
        "signal": (10.0, 3.0),
        "drift": (0.005, 0.02),
        "transient": (0.001, 0.01),
        "stick-slip": (0.0005, 0.005),
        "load harmonics": (0.05, 0.3),
        "resolution": (0.1, 1.0),
        "contact": (0.95, 1.0),
        "leakage": (0.01, 0.1),
        "other modulation": (0.01, 0.1),
        "steady response": (0.05, 0.5),
        "steady load": (0.01, 0.05),
        "shifting response": (0.07, 0.4),
        "held samples": (0.01, 0.1),
        "computed force": (0.3, -1.0),
        "mains": (0.02, 0.005),
        "lines in the pauses": (0.02, 0.2),
        "hum": (0.05, 0.5),
        "flat top": (0.0, 0.16),
    }
)
#: Velocity steps and holds.
SLIDING = Limits(
    {
        "load": (0.005, 0.02),
        "drift": (0.02, 0.15),
        "sign": (0.5, inf),
        "segments": (0.0, inf),
        "settling": (0.3, inf),
    }
)
#: Slip events. Of 144 made recordings whose other checks are ok, 14 exceed the limit of ringing;
#: the gauges of all 14 ring.
STICK_SLIP = Limits(
    {
        "events": (10.0, 3.0),
        "regime": (0.0, inf),
        "loading": (0.0, inf),
        "sampling": (0.05, 0.5),
        "threshold": (0.1, inf),
        "hidden events": (0.02, inf),
        "ringing": (0.04, inf),
        "drift": (3.0, 30.0),
        "stiffness": (0.05, 0.3),
        "sign": (0.5, inf),
        "resolution": (0.1, inf),
    }
)


def worst(checks: Iterable[Check]) -> Verdict:
    """The gravest verdict; ``"ok"`` without checks."""
    return max((check.verdict for check in checks), key=_ORDER.index, default="ok")


def doubts_text(checks: Iterable[Check]) -> str:
    """Checks that are not ok, as ``name: verdict; ...``."""
    return "; ".join(f"{c.name}: {c.verdict}" for c in checks if c.verdict != "ok")


class Judged(Drawn):
    """A measurement with its checks, the basis of all kinds of measurements."""

    #: Kind of the measurement, as its record has it.
    mode: ClassVar[Literal["modulated", "sliding", "stick-slip"]]
    checks: tuple[Check, ...]

    @property
    def verdict(self) -> Verdict:
        """The gravest of all checks."""
        return worst(self.checks)

    def numbers(self) -> list[SummaryLine]:
        """The most telling numbers."""
        raise NotImplementedError

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """The most telling numbers, and the checks that are not ok."""
        doubts = [SummaryLine(c.name, c.verdict, c.sentence) for c in self.checks]
        return type(self).__name__, self.numbers() + [d for d in doubts if d.value != "ok"]


def percent(share: float) -> str:
    """A share in two digits, for a sentence."""
    return f"{float(f'{100 * share:.2g}'):g} %"
