"""Protocols: experiments written as text, and run into a file."""

from asperity.study.protocol.export import Outline, outline, write_csv
from asperity.study.protocol.load import load_protocol
from asperity.study.protocol.mistakes import ProtocolError
from asperity.study.protocol.protocol import Protocol, Repeat, Solver, Start
from asperity.study.protocol.recording import Setup, record_run
from asperity.study.protocol.run import RunInterrupted, RunSummary, run_protocol

__all__ = [
    "Outline",
    "Protocol",
    "ProtocolError",
    "Repeat",
    "RunInterrupted",
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
