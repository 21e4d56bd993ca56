"""What the text says was measured, as a list that a law either meets or not.

The experimental points are not in the text. What it states in words and numbers about the response
at 120 Hz, 1 and 10 um/s is all the evidence there is to compare a law with. Each feature is the
claim that states it, judged by its rule over the amplitudes that the statement covers, with another
law in place of the elasto-plastic one.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

from asperity.ledger import judge_claims
from asperity_papers.bureau2000.machine import PAPER, Law, Machine

#: The claim that states each feature.
CLAIMS: Mapping[str, str] = {
    "drop": "relative-drop",
    "drop against V": "drop-velocity-independent",
    "mu1": "mu1-order",
    "mu1 against V": "mu1-velocity-independent",
    "drop over mu1": "drop-over-mu1",
    "mu2 over mu1": "mu2-over-mu1",
    "mu2 against V": "mu2-lower-when-slow",
}


def missed(machine: Machine, law: Law) -> list[str]:
    """The features that a law does not meet."""
    stated = tuple(entry for entry in PAPER.contents.claim if entry.id in CLAIMS.values())
    contents = PAPER.contents.model_copy(update={"claim": stated})
    model = SimpleNamespace(terms=machine.terms | {"EXT": law})
    claims = judge_claims(contents, {}, machine.numbers, lambda _: model)
    failed = {claim.id for claim in claims if claim.verdict != "reproduced"}
    return [name for name, claim in CLAIMS.items() if claim in failed]


def met(machine: Machine, law: Law) -> str:
    """How many of the features a law meets, and which it misses, as text."""
    lacking, total = missed(machine, law), len(CLAIMS)
    text = f"{total - len(lacking)} of {total}"
    return f"{text} (not: {', '.join(lacking)})" if lacking else text
