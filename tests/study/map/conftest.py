"""The paper's numbers, and a plane whose boundary is known."""

from collections.abc import Callable

import numpy as np
import pytest

from asperity import materials
from asperity.study.map import Axis
from asperity.study.map.plane import OUTPUTS
from asperity.study.points import Answers, SweepOutcome


@pytest.fixture(scope="session")
def pmma():
    return materials.load("bureau2000")


@pytest.fixture(scope="session")
def numbers(pmma):
    """What `response_map` needs besides K and epsilon."""
    names = ("mu0", "A", "B", "D0", "V0", "lambda", "W0")
    values = {name: pmma[name].si for name in names}
    return {**values, "V": "1 um/s", "frequency": "120 Hz"}


class KnownPlane:
    """Stands for a `MapPlane` whose ln|m| is a formula of the positions."""

    def __init__(self, g: Callable, count: int, failed: Callable | None = None) -> None:
        self.g, self.failed = g, failed or (lambda x, y: np.zeros(x.shape, bool))
        self.x = self.y = Axis("epsilon", 0.0, 0.5, count)
        self.shape = (count, count)

    def nodes(self):
        u = np.linspace(0.0, 1.0, self.shape[0])
        return np.stack([a.ravel() for a in np.meshgrid(u, u)], axis=-1)

    def solve(self, where):
        x, y = where.T
        numbers = {name: np.zeros(len(where)) for name in OUTPUTS} | {
            "log_multiplier": self.g(x, y)
        }
        answers = Answers(numbers, np.zeros(len(where), np.int16), np.zeros(len(where)))
        answers.fail(self.failed(x, y), SweepOutcome.REFUSED)
        return answers


@pytest.fixture
def known():
    return KnownPlane
