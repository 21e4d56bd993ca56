"""Figures and experiment of the paper, computed once for this folder: more than half a minute."""

import pytest


@pytest.fixture(scope="session")
def figures():
    """The numbers behind the figures of Bureau et al. (2000), by name."""
    from asperity_papers.bureau2000.figures import NUMBERS
    from asperity_papers.bureau2000.machine import Machine

    return {name: compute(Machine()) for name, compute in NUMBERS.items()}


@pytest.fixture(scope="session")
def experiment():
    """The virtual experiment with two of its three runs of each series."""
    from asperity_papers.bureau2000 import recordings

    three = recordings.Series.seeds.fget
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recordings.Series, "seeds", property(lambda series: three(series)[:2]))
        return recordings.experiment()
