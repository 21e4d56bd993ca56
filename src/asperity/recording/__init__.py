"""Recordings of a laboratory: a `Trace` of channels over time, its readers, checks and writers."""

from asperity.recording.derived import derive, stiffness_from_friction, stress_to_force
from asperity.recording.finding import Finding
from asperity.recording.readers import read
from asperity.recording.trace import Channel, Trace, check

__all__ = [
    "Channel",
    "Finding",
    "Trace",
    "check",
    "derive",
    "read",
    "stiffness_from_friction",
    "stress_to_force",
]
