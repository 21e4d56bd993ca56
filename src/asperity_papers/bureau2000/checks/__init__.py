"""The checks of the paper's claims: a module for each section.

A check returns numbers by name; claims.toml says which of them are judged, and how they are
written. The paper's experimental points are not in the text: a measurement cannot be computed, and
a statement about it is compared with what the models give.
"""

from __future__ import annotations

from asperity.materials import Material
from asperity_papers.bureau2000.machine import Machine


def model(numbers: Material) -> Machine:
    """The argument of the checks: slider and air layer at one set of the paper's numbers."""
    return Machine(numbers)
