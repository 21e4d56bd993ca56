"""Laws by name."""

from __future__ import annotations

import dataclasses

from asperity.errors import InputError, closest
from asperity.laws.law import Law

_LAWS: dict[str, type[Law]] = {}


def register(law: type[Law]) -> type[Law]:
    """Make `law` known by its `name`; returns it, so that it serves as a class decorator."""
    known = _LAWS.setdefault(law.name, law)
    if known is not law:
        raise InputError(
            f"law.name must be unique, got '{law.name}', which {known.__module__} already has; "
            "choose another name"
        )
    return law


def registered() -> dict[str, type[Law]]:
    """All registered laws by name."""
    return dict(_LAWS)


def get_law(name: str) -> type[Law]:
    """Look a law up by name.

    Raises
    ------
    InputError
        If no law has that name; the message gives the nearest one.
    """
    try:
        return _LAWS[name]
    except KeyError:
        raise InputError(
            f"law must be a registered law, got '{name}'; {closest(name, _LAWS)}"
        ) from None


def law_parameters(law: type[Law]) -> tuple[str, ...]:
    """Names of the parameters of a law, as tables write them (``lambda_`` is ``lambda``)."""
    return tuple(f.name.rstrip("_") for f in dataclasses.fields(law))
