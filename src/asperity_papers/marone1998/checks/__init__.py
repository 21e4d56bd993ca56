"""What is computed for each claim of the paper; claims.toml has the words and the rules."""

from __future__ import annotations

from asperity.materials import Material
from asperity_papers.marone1998.laboratory import Laboratory


def model(numbers: Material) -> Laboratory:
    """What the checks are given."""
    return Laboratory(numbers)
