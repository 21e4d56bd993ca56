"""The methods in the order in which a search tries them: fast ones first."""

from __future__ import annotations

from collections.abc import Sequence

from asperity.orbit.methods.branch_following.method import BranchFollowing
from asperity.orbit.methods.collocation.frequency_path import FrequencyPath
from asperity.orbit.methods.collocation.method import Collocation
from asperity.orbit.methods.fourier.method import Fourier
from asperity.orbit.methods.method import Method
from asperity.orbit.methods.series import FourierSeries
from asperity.orbit.methods.shooting.method import Shooting
from asperity.parameters.arguments import some_of

METHODS: tuple[Method, ...] = (
    Fourier(),
    Shooting(),
    FourierSeries(),
    Collocation(),
    BranchFollowing(),
    FrequencyPath(),
)

#: What a user may choose among.
CHOICES = tuple(dict.fromkeys(method.choice for method in METHODS))

#: Earlier names of choices.
_SYNONYMS = {"smooth": "series"}


def chosen_methods(choices: Sequence[str]) -> tuple[Method, ...]:
    """The methods that a user chose, in the order of the search.

    Raises
    ------
    InputError
        If there is no method of a name.
    """
    given = some_of(choices, (*CHOICES, *_SYNONYMS), "methods")
    names = {_SYNONYMS.get(name, name) for name in given}
    return tuple(method for method in METHODS if method.choice in names)
