"""Protocols: experiments written as text, and run into a file."""

from asperity.protocol.export import Outline, outline, write_csv
from asperity.protocol.load import load_protocol
from asperity.protocol.mistakes import ProtocolError
from asperity.protocol.protocol import Protocol, Repeat, Solver, Start
from asperity.protocol.recording import Setup, record_run
from asperity.protocol.run import RunSummary, run_protocol

__all__ = [
    "Outline",
    "Protocol",
    "ProtocolError",
    "Repeat",
    "RunSummary",
    "Setup",
    "Solver",
    "Start",
    "load_protocol",
    "outline",
    "record_run",
    "run_protocol",
    "write_csv",
]
