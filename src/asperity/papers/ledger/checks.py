"""What a check computes for a claim, and the mark that ties a function to a claim."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, TypeVar

from asperity.errors import InputError

_MARK = "checked_claims"
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class CheckResult:
    """What was computed for a claim.

    Attributes
    ----------
    numbers : mapping of str to float
        What the claim's rule is applied to: every one of them has to pass. A rule on a formula
        expects ``printed``, ``independent`` and, where a corrected formula exists, ``derived``.
    computed : str
        The numbers as a reader wants them, with units.
    """

    numbers: Mapping[str, float]
    computed: str


def check(claim: str, *arguments: Any) -> Callable[[Function], Function]:
    """Mark a function as the computation of a claim.

    Parameters
    ----------
    claim : str
        The claim's ``id`` in claims.toml.
    *arguments
        Passed to the function after the paper's model; a function may compute several claims,
        with one mark each.
    """

    def mark(function: Function) -> Function:
        marks = (*getattr(function, _MARK, ()), (claim, arguments))
        setattr(function, _MARK, marks)
        return function

    return mark


def find_checks(module: ModuleType) -> dict[str, Callable[[Any], CheckResult]]:
    """Marked functions of a module, or of all modules of a package, by the id of their claim.

    Raises
    ------
    InputError
        If two functions compute one claim.
    """
    modules = [module]
    for info in pkgutil.walk_packages(getattr(module, "__path__", []), f"{module.__name__}."):
        modules.append(importlib.import_module(info.name))
    found: dict[str, Callable[[Any], CheckResult]] = {}
    for own in modules:
        for value in vars(own).values():
            if getattr(value, "__module__", None) != own.__name__:
                continue  # imported there, defined elsewhere
            for claim, arguments in getattr(value, _MARK, ()):
                if claim in found:
                    raise InputError(
                        f"checks.{claim} must be computed by one function, got two; "
                        "remove one of the marks"
                    )
                found[claim] = _bound(value, arguments)
    return found


def _bound(
    function: Callable[..., CheckResult], arguments: tuple[Any, ...]
) -> Callable[[Any], CheckResult]:
    return lambda model: function(model, *arguments)
