"""Transients: motion of a slider under any programme of load and drive."""

from asperity.solve.transients.blocks import integrate_blocks
from asperity.solve.transients.events import Event
from asperity.solve.transients.front import transient
from asperity.solve.transients.march import Checkpoint
from asperity.solve.transients.stops import Stop
from asperity.solve.transients.trajectory import Trajectory

__all__ = ["Checkpoint", "Event", "Stop", "Trajectory", "integrate_blocks", "transient"]
