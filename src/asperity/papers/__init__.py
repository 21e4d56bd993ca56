"""Published papers, computed again: a ledger and a report for any, a folder for each."""

from __future__ import annotations

from asperity.papers.paper import Paper, available, find_paper

__all__ = ["Paper", "available", "find_paper"]
