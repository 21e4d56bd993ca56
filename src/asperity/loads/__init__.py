"""Modulations and programmes of normal load, shear force and pulling velocity."""

from asperity._lazy import public_names
from asperity.loads.modulation import (
    Excitation as Excitation,
    Harmonic as Harmonic,
    Modulation as Modulation,
    Periodic as Periodic,
    modulated as modulated,
    sampled as sampled,
)
from asperity.loads.programme.programme import Programme as Programme
from asperity.loads.programme.steps import (
    CyclicLoading as CyclicLoading,
    Follow as Follow,
    Hold as Hold,
    Modulate as Modulate,
    ProgrammeStep as ProgrammeStep,
    RampLoad as RampLoad,
    RampVelocity as RampVelocity,
    Slide as Slide,
    StepLoad as StepLoad,
)

__all__ = public_names(globals())
