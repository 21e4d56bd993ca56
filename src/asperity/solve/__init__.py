"""Periodic solutions, their stability, and the limits that check them."""

from asperity.solve.outcome import Outcome
from asperity.solve.periodic import periodic_response
from asperity.solve.perturbation import PerturbationResponse, perturbation_response
from asperity.solve.response import PeriodicResponse

__all__ = [
    "Outcome",
    "PeriodicResponse",
    "PerturbationResponse",
    "periodic_response",
    "perturbation_response",
]
