"""An experiment from its protocol to the file of its motion."""

from __future__ import annotations

import os
from collections.abc import Callable

from asperity.parameters.arguments import file_path, function, switch
from asperity.protocol.load import load_protocol
from asperity.protocol.protocol import Protocol
from asperity.protocol.run import RunSummary, run_protocol


def run_experiment(
    protocol: Protocol | str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    resume: bool = False,
    progress: Callable[[float, float], None] | None = None,
) -> RunSummary:
    """Run a protocol, as ``asperity run`` does.

    Parameters
    ----------
    protocol : Protocol or path
        Or the path of its TOML file.
    out : path
        NetCDF file of the motion.
    resume : bool
        Go on after an interruption.
    progress : callable, optional
        Called now and then with the time reached and the end of the programme (s).

    Returns
    -------
    RunSummary

    Raises
    ------
    InputError
        If the protocol has a mistake, or `out` cannot be written.
    """
    asked = protocol
    if not isinstance(asked, Protocol):
        asked = load_protocol(file_path(asked, "protocol"))
    target = file_path(out, "out")
    resume, progress = switch(resume, "resume"), function(progress, "progress")
    return run_protocol(asked, target, resume=resume, progress=progress)
