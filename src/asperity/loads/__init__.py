"""Normal-load programmes: W(t)/W0 and its derivative, knowing nothing of friction."""

from asperity.loads.harmonic import Harmonic

__all__ = ["Harmonic"]
