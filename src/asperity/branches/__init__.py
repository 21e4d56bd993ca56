"""Continuation of periodic orbits in parameters, their bifurcations, and stability boundaries."""

from asperity.branches.branch import Bifurcation, Branch
from asperity.branches.continuation import continuation, doubled_branch
from asperity.branches.stability import BoundaryCurve, StabilityBoundary, stability_boundary

__all__ = [
    "Bifurcation",
    "BoundaryCurve",
    "Branch",
    "StabilityBoundary",
    "continuation",
    "doubled_branch",
    "stability_boundary",
]
