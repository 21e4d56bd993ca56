"""Laws by name: those of the package, of installed packages, and of a module or file.

A package makes its laws known in its ``pyproject.toml``::

    [project.entry-points."asperity.laws"]
    composite = "mylab.friction:Composite"

and a file or module that is not installed is named on the command line, ``--law
path/to/file.py:Composite`` or ``--law mylab.friction:Composite``. This runs the code of the file or
module. Tables and protocols, which other people may have written, therefore cannot name one.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import sys
import warnings
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import TypeGuard

from asperity.errors import InputError, Symbols, closest, code_of_others, require
from asperity.laws.consistency import checked_class
from asperity.laws.law import Law
from asperity.parameters import Names, display_name
from asperity.parameters.arguments import file_path, shown, typed

_LAWS: dict[str, type[Law]] = {}


@typed
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
        got = f"'{law.name}', which {known.__module__} already has"
        raise InputError("law.name", "be unique", got, "choose another name")
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


def symbols_of(names: Names, *laws: type[Law]) -> Symbols:
    """Names of parameters in a set of names, for `asperity.errors.naming`.

    Parameters
    ----------
    names : {"friction", "geophysics"}
    *laws : type of Law
        Laws that need not be registered.
    """
    return lambda name: display_name(name, names, *laws, *registered().values())


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
        raise InputError("law", "be a registered law", shown(name), closest(name, registered()))
    return _LAWS[name]


@typed
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


GROUP = "asperity.laws"


@cache
def installed() -> dict[str, EntryPoint]:
    """Entry points of the group ``asperity.laws`` by name."""
    return {point.name: point for point in entry_points(group=GROUP)}


def load_installed(point: EntryPoint) -> type[Law]:
    """Import the law of an entry point.

    Raises
    ------
    InputError
        If it cannot be imported, is no law, or has another name than the entry point.
    """
    where = f"entry point '{point.name}' of {point.value}"
    with code_of_others("law", advice="repair or uninstall the package", where=where):
        result = point.load()
    law = _checked(result, where)
    rule, got = "have the name of its entry point", f"{where} and the name '{law.name}'"
    require(law.name == point.name, "law", rule, got, "change one of the two")
    return law


def law_at(place: str) -> type[Law]:
    """Import the law at a place.

    Parameters
    ----------
    place : str
        ``module:Name`` or ``path/to/file.py:Name``.

    Raises
    ------
    InputError
        If there is no such module, file or name, its code fails, or it is no law.
    """
    where, _, name = place.rpartition(":")
    rule = "be a place like 'module:Name' or 'path/to/file.py:Name'"
    require(where and name, "law", rule, f"'{place}'", "give both parts")
    module = _module(where, place)
    if not hasattr(module, name):
        laws = [n for n, value in vars(module).items() if _is_law(value)]
        advice = closest(name, laws) if laws else "define a subclass of asperity.laws.Law in it"
        raise InputError("law", f"be in '{where}'", f"'{name}', which is not there", advice)
    return _checked(getattr(module, name), f"'{place}'")


def _module(where: str, place: str) -> ModuleType:
    file = where.endswith(".py")
    with code_of_others("law", where=f"'{place}'"):
        try:
            return _from_file(file_path(where, "law")) if file else importlib.import_module(where)
        except (FileNotFoundError, ModuleNotFoundError) as error:
            rule, advice = "be in a module or file that exists", "correct the path, or install it"
            raise InputError("law", rule, f"'{place}' ({error})", advice) from None


def _from_file(path: Path) -> ModuleType:
    file = path.resolve(strict=True)
    # One module for each file, so that the same file gives the same class; an edited file gives a
    # new module.
    content = hashlib.sha256(str(file).encode() + b"\0" + file.read_bytes())
    name = f"asperity_law_{content.hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(f"no Python file: {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _is_law(value: object) -> TypeGuard[type[Law]]:
    return isinstance(value, type) and issubclass(value, Law) and value is not Law


def _checked(result: object, where: str) -> type[Law]:
    if not _is_law(result):
        got, advice = f"{where}, a {type(result).__name__}", "see the page 'Write your own law'"
        raise InputError("law", "be a subclass of asperity.laws.Law", got, advice)
    return checked_class(result, where)
