"""Modulation programmes: load, shear force and pulling velocity, knowing nothing of friction."""

from asperity.loads.excitation import Excitation
from asperity.loads.harmonic import Harmonic
from asperity.loads.modulation import Modulation
from asperity.loads.periodic import Periodic

__all__ = ["Excitation", "Harmonic", "Modulation", "Periodic"]
