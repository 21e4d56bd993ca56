"""An operating point: a law, and where its numbers come from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from asperity.questions.record import Given, Question


class Point(Question):
    """A law and its numbers, those of the machine and those of the motion.

    Attributes
    ----------
    law : str
        Registered.
    material : str
        Name, or a file relative to `folder`: its numbers apply where `parameters` has none.
    parameters : mapping of str to float, str or bool
        By the names of `asperity.parameters`: of the law, K, W0, M, eta, V, epsilon, frequency,
        inertia. Numbers in SI, or texts with units.
    folder : Path
        Where files that the record names lie.
    """

    subject = "point"

    law: str = ""
    material: str = ""
    parameters: Mapping[str, Given] = {}
    folder: Path = Path()
