"""Protocols: experiments written as text, and run into a file."""

from asperity.protocol.export import RunOutline, outline, write_csv
from asperity.protocol.load import load_protocol
from asperity.protocol.mistakes import ProtocolError
from asperity.protocol.protocol import Protocol, ProtocolStart, Repeat, SolverSettings
from asperity.protocol.recording import RecordingSetup, record_run
from asperity.protocol.run import RunSummary, run_protocol

__all__ = [
    "Protocol",
    "ProtocolError",
    "ProtocolStart",
    "RecordingSetup",
    "Repeat",
    "RunOutline",
    "RunSummary",
    "SolverSettings",
    "load_protocol",
    "outline",
    "record_run",
    "run_protocol",
    "write_csv",
]
