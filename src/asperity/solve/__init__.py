"""Periodic solutions, their stability, and the limits that check them."""

from asperity.solve.averaged_limit import averaged_response
from asperity.solve.continuation.branch import Bifurcation, Branch
from asperity.solve.continuation.doubling import doubled_branch
from asperity.solve.continuation.follow import continuation
from asperity.solve.continuation.stability import (
    BoundaryCurve,
    StabilityBoundary,
    stability_boundary,
)
from asperity.solve.differentiable import harmonic_response
from asperity.solve.outcome import Outcome
from asperity.solve.periodic import periodic_response
from asperity.solve.perturbation import PerturbationResponse, perturbation_response
from asperity.solve.response import PeriodicResponse
from asperity.solve.sensitivity import Sensitivities, sensitivities
from asperity.solve.transients import Trajectory, integrate_blocks, transient

__all__ = [
    "Bifurcation",
    "BoundaryCurve",
    "Branch",
    "Outcome",
    "PeriodicResponse",
    "PerturbationResponse",
    "Sensitivities",
    "StabilityBoundary",
    "Trajectory",
    "averaged_response",
    "continuation",
    "doubled_branch",
    "harmonic_response",
    "integrate_blocks",
    "periodic_response",
    "perturbation_response",
    "sensitivities",
    "stability_boundary",
    "transient",
]
