"""What is computed of the paper, once for all tests of this room: it takes a minute and more."""

import pytest


@pytest.fixture(scope="session")
def figures():
    """The numbers behind the figures of Bureau et al. (2000), by name."""
    from asperity.papers.bureau2000 import numbers

    return {figure.name: figure for figure in (compute() for compute in numbers.FIGURES)}


@pytest.fixture(scope="session")
def experiment():
    """The virtual experiment, from the process that `asperity reproduce` has compute it."""
    from asperity.papers.bureau2000.virtual import experiment_beside

    with experiment_beside() as readings:
        return readings()
