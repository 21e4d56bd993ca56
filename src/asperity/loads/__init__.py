"""Modulation programmes: load, shear force and pulling velocity, knowing nothing of friction."""

from asperity.loads.excitation import Excitation
from asperity.loads.harmonic import Harmonic
from asperity.loads.modulated import modulated, sampled
from asperity.loads.modulation import Modulation
from asperity.loads.periodic import Periodic
from asperity.loads.programme.programme import Programme
from asperity.loads.programme.steps import (
    Cycle,
    Follow,
    Hold,
    Modulate,
    RampLoad,
    RampVelocity,
    Slide,
    Step,
    StepLoad,
)

__all__ = [
    "Cycle",
    "Excitation",
    "Follow",
    "Harmonic",
    "Hold",
    "Modulate",
    "Modulation",
    "Periodic",
    "Programme",
    "RampLoad",
    "RampVelocity",
    "Slide",
    "Step",
    "StepLoad",
    "modulated",
    "sampled",
]
