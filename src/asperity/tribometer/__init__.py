"""The virtual tribometer: from the motion of a slider to what a laboratory would record."""

from asperity.tribometer.sensors import LoadCell, SpringGauge
from asperity.tribometer.tribometer import Recorder, Tribometer

__all__ = ["LoadCell", "Recorder", "SpringGauge", "Tribometer"]
