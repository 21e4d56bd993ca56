"""A fit as a folder: one page that shows everything, the draws, and a material to go on with."""

from asperity.fit_report.folder import write_report

__all__ = ["write_report"]
