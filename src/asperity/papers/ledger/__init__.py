"""Statements of a paper, what is computed for each, and the verdict that a rule gives."""

from asperity.papers.ledger.checks import CheckResult, check
from asperity.papers.ledger.claim import KINDS, VERDICTS, Claim, Kind, Sensitivity, Verdict
from asperity.papers.ledger.headline import Headline

__all__ = [
    "KINDS",
    "VERDICTS",
    "CheckResult",
    "Claim",
    "Headline",
    "Kind",
    "Sensitivity",
    "Verdict",
    "check",
]
