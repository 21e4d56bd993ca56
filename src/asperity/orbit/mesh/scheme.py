"""The collocation methods of periodic orbits, and which of them suits an equation of motion."""

from __future__ import annotations

from asperity.algebra.runge_kutta import CollocationScheme, gauss_legendre, radau_iia
from asperity.slider import Motion, RadiatingAsperities, StiffInertial

#: Collocation points in an interval.
STAGES = 4

GAUSS = gauss_legendre(STAGES)
RADAU = radau_iia(STAGES)


def scheme_for(system: Motion) -> CollocationScheme:
    """The method for an equation of motion: Radau IIA where modes decay within an interval."""
    return RADAU if isinstance(system, StiffInertial | RadiatingAsperities) else GAUSS
