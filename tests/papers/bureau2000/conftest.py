"""What is computed of the paper, once for all tests of this room: it takes a minute and more."""

import pytest


@pytest.fixture(scope="session")
def figures():
    """The numbers behind the figures of Bureau et al. (2000), by name."""
    from asperity_papers.bureau2000.figures import NUMBERS
    from asperity_papers.bureau2000.machine import Machine

    return {name: compute(Machine()) for name, compute in NUMBERS.items()}


@pytest.fixture(scope="session")
def experiment():
    """The virtual experiment, from the process that `asperity reproduce` has compute it."""
    from asperity_papers.bureau2000.recordings import experiment_in_background

    with experiment_in_background() as readings:
        return readings()
