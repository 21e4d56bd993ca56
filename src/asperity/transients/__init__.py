"""Transients: motion of a slider under any programme of load and drive."""

from asperity.transients.events import Event, Termination
from asperity.transients.integration import Checkpoint
from asperity.transients.motion import integrate_blocks, transient
from asperity.transients.trajectory import Trajectory

__all__ = ["Checkpoint", "Event", "Termination", "Trajectory", "integrate_blocks", "transient"]
