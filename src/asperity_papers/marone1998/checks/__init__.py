"""The checks of the paper's claims; claims.toml has the words and the rules."""

from __future__ import annotations

from asperity.materials import Material
from asperity_papers.marone1998.laboratory import Laboratory


def model(numbers: Material) -> Laboratory:
    """The argument of the checks: the paper's interfaces on its springs."""
    return Laboratory(numbers)
