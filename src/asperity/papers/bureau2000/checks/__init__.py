"""What is computed for each claim of the paper, by section.

The paper's experimental points are not in the text, so that statements about measurements are
compared with what the models give.
"""

from __future__ import annotations

from asperity.materials import Material
from asperity.papers.bureau2000.checks.model import Model

__all__ = ["Model", "model"]


def model(numbers: Material) -> Model:
    """What the checks are given: the slider and the air layer at one set of the paper's numbers."""
    return Model(numbers)
