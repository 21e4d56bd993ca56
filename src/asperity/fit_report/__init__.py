"""A fit or a comparison as a folder: one page that shows everything, draws, and materials."""

from asperity.fit_report.comparison import write_comparison
from asperity.fit_report.folder import write_report

__all__ = ["write_comparison", "write_report"]
