"""An operating point: a law with its numbers or a material that supplies them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from asperity.questions.record import Given, Question


class Point(Question):
    """A law with the numbers of the law, of the machine and of the motion.

    Attributes
    ----------
    law : str
        Name of a registered law.
    material : str
        Name of a material, or a file relative to `folder`. Its numbers apply where `parameters`
        has none.
    parameters : mapping of str to float, str or bool
        Numbers in SI, or texts with units, by the names of `asperity.parameters`: parameters of
        the law, K, W0, M, eta, V, epsilon, frequency, inertia.
    folder : Path
        Folder of files that the record names.
    """

    subject = "point"

    law: str = ""
    material: str = ""
    parameters: Mapping[str, Given] = {}
    folder: Path = Path()
