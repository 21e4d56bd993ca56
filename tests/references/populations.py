"""Parametrised draws: a few of them in `make test`, the others in `make test-long`."""

import pytest


def population(draws, *, short=1, several=False):
    """Values for `pytest.mark.parametrize`, of which those after the first are long.

    Parameters
    ----------
    draws : int or iterable
        Number of seeds, or the values.
    short : int
        Number of values that `make test` runs.
    several : bool
        Whether each value is a tuple of the values of several arguments.
    """
    values = list(range(draws) if isinstance(draws, int) else draws)
    rest = (value if several else (value,) for value in values[short:])
    return [*values[:short], *(pytest.param(*each, marks=pytest.mark.long) for each in rest)]


def draws(few, many):
    """Number of draws of a statistic: `few` in `make test`, `many` in `make test-long`."""
    return pytest.mark.parametrize("draws", [few, pytest.param(many, marks=pytest.mark.long)])
