"""Papers reproduced: claims, rules, verdicts and a report page for any paper.

A paper is a separate package with an entry point; see `asperity.ledger.paper`.
"""

from asperity.ledger.claims import (
    VERDICTS,
    Claim,
    Headline,
    Sensitivity,
    altered,
    check,
    find_checks,
    judge_claims,
)
from asperity.ledger.contents import KINDS, Contents
from asperity.ledger.figures import (
    FigureNumbers,
    FigureTable,
    FigureWords,
    PaperFigure,
    Section,
    TabFigure,
    figure_words,
)
from asperity.ledger.markup import rich, table
from asperity.ledger.paper import Paper, available, find_paper
from asperity.ledger.recipe import RecipeNumber, RecipeResult, read_columns
from asperity.ledger.report import ReproductionSummary, reproduce
from asperity.ledger.rules import AcceptanceRule
from asperity.ledger.sentences import fill

__all__ = [
    "KINDS",
    "VERDICTS",
    "AcceptanceRule",
    "Claim",
    "Contents",
    "FigureNumbers",
    "FigureTable",
    "FigureWords",
    "Headline",
    "Paper",
    "PaperFigure",
    "RecipeNumber",
    "RecipeResult",
    "ReproductionSummary",
    "Section",
    "Sensitivity",
    "TabFigure",
    "altered",
    "available",
    "check",
    "figure_words",
    "fill",
    "find_checks",
    "find_paper",
    "judge_claims",
    "read_columns",
    "reproduce",
    "rich",
    "table",
]
