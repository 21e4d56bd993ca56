"""Laws by name."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

from asperity.errors import InputError, closest
from asperity.laws.consistency import checked_class
from asperity.laws.discovery import installed, law_at, load_installed
from asperity.laws.law import Law
from asperity.parameters.arguments import shown, typed

_LAWS: dict[str, type[Law]] = {}


def register(law: type[Law]) -> type[Law]:
    """Register `law` under its `name`; returns the law, for use as a class decorator.

    A file that is loaded again replaces the law that it gave before.

    Raises
    ------
    InputError
        If another law has that name, or a law from outside the package breaks a rule of
        `asperity.laws.consistency.checked_class`.
    """
    if not law.__module__.startswith("asperity."):
        checked_class(law, f"the class {law.__name__}")
    known = _LAWS.setdefault(law.name, law)
    if known is not law and _same_source(known, law):
        _LAWS[law.name] = law
    elif known is not law:
        raise InputError(
            f"law.name must be unique, got '{law.name}', which {known.__module__} already has; "
            "choose another name"
        )
    return law


def _same_source(known: type[Law], law: type[Law]) -> bool:
    """Whether two classes have the same definition, loaded twice from its file."""
    files = [getattr(sys.modules.get(c.__module__), "__file__", None) for c in (known, law)]
    if known.__qualname__ != law.__qualname__ or None in files:
        return False
    return len({Path(str(file)).resolve() for file in files}) == 1


def registered() -> dict[str, type[Law]]:
    """All known laws by name, with those of installed packages.

    An installed law that cannot be imported is left out with a warning.
    """
    for name, point in installed().items():
        if name not in _LAWS:
            try:
                register(load_installed(point))
            except InputError as error:
                warnings.warn(str(error), stacklevel=2)
    return dict(_LAWS)


@typed
def get_law(name: str) -> type[Law]:
    """Look a law up by name: one of the package, registered, or of an installed package.

    Raises
    ------
    InputError
        If no law has that name; the message gives the nearest one.
    """
    if name not in _LAWS and name in installed():
        register(load_installed(installed()[name]))
    if name not in _LAWS:
        raise InputError(
            f"law must be a registered law, got {shown(name)}; {closest(name, registered())}"
        )
    return _LAWS[name]


def known_law(text: str) -> str:
    """Name of a law from its name or its place; a law at a place is registered.

    Parameters
    ----------
    text : str
        A name, ``module:Name``, or ``path/to/file.py:Name``; a place runs the code there.

    Raises
    ------
    InputError
        If there is no such law.
    """
    if ":" not in text:
        return text
    return register(law_at(text)).name
