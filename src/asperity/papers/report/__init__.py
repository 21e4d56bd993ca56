"""A paper reproduced: figures, tables, the ledger of its claims, and one page that shows all."""

from asperity.papers.report.reproduction import reproduce
from asperity.papers.report.summary import ReproductionSummary
from asperity.papers.sections import FigureTable, PaperFigure, Section

__all__ = ["FigureTable", "PaperFigure", "ReproductionSummary", "Section", "reproduce"]
