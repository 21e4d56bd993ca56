"""Transients: motion of a slider under any programme of load and drive."""

from asperity.transients.blocks import integrate_blocks
from asperity.transients.events import Event
from asperity.transients.integration import Checkpoint
from asperity.transients.motion import transient
from asperity.transients.termination import Termination
from asperity.transients.trajectory import Trajectory

__all__ = ["Checkpoint", "Event", "Termination", "Trajectory", "integrate_blocks", "transient"]
