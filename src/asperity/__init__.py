"""Friction under a modulated normal load: laws, periodic responses, and the paper they come from.

Nothing heavy is loaded here; each name below is imported when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from asperity._version import __version__

if TYPE_CHECKING:
    from asperity import (
        air,
        branches,
        experiment,
        figures,
        inference,
        laws,
        ledger,
        loads,
        lock_in,
        materials,
        measurement,
        orbit,
        parameters,
        protocol,
        recording,
        samples,
        slider,
        study,
        theory,
        transients,
        tribometer,
        units,
    )
    from asperity.app.notebook import explore
    from asperity.branches import continuation, doubled_branch, stability_boundary
    from asperity.errors import InputError
    from asperity.inference.answers import compare, fit
    from asperity.measurement.from_file import measure_recording as measure
    from asperity.orbit import (
        averaged_response,
        periodic_response,
        response_function,
        sensitivities,
    )
    from asperity.protocol.run import run_experiment as run
    from asperity.recording.readers import read
    from asperity.slider import Slider
    from asperity.study.map import response_map as map
    from asperity.study.threshold import stiffness_threshold
    from asperity.theory import perturbation_response
    from asperity.transients import transient

#: Public names that are no rooms: the module that has each, and its name there.
_HOMES = {
    "InputError": ("errors", "InputError"),
    "Slider": ("slider", "Slider"),
    "averaged_response": ("orbit", "averaged_response"),
    "compare": ("inference.answers", "compare"),
    "continuation": ("branches", "continuation"),
    "doubled_branch": ("branches", "doubled_branch"),
    "map": ("study.map", "response_map"),
    "explore": ("app.notebook", "explore"),
    "fit": ("inference.answers", "fit"),
    "measure": ("measurement.from_file", "measure_recording"),
    "periodic_response": ("orbit", "periodic_response"),
    "perturbation_response": ("theory", "perturbation_response"),
    "read": ("recording.readers", "read"),
    "response_function": ("orbit", "response_function"),
    "run": ("protocol.run", "run_experiment"),
    "sensitivities": ("orbit", "sensitivities"),
    "stability_boundary": ("branches", "stability_boundary"),
    "stiffness_threshold": ("study.threshold", "stiffness_threshold"),
    "transient": ("transients", "transient"),
}

__all__ = [
    "InputError",
    "Slider",
    "__version__",
    "air",
    "averaged_response",
    "branches",
    "compare",
    "continuation",
    "doubled_branch",
    "experiment",
    "explore",
    "figures",
    "fit",
    "inference",
    "laws",
    "ledger",
    "loads",
    "lock_in",
    "map",
    "materials",
    "measure",
    "measurement",
    "orbit",
    "parameters",
    "periodic_response",
    "perturbation_response",
    "protocol",
    "read",
    "recording",
    "response_function",
    "run",
    "samples",
    "sensitivities",
    "slider",
    "stability_boundary",
    "stiffness_threshold",
    "study",
    "theory",
    "transient",
    "transients",
    "tribometer",
    "units",
]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in _HOMES:
        room, there = _HOMES[name]
        value = getattr(import_module(f"asperity.{room}"), there)
    elif name == "sweep":  # what a study is called where it is run
        value = import_module("asperity.study")
    elif name in __all__:
        value = import_module(f"asperity.{name}")
    else:
        raise AttributeError(f"module 'asperity' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
