"""Periodic solutions, their stability, and the limits that check them."""

from asperity.solve.averaged_limit import averaged_response
from asperity.solve.differentiable import harmonic_response
from asperity.solve.outcome import Outcome
from asperity.solve.periodic import periodic_response
from asperity.solve.perturbation import PerturbationResponse, perturbation_response
from asperity.solve.response import PeriodicResponse
from asperity.solve.sensitivity import Sensitivities, sensitivities

__all__ = [
    "Outcome",
    "PeriodicResponse",
    "PerturbationResponse",
    "Sensitivities",
    "averaged_response",
    "harmonic_response",
    "periodic_response",
    "perturbation_response",
    "sensitivities",
]
