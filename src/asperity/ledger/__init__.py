"""Papers reproduced: claims, rules, verdicts and a report page for any paper.

A paper is a separate package with an entry point; see `asperity.ledger.paper`.
"""

from asperity._lazy import public_names
from asperity.ledger.claims import (
    VERDICTS as VERDICTS,
    Claim as Claim,
    Headline as Headline,
    Sensitivity as Sensitivity,
    altered as altered,
    check as check,
    find_checks as find_checks,
    judge_claims as judge_claims,
    printed_numbers as printed_numbers,
)
from asperity.ledger.contents import KINDS as KINDS, Contents as Contents
from asperity.ledger.figures import (
    FigureNumbers as FigureNumbers,
    FigureTable as FigureTable,
    FigureWords as FigureWords,
    PaperFigure as PaperFigure,
    Section as Section,
    TabFigure as TabFigure,
    figure_words as figure_words,
)
from asperity.ledger.markup import rich as rich, table as table
from asperity.ledger.paper import Paper as Paper, available as available, find_paper as find_paper
from asperity.ledger.recipe import (
    RecipeNumber as RecipeNumber,
    RecipeResult as RecipeResult,
    read_columns as read_columns,
)
from asperity.ledger.report import (
    ReproductionSummary as ReproductionSummary,
    reproduce as reproduce,
)
from asperity.ledger.rules import AcceptanceRule as AcceptanceRule, formula_value as formula_value
from asperity.ledger.sentences import fill as fill

__all__ = public_names(globals())
