"""Transients: motion of a slider under any programme of load and drive."""

from asperity.transients.events import Event, Termination
from asperity.transients.integration import Checkpoint
from asperity.transients.trajectory import Trajectory
from asperity.transients.transient import integrate_blocks, transient

__all__ = ["Checkpoint", "Event", "Termination", "Trajectory", "integrate_blocks", "transient"]
