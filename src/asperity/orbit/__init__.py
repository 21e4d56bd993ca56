"""Periodic orbits: several methods, Floquet multipliers, derivatives."""

from asperity.orbit.differentiable import (
    ResponseFunction,
    response_function,
)
from asperity.orbit.gradient.known import KnownOrbits
from asperity.orbit.gradient.parametrised import ResponseValues
from asperity.orbit.outcome import Outcome
from asperity.orbit.period import Period, over_a_period
from asperity.orbit.periodic import averaged_response, periodic_response
from asperity.orbit.response import PeriodicResponse
from asperity.orbit.sensitivity import Sensitivities, sensitivities

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
