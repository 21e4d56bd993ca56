"""Periodic orbits: several methods, Floquet multipliers, derivatives.

Names are imported when first used, because the modules of the derivatives load slowly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from asperity._lazy import lazy_names

if TYPE_CHECKING:
    from asperity.orbit.differentiable import (
        ResponseFunction,
        Sensitivities,
        response_function,
        sensitivities,
    )
    from asperity.orbit.gradient.parametrised import ResponseValues
    from asperity.orbit.gradient.search import KnownOrbits
    from asperity.orbit.outcome import Outcome
    from asperity.orbit.period import Period, over_a_period
    from asperity.orbit.periodic import averaged_response, periodic_response
    from asperity.orbit.response import PeriodicResponse

#: Module of each public name.
_HOMES = {
    "KnownOrbits": "gradient.search",
    "Outcome": "outcome",
    "Period": "period",
    "PeriodicResponse": "response",
    "ResponseFunction": "differentiable",
    "ResponseValues": "gradient.parametrised",
    "Sensitivities": "differentiable",
    "averaged_response": "periodic",
    "over_a_period": "period",
    "periodic_response": "periodic",
    "response_function": "differentiable",
    "sensitivities": "differentiable",
}

__all__ = [
    "KnownOrbits",
    "Outcome",
    "Period",
    "PeriodicResponse",
    "ResponseFunction",
    "ResponseValues",
    "Sensitivities",
    "averaged_response",
    "over_a_period",
    "periodic_response",
    "response_function",
    "sensitivities",
]


__getattr__ = lazy_names(__name__, _HOMES)


def __dir__() -> list[str]:
    return sorted(__all__)
