"""The claims ledger: every quantitative and comparative statement of the paper, checked.

The paper is Bureau, Baumberger and Caroli (2000). Its experimental points are not in the text, so
that statements about measurements are held against what the models give. Rules are fixed in
`asperity.study.claims.rules`, verdicts found by `asperity.study.claims.claim`.
"""

from __future__ import annotations

from collections.abc import Callable

from asperity.study.claims import (
    abstract,
    air_cushion,
    appendix,
    appendix_layer,
    appendix_numbers,
    appendix_vacuum,
    conclusions,
    elasto_plastic,
    experiments,
    introduction,
    linker_dieterich,
    perturbative,
    rice_ruina,
    scales,
    setup,
)
from asperity.study.claims.claim import VERDICTS, Claim, Verdict

__all__ = ["VERDICTS", "Claim", "Verdict", "ledger"]

#: In the order of the paper.
_SECTIONS: tuple[Callable[[], list[Claim]], ...] = (
    abstract.claims,
    introduction.claims,
    setup.claims,
    experiments.claims,
    air_cushion.claims,
    perturbative.claims,
    scales.claims,
    rice_ruina.claims,
    linker_dieterich.claims,
    elasto_plastic.claims,
    conclusions.claims,
    appendix.claims,
    appendix_layer.claims,
    appendix_numbers.claims,
    appendix_vacuum.claims,
)


def ledger(progress: Callable[[int], None] | None = None) -> list[Claim]:
    """Compute all claims, in the order of the paper.

    Parameters
    ----------
    progress : callable, optional
        Called with the number of claims finished since the last call.

    Returns
    -------
    list of Claim
    """
    report = progress or (lambda _: None)
    found: list[Claim] = []
    for section in _SECTIONS:
        claims = section()
        found += claims
        report(len(claims))
    return found
