"""Figures and experiment of the paper, computed once for this folder: half a minute in all."""

from collections.abc import Mapping

import pytest


class ComputedFigures(Mapping):
    """The numbers behind the figures by name, computed when a test first takes them."""

    def __init__(self, makers):
        self._makers, self._computed = makers, {}

    def __getitem__(self, name):
        from asperity_papers.bureau2000.machine import Machine

        if name not in self._computed:
            self._computed[name] = self._makers[name](Machine())
        return self._computed[name]

    def __iter__(self):
        return iter(self._makers)

    def __len__(self):
        return len(self._makers)


@pytest.fixture(scope="session")
def figures():
    """The numbers behind the figures of Bureau et al. (2000), by name."""
    from asperity_papers.bureau2000.figures import NUMBERS

    return ComputedFigures(NUMBERS)


@pytest.fixture(scope="session")
def experiment():
    """The virtual experiment with two of its three runs of each series."""
    from asperity_papers.bureau2000 import recordings

    three = recordings.Series.seeds.fget
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recordings.Series, "seeds", property(lambda series: three(series)[:2]))
        return recordings.experiment()
