"""Friction under a modulated normal load: laws, periodic responses, and the paper they come from.

Nothing heavy is loaded here; each name below is imported when first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from asperity._version import __version__

if TYPE_CHECKING:
    from asperity import (
        air,
        figures,
        instrument,
        laws,
        loads,
        materials,
        report,
        solve,
        study,
        units,
    )
    from asperity.errors import InputError
    from asperity.slider import Slider
    from asperity.solve import (
        averaged_response,
        continuation,
        doubled_branch,
        periodic_response,
        perturbation_response,
        sensitivities,
        stability_boundary,
        transient,
    )

#: Public names and the module each is defined in.
_HOMES = {
    "InputError": "asperity.errors",
    "Slider": "asperity.slider",
    "averaged_response": "asperity.solve",
    "continuation": "asperity.solve",
    "doubled_branch": "asperity.solve",
    "periodic_response": "asperity.solve",
    "perturbation_response": "asperity.solve",
    "sensitivities": "asperity.solve",
    "stability_boundary": "asperity.solve",
    "transient": "asperity.solve",
}
_MODULES = (
    *("air", "figures", "instrument", "laws", "loads"),
    *("materials", "report", "solve", "study", "units"),
)

__all__ = [
    "InputError",
    "Slider",
    "__version__",
    "air",
    "averaged_response",
    "continuation",
    "doubled_branch",
    "figures",
    "instrument",
    "laws",
    "loads",
    "materials",
    "periodic_response",
    "perturbation_response",
    "report",
    "sensitivities",
    "solve",
    "stability_boundary",
    "study",
    "transient",
    "units",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(importlib.import_module(_HOMES[name]), name)
    elif name in _MODULES:
        value = importlib.import_module(f"asperity.{name}")
    else:
        raise AttributeError(f"module 'asperity' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
