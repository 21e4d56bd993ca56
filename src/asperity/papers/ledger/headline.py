"""Conclusions of a paper, decided by the verdicts on the claims that they rest on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from asperity.papers.ledger.claim import Claim
from asperity.papers.ledger.contents import HeadlineWords

Standing: TypeAlias = Literal["holds", "holds at the central values", "undecided", "does not hold"]


@dataclass(frozen=True)
class Headline:
    """A conclusion of the paper.

    Attributes
    ----------
    claim : str
        What the paper concludes.
    found : str
        What was computed.
    standing : str
        "holds": every claim is reproduced, at the ends of all published uncertainties too.
        "holds at the central values": every claim is reproduced there, not at all ends.
        "undecided": a claim is not reproduced at the central values, but is within the
        uncertainties. "does not hold": a claim is reproduced nowhere.
    claims : tuple of str
        Ids of the claims that decide.
    """

    claim: str
    found: str
    standing: Standing
    claims: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether every claim is reproduced at the central values."""
        return self.standing in ("holds", "holds at the central values")


def headlines(words: Sequence[HeadlineWords], claims: Sequence[Claim]) -> list[Headline]:
    """The paper's conclusions in the order of its claims.toml.

    Parameters
    ----------
    words : sequence of HeadlineWords
    claims : sequence of Claim
        The whole ledger of that paper.
    """
    ledger = {claim.id: claim for claim in claims}
    computed = {name: claim.computed for name, claim in ledger.items()}
    return [
        Headline(
            claim=own.statement,
            found=own.found.format_map(computed),
            standing=_standing([ledger[name] for name in own.claims]),
            claims=own.claims,
        )
        for own in words
    ]


def _standing(claims: Sequence[Claim]) -> Standing:
    failed = [claim for claim in claims if claim.verdict != "reproduced"]
    if any(claim.decided for claim in failed):
        return "does not hold"
    if failed:
        return "undecided"
    return "holds" if all(claim.decided for claim in claims) else "holds at the central values"
