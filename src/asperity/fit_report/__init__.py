"""The report folder of a fit or a comparison: page, JSON, materials and posterior draws."""

from asperity.fit_report.folder import write_comparison, write_report

__all__ = ["write_comparison", "write_report"]
