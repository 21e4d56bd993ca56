"""Protocols: experiments written as text, and run into a file."""

from asperity._lazy import public_names
from asperity.protocol.protocol import Protocol as Protocol, load_protocol as load_protocol
from asperity.protocol.recording import RecordingSetup as RecordingSetup, record_run as record_run
from asperity.protocol.run import RunSummary as RunSummary, run_protocol as run_protocol
from asperity.protocol.run_file import (
    RunOutline as RunOutline,
    outline as outline,
    write_csv as write_csv,
)
from asperity.questions.experiment import (
    ProtocolError as ProtocolError,
    ProtocolStart as ProtocolStart,
    Repeat as Repeat,
    SolverSettings as SolverSettings,
)

__all__ = public_names(globals())
