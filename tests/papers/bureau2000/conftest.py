"""Figures and experiment of the paper, computed once for this folder: more than a minute."""

import pytest


@pytest.fixture(scope="session")
def figures():
    """The numbers behind the figures of Bureau et al. (2000), by name."""
    from asperity_papers.bureau2000.figures import NUMBERS
    from asperity_papers.bureau2000.machine import Machine

    return {name: compute(Machine()) for name, compute in NUMBERS.items()}


@pytest.fixture(scope="session")
def experiment():
    """The virtual experiment, in the background process that `asperity reproduce` uses."""
    from asperity_papers.bureau2000.recordings import experiment_in_background

    with experiment_in_background() as readings:
        return readings()
