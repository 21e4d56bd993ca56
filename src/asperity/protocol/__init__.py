"""Protocols: experiments written as text, and run into a file."""

from asperity.protocol.protocol import Protocol, load_protocol
from asperity.protocol.recording import RecordingSetup, record_run
from asperity.protocol.run import RunSummary, run_protocol
from asperity.protocol.run_file import RunOutline, outline, write_csv
from asperity.questions.experiment import ProtocolError, ProtocolStart, Repeat, SolverSettings

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
