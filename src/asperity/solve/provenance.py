"""What a response says of where its numbers come from."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity._version import __version__
from asperity.slider import QuasiStatic

if TYPE_CHECKING:
    from asperity.solve.response import PeriodicResponse


def provenance_of(response: PeriodicResponse) -> dict[str, Any]:
    """Version, law, conventions, tolerance and source of the numbers."""
    law = type(response.slider.law)
    return {
        "asperity_version": __version__,
        "law": law.name,
        "source": law.source,
        "equation_of_motion": response.motion.name,
        "parameters": _parameters(response),
        "relative_tolerance": 1e-8,
        "modulation": response.load.formula,
        "convention": "F/W0 = mean + sum mu_n cos(n w t + phase_n), load w(t) = W/W0",
    }


def _parameters(response: PeriodicResponse) -> str:
    """All parameters with their units; a range where they are arrays."""
    law = response.slider.law
    values = {
        field.name.rstrip("_"): (getattr(law, field.name), field.metadata.get("unit", ""))
        for field in dataclasses.fields(law)
    }
    values |= {"K": (response.slider.K, "N/m"), "W0": (response.slider.W0, "N")}
    if not isinstance(response.motion, QuasiStatic):
        eta = response.motion.damping * response.slider.W0 / response.velocity
        values |= {"M": (response.slider.M, "kg"), "eta": (eta, "N s/m")}
    values |= {"V": (response.velocity, "m/s"), "epsilon": (response.epsilon, "")}
    values["frequency"] = (response.frequency, "Hz")
    return "; ".join(f"{name} = {_shown(*value)}" for name, value in values.items())


def _shown(value: Any, unit: str) -> str:
    low, high = float(np.min(value)), float(np.max(value))
    text = f"{low!r}" if low == high else f"{low!r} to {high!r}"
    return f"{text} {unit}".rstrip()
