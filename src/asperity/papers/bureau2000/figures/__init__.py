"""The figures of Bureau, Baumberger and Caroli (2000) as the models have them, and four more."""

from asperity.papers.bureau2000.figures.drawn import DRAWN, SCHEMATICS, Schematic
from asperity.papers.bureau2000.figures.report_sections import sections

__all__ = ["DRAWN", "SCHEMATICS", "Schematic", "sections"]
