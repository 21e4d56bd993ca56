"""Continuation of periodic orbits in parameters, their bifurcations, and stability boundaries."""

from asperity._lazy import public_names
from asperity.branches.boundaries import (
    BoundaryCurve as BoundaryCurve,
    StabilityBoundary as StabilityBoundary,
    stability_boundary as stability_boundary,
)
from asperity.branches.branch import Bifurcation as Bifurcation, Branch as Branch
from asperity.branches.continuation import continuation as continuation
from asperity.branches.period_doubling import doubled_branch as doubled_branch

__all__ = public_names(globals())
