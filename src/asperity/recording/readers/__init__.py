"""Readers of recordings: one function for all formats, and the parts of a new reader."""

from asperity.recording.readers.from_file import read
from asperity.recording.readers.raw import RawColumn, RawRecording

__all__ = ["RawColumn", "RawRecording", "read"]
