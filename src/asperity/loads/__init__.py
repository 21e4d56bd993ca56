"""Modulations and programmes of normal load, shear force and pulling velocity."""

from asperity.loads.modulated import modulated, sampled
from asperity.loads.modulation import Excitation, Harmonic, Modulation, Periodic
from asperity.loads.programme.programme import Programme
from asperity.loads.programme.steps import (
    CyclicLoading,
    Follow,
    Hold,
    Modulate,
    ProgrammeStep,
    RampLoad,
    RampVelocity,
    Slide,
    StepLoad,
)

__all__ = [
    "CyclicLoading",
    "Excitation",
    "Follow",
    "Harmonic",
    "Hold",
    "Modulate",
    "Modulation",
    "Periodic",
    "Programme",
    "ProgrammeStep",
    "RampLoad",
    "RampVelocity",
    "Slide",
    "StepLoad",
    "modulated",
    "sampled",
]
