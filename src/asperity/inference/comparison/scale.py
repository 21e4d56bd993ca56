"""The scale of verdicts on laws: excluded, disfavoured, cannot tell.

Each word stands with the number that decides and the thresholds that it is compared with.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

#: A law is excluded by its misfit below this probability of chi-squared, if another law is not.
IMPOSSIBLE = 1e-3
#: Differences of AICc from which a law is disfavoured (weight 1/7) and excluded (1/150).
DISFAVOURED, EXCLUDED = 4.0, 10.0
#: Factor of the evidence from which a law is disfavoured: strong evidence.
FACTOR = 20.0

Word = Literal["excluded", "disfavoured", "cannot tell", "no fit"]


class Standing(NamedTuple):
    """Where a law stands relative to the best one.

    Attributes
    ----------
    word : {"excluded", "disfavoured", "cannot tell", "no fit"}
    number : str
        The number that decides, with its thresholds.
    """

    word: Word
    number: str


def standing(
    *, excluded: str, behind: float, evidence_behind: float, p_value: float | None
) -> Standing:
    """The standing of a law by the scale.

    Parameters
    ----------
    excluded : str
        Why the data exclude it by the rule of `asperity.inference.compare`; empty if they do not.
    behind : float
        AICc above the lowest; NaN without a fit.
    evidence_behind : float
        Natural logarithm of the factor by which its evidence is below that of the best law; NaN
        where it is unknown or unreliable.
    p_value : float or None
        Of chi-squared, where that judges the law.
    """
    if math.isnan(behind):
        return Standing("no fit", "")
    by_aicc = (
        f"AICc {behind:.3g} above the lowest (from {DISFAVOURED:g} disfavoured, from {EXCLUDED:g} "
        "excluded)"
    )
    if excluded:
        if p_value is not None and p_value < IMPOSSIBLE and behind < EXCLUDED:
            return Standing("excluded", f"p = {p_value:.2g} (excluded below {IMPOSSIBLE:g})")
        return Standing("excluded", by_aicc)
    if behind >= DISFAVOURED:
        return Standing("disfavoured", by_aicc)
    if evidence_behind >= math.log(FACTOR):
        factor = math.exp(min(evidence_behind, 700.0))
        return Standing(
            "disfavoured",
            f"evidence lower by a factor of {factor:.2g} (from {FACTOR:g} disfavoured)",
        )
    return Standing("cannot tell", by_aicc)
