"""The paper, reproduced: figures, tables, the ledger of its claims, and one page that shows all."""

from asperity.report.reproduction import reproduce
from asperity.report.summary import ReproductionSummary

__all__ = ["ReproductionSummary", "reproduce"]
